"""Selection, crossover and mutation as components, evoexp's own and those of other packages.

An operator is a frozen component: its fields are its settings, `num_uniforms` says how many uniform
numbers it takes for a generation, and one kernel does the work. Every kernel of a kind has the same
arguments, so planners take it by its address and are compiled once, whoever wrote the operator.
"""

import functools
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, NamedTuple, TypeVar

import numba
import numpy as np
from pydantic import BeforeValidator

from evoexp.numeric.compilation import KernelAddress
from evoexp.records import FloatArray, IntArray
from evoexp.registry import COMPONENTS, registered
from evoexp.validation import Component


class Genome(NamedTuple):
    """The genes of a problem, as far as operators need to know them."""

    limits: FloatArray  # (genes, 2) least and greatest value of each gene
    arms: IntArray  # (arms, 2) first joint of each arm, and the one behind its last
    num_points: int  # genes of a joint: point i of joint j is gene j · num_points + i

    @classmethod
    def of(cls, limits: FloatArray) -> "Genome":
        """Return genes that are no strings of via-points: one arm, one point."""
        return cls(np.ascontiguousarray(limits), np.array([[0, len(limits)]]), 1)


class Context(NamedTuple):
    """The numbers and rules that an operator works with."""

    uniforms: FloatArray  # (`num_uniforms`,) in [0, 1)
    normals: FloatArray  # (genes, ≥ offspring) normal deviates for a mutation that takes them
    rate: float  # probability in [0, 1]: of a pair to be crossed, or of a mutation
    progress: float  # t / T of the parents' generation, 0 of the initial one
    settings: FloatArray  # of the operator, see `Operator.settings`
    genome: Genome  # limits and layout of the genes


VECTOR, ROWS = numba.float64[::1], numba.float64[:, ::1]
INDICES, COUNT = numba.int64[::1], numba.int64
_NONE = np.zeros(1), np.zeros((1, 2))
CONTEXT = numba.typeof(Context(*_NONE, 0.0, 0.0, _NONE[0], Genome.of(_NONE[1])))


class Operator(Component):
    """A component whose numeric fields are what its kernel takes as `settings`, in their order."""

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


class Selection(Operator):
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


class Crossover(Operator):
    """Makes offspring of parents; parents 2k and 2k + 1 form a pair, an odd last one stays alone.

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


class Mutation(Operator):
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
"""A field of operators: a component, or the name of one whose settings all have usual values."""
