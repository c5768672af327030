"""One evolution of a planner, generation by generation, with copies of all that it showed."""

import functools
import random
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy import random as numpy_random
from numpy.typing import NDArray

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.records import FloatArray, Generation, generations
from evoexp.store.log import Finished


class ContractBroken(AssertionError):
    """A planner or an operator that does not keep one of its obligations."""


class Watched(NamedTuple):
    """One generation as a planner yielded it, and copies made before the next one was asked for."""

    generation: Generation  # the record; `costs` and `population` are copies
    best_afterwards: FloatArray  # the very array of the best solution; it must keep its values
    best: FloatArray  # copy of these values


class EvolutionRecord(NamedTuple):
    """Replicate 0 of a condition."""

    planner: Any  # the planner
    problem: Any  # its problem
    watched: tuple[Watched, ...]  # one entry per generation, the initial one first
    last_population: NDArray[Any]  # the last population itself, after the planner has ended
    has_drawn: bool  # whether the planner drew from its generator
    global_randomness: bool  # whether numpy's and Python's global generators were used

    @property
    def generations(self) -> list[Generation]:
        """The records."""
        return [each.generation for each in self.watched]

    @property
    def last(self) -> Generation:
        """The last record."""
        return self.watched[-1].generation


@functools.lru_cache(maxsize=8)
def evolution(condition: Condition) -> EvolutionRecord:
    """Run replicate 0 of a condition and keep everything that the planner showed."""
    before, rng = _global_states(), condition.rng(0)
    untouched = rng.bit_generator.state
    planner, problem = condition.prepare()
    watched, population = [], np.empty(0)
    for generation in generations(planner.evolve(problem, rng)):
        population = generation.population
        copied = generation._replace(costs=generation.costs.copy(), population=population.copy())
        watched.append(Watched(copied, generation.best, np.array(generation.best)))
    if not watched:
        broken(condition, "evolve must yield the initial population at least", "nothing")
    has_drawn, used = rng.bit_generator.state != untouched, before != _global_states()
    return EvolutionRecord(planner, problem, tuple(watched), population, has_drawn, used)


@functools.lru_cache(maxsize=16)
def finished(condition: Condition, replicate: int) -> Finished:
    """Return the log and the summary of a replicate."""
    return run_replicate(condition, replicate)


def broken(condition: Condition, obligation: str, was: object) -> NoReturn:
    """Say which obligation a planner does not keep."""
    name = getattr(condition.planner, "component", type(condition.planner).__name__)
    raise ContractBroken(f"planner '{name}': {obligation}; was {was}")


def demand(holds: object, condition: Condition, obligation: str, was: object) -> None:
    """Raise `ContractBroken` unless an obligation holds."""
    if not holds:
        broken(condition, obligation, was)


def _global_states() -> tuple[Any, ...]:
    state: Any = numpy_random.get_state(legacy=False)  # noqa: NPY002  # its use is looked for
    return repr(state), state["state"]["key"].tobytes(), random.getstate()
