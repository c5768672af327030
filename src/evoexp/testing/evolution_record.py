"""One evolution of a planner, generation by generation, with copies of all that it showed."""

import functools
import random
from typing import Any, NamedTuple

import numpy as np
from numpy import random as numpy_random
from numpy.typing import NDArray

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.records import FloatArray, Generation, generations
from evoexp.store.log import Finished


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
    must = "evolve must yield the initial population at least"
    demand(records, condition, must, "nothing")
    has_drawn, used = rng.bit_generator.state != untouched, before != _global_states()
    return EvolutionRecord(planner, problem, records, bests, population, has_drawn, used)


@functools.lru_cache(maxsize=16)
def finished(condition: Condition, replicate: int) -> Finished:
    """Return the log and the summary of a replicate."""
    return run_replicate(condition, replicate)


def demand(holds: object, condition: Condition, obligation: str, was: object) -> None:
    """Raise `ContractBroken` unless a planner keeps an obligation."""
    if not holds:
        name = getattr(condition.planner, "component", type(condition.planner).__name__)
        raise ContractBroken(f"planner '{name}': {obligation}; was {was}")


def _global_states() -> tuple[Any, ...]:
    state: Any = numpy_random.get_state(legacy=False)  # noqa: NPY002  # its use is looked for
    return repr(state), state["state"]["key"].tobytes(), random.getstate()
