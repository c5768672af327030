"""Rows of the tables, and the runs of the figures, on the pages of Corsépius 2001."""

from collections.abc import Iterator

import numpy as np

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius.claims import METRICS
from evoexp.papers.corsepius.figures.posture_motions import ShownPath
from evoexp.papers.corsepius.measures import Conditions, Tasks
from evoexp.planners.posture_es.planner import PostureEs
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Quantity, quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference
from evoexp.report.statistics.comparisons import Family, Measure, by_column
from evoexp.report.statistics.inference import Proportion

SCALES = {"cycles": 1.0, "evaluations": 1.0, "CPU time": 1e3}  # [1/s] of a time
# evaluations and cycles to the goal, and steps of the path to it, (done,); inf without it
effort = run_measures.where_solved(measures.evaluations)
cycles_to_goal = run_measures.where_solved(measures.cycles)
steps_to_goal = run_measures.where_solved(measures.num_steps)


def fits(results: Results) -> bool:
    """Return whether there are results, all of postures that evolve."""
    return run_measures.planned_by(results, PostureEs)


def is_sweep(results: Results) -> bool:
    """Return whether there are several such conditions to compare."""
    return fits(results) and len(results.main) > 1


def shown_task(obstructed: Conditions) -> Conditions:
    """Return the first of these conditions."""
    return obstructed[:1]


def tilts(results: Results) -> Iterator[Quantity]:
    """Yield the rows of the tilts that any task limits."""
    for term in claims.TILTS:
        if any(getattr(c.planner.objective, term) is not None for c in results.with_data):
            for where, part in (("at", ""), ("between", "_between")):
                name = f"greatest tilt {where} postures ({term.replace('_', ' ')})"
                values = by_column(f"term_greatest_{term}{part}_deg")
                yield quantity(results, name, "deg", values)


def ends(condition: ConditionResults) -> str:
    """Return why searches ended, with the number of runs."""
    reasons = measures.reasons(condition).items()
    return ", ".join(f"{name} {p.having}" for name, p in reasons if p.having)


def beside_empty(results: Results, confidence: float) -> tuple[tuple[str, ...], ...]:
    """Return a row per task that has an empty scene as its control: shares, test, cycles."""
    pairs = measures.with_empty_scenes(results.main)
    tested = [
        inference.fisher_exact(run_measures.success(c), run_measures.success(e)) for c, e in pairs
    ]
    return tuple(
        (
            c.label,
            *(run_measures.success(one).with_interval(confidence) for one in (c, e)),
            markdown.p_value(p),
            *(markdown.spread(inference.spread(measures.cycles(one))) for one in (c, e)),
        )
        for (c, e), p in zip(pairs, inference.holm(tested), strict=True)
    )


def releases(obstructed: Conditions) -> list[tuple[str, ...]]:
    """Return a row per condition that lets go of an object."""
    letting_go = filter(measures.lets_go, obstructed)
    return [_release_row(c) for c in letting_go if measures.releases(c)]


def _release_row(condition: ConditionResults) -> tuple[str, ...]:
    """Return gap and tilt of the objects of a condition: medians and the worst."""
    found, unit = measures.releases(condition), condition.length_unit
    gaps, tilts = (np.array([getattr(one, name) for one in found]) for name in ("gap", "tilt"))
    deepest, highest = max(0.0, -float(gaps.min())), max(0.0, float(gaps.max()))
    return (
        condition.label,
        str(len(found)),
        f"{markdown.number(float(f'{deepest:.2g}'))} {unit}",
        f"{markdown.number(float(f'{highest:.2g}'))} {unit}",
        f"{np.median(tilts) / DEGREE:.2f}°",
        f"{tilts.max() / DEGREE:.2f}°",
    )


def phased(main: Conditions) -> tuple[ConditionResults, ...]:
    """Return the conditions that have several phases."""
    return tuple(c for c in measures.obstructed(main) if len(measures.phase_names(c)) > 1)


def phase_rows(phased: Conditions, confidence: float) -> Iterator[tuple[object, ...]]:
    """Yield a row per condition and phase: runs that met its goal, and cycles."""
    for condition in phased:
        table = measures.phase_cycles(condition)
        for k, name in enumerate(measures.phase_names(condition)):
            own = table[table["phase"] == k]
            reached = run_measures.counted(own["reached"]).with_interval(confidence)
            cycles = markdown.spread(inference.spread(own["cycles"].to_numpy(dtype=np.float64)))
            yield condition.label, f"{k + 1}  {name}", reached, cycles


def collision_models(main: Conditions) -> Iterator[tuple[str, str]]:
    """Yield a row on the collision model of every robot."""
    for c in measures.by_robot(main):
        bodies = measures.problem(c).bodies
        pairs = bodies.sorted_pairs
        text = (
            f"{len(bodies.names)} bodies covered by {bodies.num_shapes} shapes, at most "
            f"{bodies.inflation:.3g} {c.length_unit} beyond them; pairs of bodies: "
            f"{len(pairs.tested)} tested, {len(pairs.adjacent)} neighbours or disabled, "
            f"{len(pairs.always)} always touch, {len(pairs.never)} never do"
        )
        yield f"{c.label}: the model of collisions", text


def robots(obstructed: Conditions) -> Conditions:
    """Return one condition per robot."""
    return measures.by_robot(obstructed)


def titled_robots(robots: Conditions) -> list[tuple[str, ConditionResults]]:
    """Return (title, condition) of every robot."""
    return [(c.label if len(robots) > 1 else "the robot", c) for c in robots]


def stop_reasons(main: Conditions) -> list[tuple[str, int, str, Proportion]]:
    """Return (quantity, position, condition, runs) of every reason for which searches end."""
    return [
        (f"ended by {reason}", position, c.label, measures.reasons(c)[reason])
        for reason in measures.REASONS
        for position, c in enumerate(main)
    ]


def shown_paths(obstructed: Conditions) -> list[ShownPath]:
    """Return the run of every condition whose path is drawn."""
    return [
        ShownPath(f"{c.label}\nrun {k}{'' if c.solved else ', not solved'}", c, k)
        for c in obstructed
        for k in (measures.shown_replicate(c),)
    ]


def manoeuvres(results: Results, phased: Conditions) -> list[tuple[list[ShownPath], str]]:
    """Return the runs whose phases are drawn one by one, each with the end of its figure's stem."""
    several = [c for c in phased if len(measures.phase_names(c)) > len(measures.subgoals(c)) + 1]
    ends = [f"_{results.position(c.label) + 1}" if len(several) > 1 else "" for c in several]
    shown = [[ShownPath(c.label, c, measures.shown_replicate(c), True)] for c in several]
    return list(zip(shown, ends, strict=True))


def scenes(results: Results) -> tuple[Family, ...]:
    """Return the first condition of every task against its others."""
    return tuple(map(Family.of, run_measures.grouped(results.with_data, measures.scene)))


def goal_measures(main: Conditions) -> list[Measure]:
    """Return the quantity that is compared: if no run meets its goal, the distance to it."""
    if any(c.solved for c in main):
        return [Measure("evaluations to the goal", effort)]
    return [Measure("distance to the goal", measures.residuals)]


def share_rows(results: Results, confidence: float) -> Iterator[tuple[str, ...]]:
    """Yield success, verdicts and oversized steps of every condition."""
    for first, *others in run_measures.grouped(results.with_data, measures.scene):
        met, touching = (
            [
                "–",
                *map(
                    markdown.p_value,
                    inference.holm(
                        [inference.fisher_exact(count(first), count(c)) for c in others]
                    ),
                ),
            ]
            for count in (run_measures.success, measures.refuted)
        )
        for c, p_met, p_touching in zip((first, *others), met, touching, strict=True):
            goal_met, refuted = (
                run_measures.success(c).with_interval(confidence),
                measures.refuted(c),
            )
            beyond = markdown.spread(inference.spread(c.column("term_oversized_steps")))
            told = goal_met, p_met, refuted.with_interval(confidence), p_touching, beyond
            yield c.label, *told


def scopes(results: Results) -> Tasks:
    """Return the tasks whose scopes differ and that never end by reaching the goal."""
    if any(len(set(c.planner.scope)) > 1 for c in results.main):  # joint by joint another one
        return Tasks()
    found = measures.tasks(results, "scope", "")
    return Tasks(task for task in found if not any(c.solved for c in task.conditions))


def parents(results: Results) -> Tasks:
    """Return the tasks whose numbers of parents differ."""
    return measures.tasks(results, "num_parents")


def sizes(results: Results) -> Tasks:
    """Return the tasks whose populations differ in size."""
    return measures.tasks(results, "num_offspring") if fits(results) else Tasks()


def floor_rows(main: Conditions, scopes: Tasks) -> list[tuple[str, ...]]:
    """Return the distances at which searches stagnate, if no goal can be met."""
    columns = (lambda c: 1e3 * measures.residuals(c)), measures.cycles
    return [
        (c.label, *(markdown.spread(inference.spread(values(c))) for values in columns))
        for c in (main if scopes else ())
    ]


def shares_are_shown(results: Results, parents: Tasks) -> bool:
    """Return whether shares are drawn: some run meets its goal."""
    return not parents and any(c.solved for c in results.with_data)


def values_are_shown(scopes: Tasks, parents: Tasks) -> bool:
    """Return whether efforts are drawn condition by condition."""
    return not (scopes or parents)


def size_rows(sizes: Tasks, settings: ReportSettings) -> Iterator[tuple[str, ...]]:
    """Yield success and expected running times with their intervals, a row per task and size."""
    level = settings.confidence
    for task in sizes:
        for value, c in task.by_value.items():
            shares = (
                count(c).with_interval(level) for count in (run_measures.success, measures.refuted)
            )
            efforts = (_expected(c, metric, settings) for metric in METRICS)
            yield task.name, f"{value:g}", *shares, *efforts


def _expected(condition: ConditionResults, metric: str, settings: ReportSettings) -> str:
    """Return the expected running time with its interval."""
    if not condition.solved:
        return "∞"
    runs = METRICS[metric](condition), run_measures.solved(condition)
    interval = inference.expected_interval(*runs, settings.confidence, settings.num_resamples)
    expected, low, high = (
        markdown.number(float(f"{SCALES[metric] * value:.3g}"))
        for value in (inference.expected_effort(*runs), *interval)
    )
    return f"{expected} [{low}, {high}]"
