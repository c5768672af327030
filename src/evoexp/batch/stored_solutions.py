"""Evaluates the solutions of a log again and compares them with what the log says of them.

The search is not run again: fronts, arrays and statistics of populations need `reproduction`.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from evoexp.batch.memory_limit import machine_memory, refuse_large
from evoexp.batch.reproduction import FieldDifference, differing, stored_condition
from evoexp.errors import EvoexpError
from evoexp.planners.proofs import judge_motion
from evoexp.records import flatten
from evoexp.store.log_reader import LogContents

LARGEST = 1e7  # of a solution's numbers, as of those of robots and scenarios, in any unit
_UNFIT = (ValueError, ArithmeticError, LookupError, EvoexpError)  # raised by numbers of no solution


def contradictions(path: Path, log: LogContents) -> Iterator[str]:
    """Yield the contradictions between a log's solutions and the costs, terms and verdict it tells.

    EvoexpError is raised where they cannot be evaluated here: another revision, a missing package.
    """
    condition = stored_condition(path, log)
    refuse_large(condition, machine_memory())
    with np.errstate(all="ignore"):
        yield from map(str, _contradictions(*condition.prepare(), log))


def _contradictions(planner: Any, problem: Any, log: LogContents) -> Iterator[FieldDifference]:
    rows = {row.index: row for row in log.generations}
    terms: Mapping[str, float] = {}
    for solution in log.solutions:
        name = f"solution of generation {solution.generation}"
        row = rows.get(solution.generation)
        if row is None:
            yield FieldDifference(name, "there", "of no generation of the log", math.inf)
            return
        yield from differing({"cost": solution.cost}, {"cost": row.best_cost}, f"{name}: ")
        try:
            if not (np.abs(solution.values) <= LARGEST).all():  # NaN, too
                raise ValueError(f"its numbers must be finite and at most {LARGEST:g}")
            terms = planner.evaluate(problem, solution.values)
        except _UNFIT as error:
            if not isinstance(error, EvoexpError) or math.isfinite(solution.cost):
                yield FieldDifference(name, "there", f"none: {error}", math.inf)
                return
            continue  # what costs inf may be no solution at all
        yield from _unlike(row.terms, terms, f"{name}: ")
        cost = float(planner.cost_of_terms(terms))
        if math.isfinite(solution.cost) and not math.isnan(cost):
            yield from _unlike({"cost": solution.cost}, {"cost": cost}, f"{name}: ")
    yield from _unlike(log.summary.terms, terms, "last solution: ")
    # the motion is judged last: that of a replaced solution might take very long
    last = log.solutions[-1].values
    verdict = judge_motion(planner, problem, planner.motion(problem, last))._asdict()
    yield from _unlike(flatten(log.summary), verdict, "motion of the last solution: ")


def _unlike(
    stored: Mapping[str, Any], again: Mapping[str, Any], prefix: str
) -> Iterator[FieldDifference]:
    """Yield the fields of both that differ by more than rounding."""
    shared = {name: again[name] for name in again if name in stored}
    for each in differing({name: stored[name] for name in shared}, shared):
        if not each.is_close:
            yield each._replace(name=prefix + each.name)
