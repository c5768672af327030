"""One evolution of a planner, with copies of all that it showed, and what is demanded of it."""

import functools
import random
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy import random as numpy_random
from numpy.typing import NDArray

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.records import FloatArray, Generation, generations
from evoexp.store.log import Finished

Check = Callable[[Condition], None]
Demand = tuple[object, str, object]  # whether an obligation is kept, what it is, what was instead

CHECKS: list[Check] = []


class ContractBroken(AssertionError):
    """A planner or an operator that does not keep one of its obligations."""


class EvolutionRecord(NamedTuple):
    """Replicate 0 of a condition."""

    planner: Any  # the planner
    problem: Any  # its problem
    # the initial one first; their arrays are copies made before the next one was asked for
    generations: list[Generation]
    bests: list[FloatArray]  # the very arrays of the best solutions, which must keep their values
    last_population: NDArray[Any]  # the last population itself, after the planner has ended
    has_drawn: bool  # whether the planner drew from its generator
    global_randomness: bool  # whether numpy's and Python's global generators were used

    @property
    def last(self) -> Generation:
        """The last record."""
        return self.generations[-1]


@functools.lru_cache(maxsize=8)
def evolution(condition: Condition) -> EvolutionRecord:
    """Run replicate 0 of a condition and keep everything that the planner showed."""
    before, rng = _global_states(), condition.rng(0)
    untouched = rng.bit_generator.state
    planner, problem = condition.prepare()
    records, bests, population = list[Generation](), list[FloatArray](), np.empty(0)
    for each in generations(planner.evolve(problem, rng)):
        population = each.population
        bests.append(each.best)
        best, costs, copied = each.best.copy(), each.costs.copy(), population.copy()
        records.append(each._replace(best=best, costs=costs, population=copied))
    if not records:
        raise ContractBroken("evolve must yield the initial population at least; was nothing")
    has_drawn, used = rng.bit_generator.state != untouched, before != _global_states()
    return EvolutionRecord(planner, problem, records, bests, population, has_drawn, used)


@functools.lru_cache(maxsize=16)
def finished(condition: Condition, replicate: int) -> Finished:
    """Return the log and the summary of a replicate."""
    return run_replicate(condition, replicate)


def obligation(demands: Callable[[Condition], Iterator[Demand]]) -> Check:
    """Make a check of what a function demands of a condition's planner."""

    @functools.wraps(demands)
    def check(condition: Condition) -> None:
        for is_kept, must, was in demands(condition):
            if not is_kept:
                name = getattr(condition.planner, "component", type(condition.planner).__name__)
                raise ContractBroken(f"planner '{name}': {must}; was {was}")

    CHECKS.append(check)
    return check


def _global_states() -> tuple[Any, ...]:
    state: Any = numpy_random.get_state(legacy=False)  # noqa: NPY002  # its use is looked for
    return repr(state), state["state"]["key"].tobytes(), random.getstate()
