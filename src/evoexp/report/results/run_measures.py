"""Quantities of single runs, counts of runs and groups of conditions that several papers share."""

import collections
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from evoexp.records import BoolArray, FloatArray
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import Proportion


def planned(results: Results) -> Mapping[str, bool]:
    """Return name of a planner → whether all results are of it, controls included."""
    names = {str(c.planner.component) for c in results.with_data}
    return collections.defaultdict(bool, {name: len(names) == 1 for name in names})


def solved(condition: ConditionResults) -> np.ndarray:
    """Return whether each run ended with a solution, (done,)."""
    return condition.summaries["solved"].to_numpy(dtype=bool)


def success(condition: ConditionResults) -> Proportion:
    """Count the runs that ended with a solution."""
    return Proportion(condition.solved, condition.done)


def counted(holds: Any) -> Proportion:
    """Count the runs in which something holds, (runs,) of truth values."""
    return Proportion(int(np.count_nonzero(holds)), len(holds))


def search_seconds(condition: ConditionResults) -> FloatArray:
    """Return the CPU time of each run without that of the exact verdict, (done,) [s]."""
    return np.asarray(condition.column("cpu_s") - condition.column("certificate_s"))


def median_replicate(
    condition: ConditionResults, values: FloatArray, among: np.ndarray | None = None
) -> int:
    """Return the replicate that has the median value, the lower one of two.

    Values are (done,) without NaN; `among`, (done,), tells which runs are candidates, None: all.
    """
    candidates = np.arange(len(values)) if among is None else np.flatnonzero(among)
    ordered = candidates[np.argsort(values[candidates], kind="stable")]
    return int(condition.summaries.index[ordered[(len(ordered) - 1) // 2]])


def grouped(
    conditions: Iterable[ConditionResults], key: Callable[[ConditionResults], object]
) -> tuple[tuple[ConditionResults, ...], ...]:
    """Return the conditions in groups of equal keys, groups in the order of their first members.

    Keys are compared by their `repr`, so a canonical form will do.
    """
    found: dict[str, list[ConditionResults]] = {}
    for condition in conditions:
        found.setdefault(repr(key(condition)), []).append(condition)
    return tuple(map(tuple, found.values()))


def first_feasible(condition: ConditionResults) -> FloatArray:
    """Return the first generation that has a feasible individual, (done,); inf: none has."""
    found = condition.column("first_feasible_generation")
    return np.where(np.isnan(found), np.inf, found)


def num_joints(condition: ConditionResults) -> int:
    """Return the number of joints of the arm, whose start the scenario names."""
    return len(condition.scenario.q_start)


def certified(condition: ConditionResults) -> Proportion:
    """Count the solved runs whose motions the exact verdict certifies."""
    free = condition.summaries["certified"].eq(True).fillna(False).to_numpy(dtype=bool)
    return counted(free[solved(condition)])


def touches(condition: ConditionResults) -> BoolArray:
    """Return whether the exact verdict refutes each run's motion, (done,)."""
    return condition.summaries["certified"].eq(False).fillna(False).to_numpy(dtype=bool)


def summed(prefix: str) -> Values:
    """Return the function that sums all columns of a run with a prefix, (done,); NaN if none."""

    def total(condition: ConditionResults) -> FloatArray:
        names = [str(name) for name in condition.summaries if str(name).startswith(prefix)]
        columns = [condition.column(name) for name in names] or [np.full(condition.done, np.nan)]
        return np.asarray(np.sum(columns, axis=0))

    return total


def where_solved(values: Values) -> Values:
    """Return values of runs, (done,), that are infinite where a run is not solved."""
    return lambda condition: np.where(solved(condition), values(condition), np.inf)


def on_common_seeds(
    one: ConditionResults, two: ConditionResults, values: Values
) -> list[tuple[FloatArray, BoolArray]]:
    """Return values and success of the replicates that both conditions have, for each of both."""
    common = one.summaries.index.intersection(two.summaries.index)
    return [
        (values(c)[rows], solved(c)[rows])
        for c in (one, two)
        for rows in (c.summaries.index.get_indexer(common),)
    ]
