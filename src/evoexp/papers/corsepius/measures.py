"""Measures of Corsépius 2001 that several pages share: effort, paths, phases, tasks."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evoexp.collision.certifier.coal_distances import CoalDistance
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import AXIAL, UPRIGHT
from evoexp.paths.motion import Motion
from evoexp.planners.posture_es.phases import Problem
from evoexp.records import BoolArray, FloatArray
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import by_column
from evoexp.report.statistics.inference import Proportion, quantile
from evoexp.report.statistics.judging import Rules

MANY_QUERIES = 1000  # of coal: more than the pairs that may touch when an object is released
REASONS = ("goal", "stagnation", "cap")  # why a search ends

cycles = by_column("term_cycles")  # of each run, all phases together, (done,)
evaluations = by_column("evaluations")  # of each run, (done,)


Conditions = tuple[ConditionResults, ...]
Pair = tuple[ConditionResults, ConditionResults]


class Task(NamedTuple):
    """Conditions that differ in one setting of the planner."""

    name: str  # the common part of their labels
    by_value: dict[float, ConditionResults]  # value of that setting, ascending → its condition


class Tasks(tuple[Task, ...]):
    """Several tasks."""

    @property
    def conditions(self) -> Conditions:
        """All of their conditions."""
        return tuple(c for task in self for c in task.by_value.values())


def scene(condition: ConditionResults) -> tuple[Any, Any]:
    """Return the canonical forms of robot and scenario."""
    return condition.robot.canonical(), condition.scenario.canonical()


def tasks(results: Results, setting: str, of: str = "ga") -> Tasks:
    """Return the tasks that have several values of a setting, without controls.

    It is a setting of a part of the planner, or, where `of` is empty, of the planner itself.
    """

    def key(condition: ConditionResults) -> tuple[Any, ...]:
        planner: dict[str, Any] = condition.planner.canonical()
        part = planner[of] if of else planner
        part.pop(setting)
        if setting == "num_offspring":  # which the first cycle's number follows
            part.pop("initial_size")
        return *scene(condition), planner

    def value(condition: ConditionResults) -> float:
        found = getattr(getattr(condition.planner, of) if of else condition.planner, setting)
        return float(found[0] if isinstance(found, tuple) else found)  # one scope for all joints

    groups = (sorted(group, key=value) for group in run_measures.grouped(results.main, key))
    return Tasks(
        Task(own[0].label.split(", ")[0], {value(c): c for c in own})
        for own in groups
        if len(own) > 1
    )


def refuted(condition: ConditionResults) -> Proportion:
    """Count the solved runs whose paths the exact verdict refutes."""
    return Proportion(condition.verdicts.solved_refuted, condition.solved)


def usual_seconds(condition: ConditionResults) -> FloatArray:
    """Return the CPU time of each run's evaluations at the median run's price, (done,) [s].

    The first run of a worker process also loads the kernels; one price for all keeps that out of
    sums.
    """
    price = quantile(run_measures.search_seconds(condition) / evaluations(condition), 0.5)
    return evaluations(condition) * price


def tilts_of_solved(condition: ConditionResults, term: str) -> FloatArray:
    """Return the greatest tilt of the grasped object in each solved run, (solved,) [deg]."""
    tilts = condition.column(f"term_greatest_{term}_deg")
    return np.asarray(tilts[run_measures.solved(condition)])


def residuals(condition: ConditionResults) -> FloatArray:
    """Return each run's distance to the goal of its last phase, (done,) [length unit]."""
    return np.abs(condition.column("term_goal_distance"))


def num_steps(condition: ConditionResults) -> FloatArray:
    """Return the steps of each run's path, (done,)."""
    return condition.column("term_postures") - 1.0


def paths(condition: ConditionResults) -> dict[int, FloatArray]:
    """Return replicate → the postures of its path, (postures, nq) [rad]."""
    nq = run_measures.num_joints(condition)
    return {k: flat.reshape(-1, nq) for k, flat in condition.solutions.items()}


def path_lengths(condition: ConditionResults) -> FloatArray:
    """Return the length of each run's path through joint space, (done,) [rad]."""
    return np.array(
        [np.sqrt((np.diff(q, axis=0) ** 2).sum(axis=1)).sum() for q in paths(condition).values()]
    )


def detours(condition: ConditionResults) -> FloatArray:
    """Return each path's length over the straight distance of its ends, (done,).

    It is NaN if the path ends where it began.
    """
    straight = np.array([np.sqrt(((q[-1] - q[0]) ** 2).sum()) for q in paths(condition).values()])
    return path_lengths(condition) / np.where(straight > 0.0, straight, np.nan)


def reasons(condition: ConditionResults) -> dict[str, Proportion]:
    """Count the runs that ended for each reason."""
    given = condition.summaries["stop_reason"]
    return {
        name: run_measures.counted(given == name)
        for name in dict.fromkeys([*REASONS, *sorted(set(given))])
    }


def phase_names(condition: ConditionResults) -> tuple[str, ...]:
    """Return the names of the phases, sub-goals first."""
    return tuple(phase.name for phase in condition.scenario.all_phases)


def tolerances(condition: ConditionResults) -> tuple[float, ...]:
    """Return the distance at which the goal of each phase is met, sub-goals first [length unit]."""
    task = condition.scenario
    return tuple(phase.position_tolerance or task.position_tolerance for phase in task.all_phases)


def obstructed(main: Conditions) -> Conditions:
    """Return the conditions whose obstacles stand."""
    return tuple(c for c in main if not c.scenario.empty_scene)


def obstacles_act(condition: ConditionResults, results: Results) -> bool:
    """Return whether a task's runs differ from those in its empty scene; True where none was run.

    The task is named by the first word of the labels, whatever else a reading changes.
    """
    task = condition.label.split(", ")[0]
    named = {c.label: c for c in results.with_data}
    own, empty = named.get(task), named.get(f"{task}, empty scene")
    if own is None or empty is None:
        return True
    costs = [c.summaries["best_cost"].reindex(own.summaries.index) for c in (own, empty)]
    return not costs[0].equals(costs[1])


def pairs_but_for(setting: str, conditions: Conditions) -> list[Pair]:
    """Return (one without a setting of the task, the same one with it): sub-goals, empty scenes."""

    def key(condition: ConditionResults) -> tuple[Any, ...]:
        robot, task = scene(condition)
        return robot, {**task, setting: None}, condition.planner

    having = [(c, key(c)) for c in conditions if getattr(c.scenario, setting)]
    without = [(c, key(c)) for c in conditions if not getattr(c.scenario, setting)]
    return [(one, two) for one, own in without for two, other in having if own == other]


def allowed_contacts(condition: ConditionResults) -> str:
    """Return the names of the pairs that the exact verdict lets touch; empty if there is none."""
    told = condition.summaries.get("allowed_contacts", pd.Series(dtype=str)).fillna("")
    pairs = dict.fromkeys(pair for text in told for pair in text.split(", ") if pair)
    return ", ".join(pairs) if condition.scenario.allowed_penetration else ""


def releases(condition: ConditionResults) -> list[tuple[float, float]]:
    """Return (gap, tilt) of the object in every run that lets go of it, by coal's distances.

    The gap is to the nearest body that it may touch, negative where it stands in it [length unit],
    the tilt that of its axis from the direction up [rad].
    """
    own, found = condition.problem(Problem), []
    for q in paths(condition).values():
        for span in own.spans(q):
            if span.stage.phase.then == "detach" and span.reached:
                bodies = own.scene_of(span.stage)
                pairs = np.array([contact[:2] for contact in bodies.contacts], dtype=np.int64)
                distance = CoalDistance(bodies._replace(pairs=pairs), Motion(q), MANY_QUERIES)
                gaps = [distance(pair, float(span.last)) for pair in range(len(pairs))]
                tilt = float(span.judged.rows[UPRIGHT, -1])
                found.append((min(gaps, default=np.inf), tilt))
    return found


def approaches_across(condition: ConditionResults, rules: Rules) -> BoolArray:
    """Return whether each run's last posture is turned across the object's axis, (done,)."""
    most = DEGREE * rules["axial_approach"].limits["degrees"]
    own = condition.problem(Problem)
    angles = [own.spans(q)[-1].judged.rows[AXIAL, -1] for q in paths(condition).values()]
    return np.array(angles) <= most


def robots(obstructed: Conditions) -> Conditions:
    """Return the first condition of every robot and its collision model."""
    groups = run_measures.grouped(
        obstructed, lambda c: (c.robot.canonical(), c.planner.collision.canonical())
    )
    return tuple(group[0] for group in groups)


def phase_cycles(condition: ConditionResults) -> pd.DataFrame:
    """Count the cycles of every run in every phase (from 0) that it began."""
    rows = condition.generations
    begun = rows.assign(phase=rows["term_phase"].astype(int) - 1)
    sizes = begun.groupby(["replicate", "phase"]).size()
    table = (sizes - 1).reset_index(name="cycles")  # without the posture that a phase begins with
    last = table.groupby("replicate")["phase"].transform("max")
    won = table["replicate"].map(condition.summaries["solved"].astype(bool))
    whole = won & (table["phase"] == len(phase_names(condition)) - 1)
    return table.assign(reached=(table["phase"] < last) | whole)


def shown_replicate(condition: ConditionResults) -> int:
    """Return the run that figures show: of median evaluations among the solved ones, if any."""
    among = run_measures.solved(condition) if condition.solved else None
    return run_measures.median_replicate(condition, evaluations(condition), among)
