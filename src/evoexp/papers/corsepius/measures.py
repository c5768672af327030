"""What the pages on Corsépius 2001 measure alike.

Effort, paths, phases, and which conditions are one task.
"""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evoexp.records import FloatArray
from evoexp.report import markdown
from evoexp.report.proportions import Proportion
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import quantile

REASONS = ("goal", "stagnation", "cap")  # why a search ends


class Task(NamedTuple):
    """Conditions that differ in one setting of the planner.

    Attributes:
        name: Their labels as far as they agree.
        values: Of that setting, ascending.
        conditions: One per value.
    """

    name: str
    values: tuple[float, ...]
    conditions: tuple[ConditionResults, ...]

    def at(self, value: float) -> ConditionResults | None:
        """Return the condition of a value; None if it has no results."""
        return dict(zip(self.values, self.conditions, strict=True)).get(value)


def fits(results: Results) -> bool:
    """Whether there are results, and all of postures as individuals."""
    return bool(results.with_data) and all(
        hasattr(c.planner, "edge_check") for c in results.with_data
    )


def tasks(results: Results, setting: str, of: str = "ga") -> tuple[Task, ...]:
    """Return the conditions task by task.

    Args:
        results: With data; controls are left out.
        setting: What differs within a task.
        of: Which part of the planner it belongs to; empty: the planner itself.
    """
    found: dict[str, list[ConditionResults]] = {}
    for c in results.main:
        planner: dict[str, Any] = c.planner.canonical()
        part = planner[of] if of else planner
        part.pop(setting)
        if setting == "num_offspring":  # which the first cycle's number follows
            part.pop("initial_size")
        key = repr((c.condition.robot.canonical(), c.condition.scenario.canonical(), planner))
        found.setdefault(key, []).append(c)
    return tuple(_task(group, setting, of) for group in found.values())


def _task(group: list[ConditionResults], setting: str, of: str) -> Task:
    def value(c: ConditionResults) -> float:
        found = getattr(getattr(c.planner, of) if of else c.planner, setting)
        return float(
            found[0] if isinstance(found, tuple) else found
        )  # a scope that all joints share

    ordered = sorted(group, key=value)
    return Task(ordered[0].label.split(", ")[0], tuple(value(c) for c in ordered), tuple(ordered))


def solved(condition: ConditionResults) -> np.ndarray:
    """Return whether each run met its goal, (done,)."""
    return condition.summaries["solved"].to_numpy(dtype=bool)


def success(condition: ConditionResults) -> Proportion:
    """Return how many runs met their goals."""
    return Proportion(condition.solved, condition.done)


def refuted(condition: ConditionResults) -> Proportion:
    """Return how many of the solved runs' paths the exact verdict refutes."""
    return Proportion(condition.verdicts.solved_refuted, condition.solved)


def certified(condition: ConditionResults) -> Proportion:
    """Return how many of the solved runs' paths the exact verdict certifies."""
    free = condition.summaries["certified"].eq(True).fillna(False)
    return Proportion(int(np.count_nonzero(solved(condition) & free)), condition.solved)


def cycles(condition: ConditionResults) -> FloatArray:
    """Return the cycles of each run, all phases together, (done,)."""
    return condition.column("term_cycles")


def evaluations(condition: ConditionResults) -> FloatArray:
    """Return the evaluations of each run, (done,)."""
    return condition.column("evaluations")


def search_seconds(condition: ConditionResults) -> FloatArray:
    """Return the CPU time of each run without that of the exact verdict, (done,) [s]."""
    return np.asarray(condition.column("cpu_s") - condition.column("certificate_s"))


def usual_seconds(condition: ConditionResults) -> FloatArray:
    """Return what each run's evaluations take at the median run's price, (done,) [s].

    The first run of a worker process also loads the kernels; one price for all keeps that out of
    sums.
    """
    return evaluations(condition) * quantile(
        search_seconds(condition) / evaluations(condition), 0.5
    )


def residuals(condition: ConditionResults) -> FloatArray:
    """Return how far from the goal each run ended, in the phase that it ended in.

    (done,) [length unit].
    """
    return np.abs(condition.column("term_goal_distance"))


def num_steps(condition: ConditionResults) -> FloatArray:
    """Return the steps of each run's path, (done,)."""
    return condition.column("term_postures") - 1.0


def paths(condition: ConditionResults) -> dict[int, FloatArray]:
    """Return replicate → the postures of its path, (postures, nq) [rad]."""
    nq = len(condition.condition.scenario.q_start)  # type: ignore[attr-defined]
    return {k: flat.reshape(-1, nq) for k, flat in condition.solutions.items()}


def path_lengths(condition: ConditionResults) -> FloatArray:
    """Return the length of each run's path through joint space, (done,) [rad]."""
    return np.array(
        [np.sqrt((np.diff(q, axis=0) ** 2).sum(axis=1)).sum() for q in paths(condition).values()]
    )


def detours(condition: ConditionResults) -> FloatArray:
    """Return each path's length over the straight distance of its ends, (done,).

    NaN where it ends as it began.
    """
    straight = np.array([np.sqrt(((q[-1] - q[0]) ** 2).sum()) for q in paths(condition).values()])
    found = np.full(len(straight), np.nan)
    np.divide(path_lengths(condition), straight, out=found, where=straight > 0.0)
    return found


def reasons(condition: ConditionResults) -> dict[str, Proportion]:
    """Return how many runs ended for each reason."""
    given = condition.summaries["stop_reason"]
    names = [*REASONS, *sorted(set(given) - set(REASONS))]
    return {name: Proportion(int((given == name).sum()), condition.done) for name in names}


def phase_names(condition: ConditionResults) -> tuple[str, ...]:
    """Return the names of the phases, sub-goals first."""
    return tuple(phase.name for phase in condition.condition.scenario.all_phases)  # type: ignore[attr-defined]


def subgoals(condition: ConditionResults) -> tuple[Any, ...]:
    """Return the points that the tool passes before the first phase."""
    return tuple(condition.condition.scenario.subgoals)  # type: ignore[attr-defined]


def only_subgoals_differ(without: ConditionResults, having: ConditionResults) -> bool:
    """Whether the second condition is the first one with sub-goals."""
    if subgoals(without) or not subgoals(having):
        return False
    one, two = (dict(c.condition.scenario.canonical()) for c in (without, having))
    one.pop("subgoals", None)
    two.pop("subgoals", None)
    same = without.condition.robot == having.condition.robot and without.planner == having.planner
    return bool(same and one == two)


def by_robot(conditions: tuple[ConditionResults, ...]) -> tuple[ConditionResults, ...]:
    """Return the first condition of every robot, with what stands for it in the search."""
    found: dict[str, ConditionResults] = {}
    for c in conditions:
        key = repr((c.condition.robot.canonical(), c.planner.canonical()["collision"]))
        found.setdefault(key, c)
    return tuple(found.values())


def phase_cycles(condition: ConditionResults) -> pd.DataFrame:
    """Return what every run did in every phase that it began.

    Returns:
        Columns replicate, phase (from 0), cycles, reached.
    """
    names = phase_names(condition)
    rows = condition.generations
    begun = rows.assign(phase=rows["term_phase"].astype(int) - 1).groupby(
        ["replicate", "phase"], as_index=False
    )
    table = begun.size().rename(columns={"size": "cycles"})
    table["cycles"] -= 1  # the posture that a phase begins with
    last = table.groupby("replicate")["phase"].transform("max")
    won = table["replicate"].map(condition.summaries["solved"].astype(bool))
    return table.assign(
        reached=(table["phase"] < last) | (won & (table["phase"] == len(names) - 1))
    )


def median_replicate(condition: ConditionResults, rows: np.ndarray) -> int:
    """Return the replicate of median evaluations (the lower one of two) among some rows (done,).

    At least one.
    """
    candidates = np.flatnonzero(rows)
    ordered = candidates[np.argsort(evaluations(condition)[candidates], kind="stable")]
    return int(condition.summaries.index[ordered[(len(ordered) - 1) // 2]])


def shown_replicate(condition: ConditionResults) -> int:
    """Return the run that figures show: of median evaluations among the solved ones.

    Where none is, among all.
    """
    having = solved(condition)
    return median_replicate(
        condition, having if having.any() else np.ones(condition.done, dtype=bool)
    )


def text(proportion: Proportion, confidence: float) -> str:
    """Return a proportion with its interval: "48 of 50 = 96 % [87, 99]"."""
    if not proportion.total:
        return "0 of 0"
    low, high = proportion.interval(confidence)
    return (
        f"{markdown.share(proportion.having, proportion.total)} = {100 * proportion.share:.0f} % "
        f"[{100 * low:.0f}, {100 * high:.0f}]"
    )
