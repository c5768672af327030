"""Selection, crossover and mutation as components, settings that use them, and breeding by them.

An operator is a frozen component: its fields are its settings, `num_uniforms` says how many uniform
numbers it takes for a generation, and one kernel does the work. Every kernel of a kind has the same
arguments, so planners take it by its address and are compiled once, whoever wrote the operator.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Annotated, Any, ClassVar, NamedTuple, Self, TypeAlias, TypeVar

import numba
import numpy as np
from pydantic import BeforeValidator, Field

from evoexp.numeric.compilation import KernelAddress, kernel
from evoexp.records import FloatArray, IntArray
from evoexp.registry import COMPONENTS, registered
from evoexp.validation import Component, Count, NonNegativeCount, Rate


class Genome(NamedTuple):
    """The limits and the layout of a problem's genes."""

    limits: FloatArray  # (genes, 2) least and greatest value of each gene
    arms: IntArray  # (arms, 2) first joint of each arm, and the one behind its last
    num_points: int  # genes of a joint: point i of joint j is gene j · num_points + i

    @classmethod
    def of(cls, limits: FloatArray) -> "Genome":
        """Return genes that do not form via-points: one arm, one point."""
        return cls(np.ascontiguousarray(limits), np.array([[0, len(limits)]]), 1)


class Context(NamedTuple):
    """The numbers and rules that an operator works with."""

    uniforms: FloatArray  # (`num_uniforms`,) in [0, 1)
    normals: FloatArray  # (genes, ≥ offspring) normal deviates for a mutation that takes them
    rate: float  # probability in [0, 1]: of a pair to be crossed, or of a mutation
    progress: float  # t / T of the parents' generation, 0 of the initial one
    settings: FloatArray  # values of the operator's fields in their order, true as 1
    genome: Genome  # limits and layout of the genes


VECTOR, ROWS = numba.float64[::1], numba.float64[:, ::1]
INDICES, COUNT = numba.int64[::1], numba.int64
_NONE = np.zeros(1), np.zeros((1, 2))
CONTEXT = numba.typeof(Context(*_NONE, 0.0, 0.0, _NONE[0], Genome.of(_NONE[1])))


class Operator(Component, is_base=True):
    """A component whose kernel takes its numeric fields as `settings`, in their order."""

    kernel_name: ClassVar[str]  # of the static method that is the kernel
    signature: ClassVar[Any]  # of every kernel of the kind

    @property
    def settings(self) -> FloatArray:
        """The values of the fields, true as 1 and false as 0."""
        return np.array([float(getattr(self, name)) for name in type(self).model_fields])

    @property
    def address(self) -> KernelAddress:
        """The compiled kernel, as the kernels of planners take it."""
        return _address(getattr(type(self), self.kernel_name), self.signature)


@functools.cache
def _address(function: Callable[..., None], signature: Any) -> KernelAddress:
    return KernelAddress(function, signature)


class Selection(Operator, is_base=True):
    """Draws parents by their costs.

    Its kernel is the static method `select(costs, context, parents)`:

    - costs: (individuals,) lower is better; inf where an individual is infeasible.
    - context: Numbers and settings.
    - parents: (parents,) written: indices of individuals. Neighbours are a pair.
    """

    kernel_name: ClassVar[str] = "select"
    select: ClassVar[Any]
    signature: ClassVar[Any] = numba.void(VECTOR, CONTEXT, INDICES)

    def num_uniforms(self, size: int, count: int) -> int:
        """Return the number of uniform numbers: here one for each of `count` parents."""
        return count


class Crossover(Operator, is_base=True):
    """Makes offspring from parents; parents 2k and 2k + 1 form a pair, an odd last one stays alone.

    Its kernel is the static method `cross(genomes, parents, context, out)`:

    - genomes: (genes, individuals, padding allowed).
    - parents: (offspring,) indices of individuals.
    - context: Numbers, rate, settings, genes; a pair that is not crossed is copied.
    - out: (genes, ≥ offspring) written, every gene of all offspring.
    """

    kernel_name: ClassVar[str] = "cross"
    cross: ClassVar[Any]
    signature: ClassVar[Any] = numba.void(ROWS, INDICES, CONTEXT, ROWS)

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return the number of uniform numbers that `count` offspring take."""
        raise NotImplementedError


class Mutation(Operator, is_base=True):
    """Changes offspring in place.

    Its kernel is the static method `mutate(genomes, count, context)`:

    - genomes: (genes, ≥ count) changed.
    - count: Individuals; columns behind them are left alone.
    - context: Numbers, rate, progress, settings, genes.
    """

    kernel_name: ClassVar[str] = "mutate"
    mutate: ClassVar[Any]
    signature: ClassVar[Any] = numba.void(ROWS, COUNT, CONTEXT)
    takes_normals: ClassVar[bool] = False

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return the number of uniform numbers that `count` individuals take."""
        raise NotImplementedError


Kind = TypeVar("Kind", bound=Operator)


def _by_name(value: Any) -> Any:
    """Return the operator that a registered name alone stands for, with its usual settings."""
    registration = registered(COMPONENTS, value) if isinstance(value, str) else None
    kind = registration.load() if registration else None
    return kind() if isinstance(kind, type) and issubclass(kind, Operator) else value


Named = Annotated[Kind, BeforeValidator(_by_name)]
"""A field of operators: a component, or the name of one whose settings all have defaults."""


class PopulationSettings(Component, is_base=True):
    """Settings of a generational genetic algorithm; every planner uses the same words."""

    population_size: Count  # individuals per generation
    num_generations: NonNegativeCount  # generations after the initial one
    num_elites: NonNegativeCount  # best individuals copied untouched into the next generation
    crossover_rate: Rate  # probability that a pair of parents is crossed
    mutation_rate: Rate  # probability of a mutation, of whatever the planner mutates

    def _check(self) -> None:
        size = self.population_size
        self.demand("num_elites", self.num_elites <= size, f"at most population_size ({size})")

    @property
    def num_offspring(self) -> int:
        """Individuals that are new in every generation."""
        return self.population_size - self.num_elites


class GeneticSettings(PopulationSettings):
    """A genetic algorithm with operators of the planner's paper, or with others in their place."""

    component: ClassVar[str] = "genetic"

    selection: Named[Selection] | None = None  # None: as the planner's paper selects parents
    crossover: Named[Crossover] | None = None  # None: the paper's
    mutation: Named[Mutation] | None = None  # None: the paper's


class ScaledGenetic(PopulationSettings):
    """A generational genetic algorithm whose parents are chosen as in `succession`.

    Costs are scaled linearly, then parents are drawn by stochastic remainder sampling without
    replacement. The systematic scan of the remainders is assumed: Chen & Zalzala 1995 name the
    sampling only.
    """

    # copies that the best one expects, in units of the mean [-]
    scaling_multiple: Annotated[float, Field(gt=1.0)]


# kernels of operators, by their addresses: see `Selection`, `Crossover`, `Mutation`
Select: TypeAlias = Any
Cross: TypeAlias = Any
Mutate: TypeAlias = Any


class Operators(NamedTuple):
    """The operators of a genetic algorithm."""

    selection: Selection
    crossover: Crossover
    mutation: Mutation

    @property
    def addresses(self) -> tuple[KernelAddress, KernelAddress, KernelAddress]:
        """Their kernels, as other kernels take them."""
        return self.selection.address, self.crossover.address, self.mutation.address


class Breeding(NamedTuple):
    """The rules of breeding, as kernels take them."""

    genome: Genome  # of every individual
    crossover_rate: float  # probability that a pair is crossed
    mutation_rate: float  # probability of a mutation, of whatever the operator mutates
    num_generations: int  # T
    most: int  # offspring
    # (most − least offspring + 1, 3) uniform numbers that selection, crossover and mutation take
    # for so many offspring, the most first
    sizes: IntArray
    selecting: FloatArray  # settings of the selection
    crossing: FloatArray  # settings of the crossover
    mutating: FloatArray  # settings of the mutation

    @classmethod
    def of(
        cls,
        operators: Operators,
        genome: Genome,  # of every individual
        ga: PopulationSettings,
        counts: Sequence[int],  # of offspring that there may be: each one less than the one before
    ) -> Self:
        """Return the rules of breeding."""
        selection, crossover, mutation = operators
        sizes = [
            (
                selection.num_uniforms(ga.population_size, count),
                crossover.num_uniforms(genome, count),
                mutation.num_uniforms(genome, count),
            )
            for count in counts
        ]
        settings = (operator.settings for operator in operators)
        rates = ga.crossover_rate, ga.mutation_rate
        return cls(genome, *rates, ga.num_generations, counts[0], np.array(sizes), *settings)


@kernel
def breed(
    select: Select,
    cross: Cross,
    mutate: Mutate,
    numbers: FloatArray,  # uniform, those of selection, then of crossover, then of mutation
    normals: FloatArray,  # (genes, ≥ offspring) normal deviates, if the mutation takes any
    index: int,  # t of the parents' generation
    rate: float,  # of mutation, on the way to the next one
    rules: Breeding,
    costs: FloatArray,  # (individuals,) of the parents' generation
    genomes: FloatArray,  # (genes, individuals) of the same, padding allowed
    parents: IntArray,  # (offspring,) written
    out: FloatArray,  # (genes, ≥ offspring) written
) -> None:
    """Write offspring: selected, crossed and mutated."""
    genome, count, progress = rules.genome, len(parents), index / rules.num_generations
    # the numbers of each operator
    sizes = rules.sizes[rules.most - count]
    first, last = sizes[0], sizes[0] + sizes[1]
    one, two, three = numbers[:first], numbers[first:last], numbers[last : last + sizes[2]]
    # selection, crossover, mutation
    select(costs, Context(one, normals, 1.0, progress, rules.selecting, genome), parents)
    crossing = Context(two, normals, rules.crossover_rate, progress, rules.crossing, genome)
    cross(genomes, parents, crossing, out)
    mutate(out, count, Context(three, normals, rate, progress, rules.mutating, genome))
