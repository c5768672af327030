"""Measures of Corsépius 2001: effort, paths, phases, tasks; rows of tables, runs of figures."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evoexp.collision.certifier.coal_distances import CoalDistance
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import AXIAL, UPRIGHT
from evoexp.paths.motion import Motion
from evoexp.planners.posture_es.phases import Problem
from evoexp.records import BoolArray, FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Quantity, quantity
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference
from evoexp.report.statistics.comparisons import Family, Measure, by_column
from evoexp.report.statistics.inference import Proportion, quantile
from evoexp.report.statistics.judging import Rules

MANY_QUERIES = 1000  # of coal: more than the pairs that may touch when an object is released
REASONS = ("goal", "stagnation", "cap")  # why a search ends

cycles = by_column("term_cycles")  # of each run, all phases together, (done,)
evaluations = by_column("evaluations")  # of each run, (done,)
# the same to the goal, (done,); inf without it
effort = run_measures.where_solved(evaluations)
cycles_to_goal = run_measures.where_solved(cycles)
TILTS = ("upright", "keep_parallel")  # of a grasped object, that a task may limit


Conditions = tuple[ConditionResults, ...]
Pair = tuple[ConditionResults, ConditionResults]
# (a task, its empty scene), success of both, p-value adjusted over the tasks
EmptyScenes = list[tuple[Pair, tuple[Proportion, Proportion], float]]


class ShownPath(NamedTuple):
    """The run of one panel, or of one panel per phase."""

    title: str  # title of the panel
    condition: ConditionResults  # the condition of the run
    replicate: int  # its replicate
    by_phase: bool = False  # whether each phase has a panel of its own


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


def releases(condition: ConditionResults) -> Iterator[tuple[float, float]]:
    """Yield (gap, tilt) of the object in every run that lets go of it, by coal's distances.

    The gap is to the nearest body that it may touch, negative where it stands in it [length unit],
    the tilt that of its axis from the direction up [rad].
    """
    own = condition.problem(Problem)
    for q in paths(condition).values():
        for span in own.spans(q):
            if span.stage.phase.then == "detach" and span.reached:
                bodies = own.scene_of(span.stage)
                pairs = np.array([contact[:2] for contact in bodies.contacts], dtype=np.int64)
                distance = CoalDistance(bodies._replace(pairs=pairs), Motion(q), MANY_QUERIES)
                gaps = [distance(pair, float(span.last)) for pair in range(len(pairs))]
                yield min(gaps, default=np.inf), float(span.judged.rows[UPRIGHT, -1])


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


# steps of the path of each run that meets its goal, (done,); inf without it
steps_to_goal = run_measures.where_solved(num_steps)


def tilts(results: Results) -> Iterator[Quantity]:
    """Yield the rows of the tilts that any task limits."""
    for term in TILTS:
        if any(getattr(c.planner.objective, term) is not None for c in results.with_data):
            for where, part in (("at", ""), ("between", "_between")):
                name = f"greatest tilt {where} postures ({term.replace('_', ' ')})"
                values = by_column(f"term_greatest_{term}{part}_deg")
                yield quantity(results, name, "deg", values)


def empty_scenes(main: Conditions) -> EmptyScenes:
    """Return the tasks that have an empty scene as their control, with a test of their success."""
    pairs = pairs_but_for("empty_scene", main)
    shares = [(run_measures.success(c), run_measures.success(empty)) for c, empty in pairs]
    return list(zip(pairs, shares, inference.fisher_family(shares), strict=True))


def beside_empty(empty_scenes: EmptyScenes, confidence: float) -> Iterator[tuple[str, ...]]:
    """Yield a row per task that has an empty scene as its control: shares, test, cycles."""
    for pair, both, p in empty_scenes:
        shares = (share.with_interval(confidence) for share in both)
        spreads = (markdown.spread(inference.spread(cycles(one))) for one in pair)
        yield pair[0].label, *shares, markdown.p_value(p), *spreads


def release_rows(obstructed: Conditions) -> Iterator[tuple[str, ...]]:
    """Yield gap and tilt of the objects that a condition lets go of: medians and the worst."""
    for condition in obstructed:
        if found := [*releases(condition)]:
            gaps, tilts = np.array(found).T
            deepest, highest = (
                f"{markdown.number(float(f'{max(0.0, value):.2g}'))} {condition.length_unit}"
                for value in (-gaps.min(), gaps.max())
            )
            median, worst = (f"{t / DEGREE:.2f}°" for t in (np.median(tilts), tilts.max()))
            yield condition.label, str(len(found)), deepest, highest, median, worst


def phase_rows(phased: Conditions, confidence: float) -> Iterator[tuple[object, ...]]:
    """Yield a row per condition and phase: runs that met its goal, and cycles."""
    for condition in phased:
        table = phase_cycles(condition)
        for k, name in enumerate(phase_names(condition)):
            own = table[table["phase"] == k]
            reached = run_measures.counted(own["reached"]).with_interval(confidence)
            cycles = markdown.spread(inference.spread(own["cycles"].to_numpy(dtype=np.float64)))
            yield condition.label, f"{k + 1}  {name}", reached, cycles


def manoeuvres(results: Results, phased: Conditions) -> list[tuple[list[ShownPath], str]]:
    """Return the runs whose phases are drawn one by one, each with the end of its figure's stem."""
    several = [c for c in phased if len(c.scenario.phases) > 1]
    ends = [f"_{results.position(c.label) + 1}" if len(several) > 1 else "" for c in several]
    shown = [[ShownPath(c.label, c, shown_replicate(c), True)] for c in several]
    return list(zip(shown, ends, strict=True))


def share_rows(results: Results, confidence: float) -> Iterator[tuple[str, ...]]:
    """Yield success, verdicts and oversized steps of every condition."""
    for first, *others in run_measures.grouped(results.with_data, scene):
        counts = run_measures.success, refuted
        p_values = [
            inference.fisher_family([(count(first), count(c)) for c in others]) for count in counts
        ]
        told = [("–", "–"), *(map(markdown.p_value, own) for own in zip(*p_values, strict=True))]
        for c, (p_met, p_touching) in zip((first, *others), told, strict=True):
            met, touching = (count(c).with_interval(confidence) for count in counts)
            beyond = markdown.spread(inference.spread(c.column("term_oversized_steps")))
            yield c.label, met, p_met, touching, p_touching, beyond


def scopes(results: Results) -> Tasks:
    """Return the tasks whose scopes differ and that never end by reaching the goal."""
    if any(len(set(c.planner.scope)) > 1 for c in results.main):  # joint by joint another one
        return Tasks()
    found = tasks(results, "scope", "")
    return Tasks(task for task in found if not any(c.solved for c in task.by_value.values()))


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # why searches ended, with the number of runs
    "ends": lambda condition: ", ".join(
        f"{name} {p.having}" for name, p in reasons(condition).items() if p.having
    ),
    # (quantity, position, condition, runs) of every reason for which searches end
    "stop_reasons": lambda main: [
        (f"ended by {reason}", position, c.label, reasons(c)[reason])
        for reason in REASONS
        for position, c in enumerate(main)
    ],
    # the run of every condition whose path is drawn
    "shown_paths": lambda obstructed: [
        ShownPath(f"{c.label}\nrun {k}{'' if c.solved else ', not solved'}", c, k)
        for c in obstructed
        for k in (shown_replicate(c),)
    ],
    "is_sweep": lambda main: len(main) > 1,
    "shown_task": lambda obstructed: obstructed[:1],
    # the conditions that have several phases
    "phased": lambda obstructed: tuple(c for c in obstructed if len(phase_names(c)) > 1),
    "bodies": lambda condition: condition.problem(Problem).bodies,
    "thousandths": lambda condition: 1e3 * residuals(condition),  # of the residuals
    # (title, condition) of every robot
    "titled_robots": lambda robots: [
        (c.label if len(robots) > 1 else "the robot", c) for c in robots
    ],
    # the first condition of every task against its others
    "scenes": lambda results: tuple(map(Family.of, run_measures.grouped(results.with_data, scene))),
    # the quantity that is compared: if no run meets its goal, the distance to it
    "goal_measures": lambda main: [
        Measure("evaluations to the goal", effort)
        if any(c.solved for c in main)
        else Measure("distance to the goal", residuals)
    ],
    # the tasks whose numbers of parents differ, and those whose populations differ in size
    "parents": lambda results: tasks(results, "num_parents"),
    "with_obstacles": lambda results: results._replace(conditions=obstructed(results.conditions)),
    # whether some run meets its goal
    "shares_are_shown": lambda results, parents: (
        not parents and any(c.solved for c in results.with_data)
    ),
    "values_are_shown": lambda scopes, parents: not (scopes or parents),
}
