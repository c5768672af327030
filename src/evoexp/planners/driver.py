"""Searches whose kernels compute several generations per call: each call gives a block of them."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evoexp.evolution.operators import operator
from evoexp.numeric.elementary import standard_normal
from evoexp.numeric.generator_state import state_bytes, states_behind
from evoexp.numeric.random_stream import Draws
from evoexp.planners.planner import Candidate, Keeper
from evoexp.records import Best, Block, FloatArray, IntArray

_NO_NORMALS = np.empty((0, 0))
SUMMARY = 4  # of a generation: index of the best, mean and deviation of costs, number of feasible


def generations_per_call(most: int, size: int, cached: int) -> int:
    """Return how many generations of `size` [B] are best computed in one call of a kernel.

    Behind `most` the call itself takes no time; beyond `cached` [B] they push each other out of
    caches.
    """
    return max(1, min(most, cached // max(1, size)))


class TableSearch(ABC):
    """One run, whose generations are rows of tables: number g is at place g modulo `num_places`."""

    costs: FloatArray  # (places, …, individuals)
    # of the generator behind each generation computed last, where it is ahead of them
    states: list[bytes] | None = None
    queries_each = 0  # configurations that judging an individual asks for
    is_done = False  # whether the search ends before its last generation

    def __init__(self, ga: operator.PopulationSettings, per_call: int) -> None:
        """Begin a run that computes `per_call` generations per call, at most."""
        # the generations of a call, and the one before them
        self.num_places = min(per_call, ga.num_generations) + 1
        self.summaries = np.empty((self.num_places, SUMMARY))
        self.reached = 0  # index of the generation computed last
        self.keeper, self._ga = Keeper(), ga

    def blocks(self, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the initial population, then every other generation, one block per call."""
        self.begin(rng)
        yield self._block(0, 0)
        last, self.reached = self._ga.num_generations, 0
        while self.reached < last and not self.is_done:
            first = self.reached
            self.reached = self.go_on(rng, first, min(first + self.num_places - 1, last))
            yield self._block(first + 1, self.reached)

    def _block(self, first: int, last: int) -> Block:
        """Count the generations from one to another, and return their block."""
        keeper, places = self.keeper, np.arange(first, last + 1) % self.num_places
        bests = self.improve(places)
        _, means, deviations, num_feasible = self.summaries[places].T.tolist()
        ends, steps = last == self._ga.num_generations, range(1, len(places) + 1)
        evaluations, queries = self.counts(first)
        columns = self.lowest(places).tolist(), means, deviations, [*map(int, num_feasible)]
        spent = [keeper.evaluations + evaluations * k for k in steps]
        asked = [keeper.collision_queries + queries * k for k in steps]
        shown = self.costs[places], lambda k: self.population(first + k), self.states
        front = self.criteria(places.item(-1)) if ends else None
        block = Block(keeper.index + 1, bests, *columns, spent, asked, *shown, front)
        keeper.index, keeper.evaluations = keeper.index + len(places), block.evaluations[-1]
        keeper.collision_queries = block.collision_queries[-1]
        return block

    def improve(self, places: IntArray) -> list[Best]:
        """Keep the best of the generations at some places; return the bests of their block."""
        keeper, bests = self.keeper, {0: self.keeper.standing}
        for k, cost in enumerate(self.lowest(places).tolist()):
            if keeper.improves(cost):
                keeper.keep(cost, self.best(places.item(k)))
                bests[k] = keeper.standing._replace(place=k)
        return [*bests.values()]

    def lowest(self, places: IntArray) -> FloatArray:
        """Return the lowest cost of each of the generations at some places."""
        individuals = self.summaries[places, 0].astype(np.int64)
        return np.asarray(self.costs[places, individuals])

    def best(self, place: int) -> Candidate:
        """Return the solution that has the lowest cost of a generation."""
        return self.candidate(place, int(self.summaries[place, 0]))

    def candidate(self, place: int, individual: int) -> Candidate:
        """Return an individual as it is recorded."""
        raise NotImplementedError

    def counts(self, index: int) -> tuple[int, int]:
        """Return evaluations and configurations asked for of a generation, 0 the initial one."""
        count = self._ga.num_offspring if index else self._ga.population_size
        return count, count * self.queries_each

    def criteria(self, place: int) -> FloatArray | None:
        """Return the criteria of the last generation, if its front is recorded."""
        return None

    @abstractmethod
    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population, at place 0."""

    @abstractmethod
    def go_on(self, rng: np.random.Generator, first: int, last: int) -> int:
        """Compute generations behind one, up to another; return the last one computed.

        Without `states`, the generator is behind it as all these generations are recorded with it.
        """

    @abstractmethod
    def population(self, index: int) -> NDArray[Any]:
        """Return the population of a generation of the last call; empty if it is gone."""


class GeneticSearch(TableSearch):
    """A run whose generations are bred by the operators of a configuration."""

    def __init__(
        self,
        ga: operator.PopulationSettings,
        operators: operator.Operators,  # by which offspring are made
        genome: operator.Genome,  # of every individual
        per_call: int,  # generations computed per call, at most
    ) -> None:
        # normal deviates take no fixed number of uniform ones: generations are drawn one by one
        takes_normals, count = operators.mutation.takes_normals, ga.num_offspring
        super().__init__(ga, 1 if takes_normals else per_call)
        self.operators = operators.addresses  # the first arguments of a kernel that breeds
        self.breeding = operator.Breeding.of(operators, genome, ga, [count])  # and their rules
        self.num_drawn = int(self.breeding.sizes.sum())  # uniform numbers of a generation
        # normal deviates of a generation: genes, offspring
        self.num_normals = len(genome.limits) if takes_normals else 0, count
        self.parents, self.elites = (np.empty(n, np.int64) for n in (count, ga.num_elites))

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> int:
        """Draw the numbers of generations, and compute these."""
        before, state = rng.bit_generator.state, state_bytes(rng.bit_generator)
        uniforms = rng.random((last - first, self.num_drawn))
        normals = standard_normal(rng, self.num_normals) if self.num_normals[0] else _NO_NORMALS
        reached = self.advance(uniforms, normals, first)
        if reached < last:  # the generator goes on behind the last generation computed
            rng.bit_generator.state = before
            rng.random((reached - first) * self.num_drawn)
        behind = states_behind(state, [self.num_drawn] * (reached - first - 1))
        self.states = [*behind, state_bytes(rng.bit_generator)]
        return reached

    @abstractmethod
    def advance(self, uniforms: FloatArray, normals: FloatArray, first: int) -> int:
        """Compute the generations behind one with their numbers; return the last one computed.

        These are uniforms (generations, `num_drawn`) in [0, 1), and normals (genes, offspring) or
        none.
        """


class ScaledSearch(TableSearch):
    """A run whose parents are chosen as in `succession`, by blocks of uniform numbers.

    All generations of a call are recorded with the generator as it is behind the last of them: the
    number of generations per call enters the digest.
    """

    table: Any  # a NamedTuple of arrays, whose first axis are generations that take turns

    def __init__(self, ga: operator.ScaledGenetic, per_call: int, num_drawn: int) -> None:
        """Begin a run that draws `num_drawn` uniform numbers at once, at least."""
        super().__init__(ga, per_call)
        self.draws = Draws(num_drawn)

    def at(self, generation: int) -> Any:
        """Return the population of a generation: views of the table."""
        return type(self.table)(*(values[generation % len(values)] for values in self.table))

    @abstractmethod
    def breed(self, present: Any, following: Any) -> bool:
        """Write the population that follows another; return whether the draws sufficed."""

    @abstractmethod
    def note(self, population: Any, place: int) -> None:
        """Write the record of a generation to a place."""

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> int:
        """Compute generations, each anew with more numbers if these did not suffice."""
        for generation in range(first, last):
            before, following = self.draws.block.taken.item(0), self.at(generation + 1)
            while not self.breed(self.at(generation), following):
                self.draws.block.taken[0], before = before, 0
                self.draws.extend(rng)
            self.note(following, (generation + 1) % self.num_places)
        return last
