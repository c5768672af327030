"""Rows of the tables, and the runs of the figures, on the pages of Corsépius 2001."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius.claims import METRICS
from evoexp.papers.corsepius.figures.posture_motions import ShownPath
from evoexp.papers.corsepius.measures import Conditions, Tasks
from evoexp.planners.posture_es.phases import Problem
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Quantity, quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics import inference
from evoexp.report.statistics.comparisons import Family, Measure, by_column

SCALES = {"cycles": 1.0, "evaluations": 1.0, "CPU time": 1e3}  # [1/s] of a time
# evaluations and cycles to the goal, and steps of the path to it, (done,); inf without it
effort = run_measures.where_solved(measures.evaluations)
cycles_to_goal = run_measures.where_solved(measures.cycles)
steps_to_goal = run_measures.where_solved(measures.num_steps)


def tilts(results: Results) -> Iterator[Quantity]:
    """Yield the rows of the tilts that any task limits."""
    for term in claims.TILTS:
        if any(getattr(c.planner.objective, term) is not None for c in results.with_data):
            for where, part in (("at", ""), ("between", "_between")):
                name = f"greatest tilt {where} postures ({term.replace('_', ' ')})"
                values = by_column(f"term_greatest_{term}{part}_deg")
                yield quantity(results, name, "deg", values)


def beside_empty(results: Results, confidence: float) -> tuple[tuple[str, ...], ...]:
    """Return a row per task that has an empty scene as its control: shares, test, cycles."""
    pairs = measures.pairs_but_for("empty_scene", results.main)
    shares = [(run_measures.success(c), run_measures.success(e)) for c, e in pairs]
    return tuple(
        (
            pair[0].label,
            *(share.with_interval(confidence) for share in both),
            markdown.p_value(p),
            *(markdown.spread(inference.spread(measures.cycles(one))) for one in pair),
        )
        for pair, both, p in zip(pairs, shares, inference.fisher_family(shares), strict=True)
    )


def releases(obstructed: Conditions) -> Iterator[tuple[str, ...]]:
    """Yield gap and tilt of the objects that a condition lets go of: medians and the worst."""
    for condition in obstructed:
        if found := measures.releases(condition):
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
        table = measures.phase_cycles(condition)
        for k, name in enumerate(measures.phase_names(condition)):
            own = table[table["phase"] == k]
            reached = run_measures.counted(own["reached"]).with_interval(confidence)
            cycles = markdown.spread(inference.spread(own["cycles"].to_numpy(dtype=np.float64)))
            yield condition.label, f"{k + 1}  {name}", reached, cycles


def manoeuvres(results: Results, phased: Conditions) -> list[tuple[list[ShownPath], str]]:
    """Return the runs whose phases are drawn one by one, each with the end of its figure's stem."""
    several = [c for c in phased if len(c.scenario.phases) > 1]
    ends = [f"_{results.position(c.label) + 1}" if len(several) > 1 else "" for c in several]
    shown = [[ShownPath(c.label, c, measures.shown_replicate(c), True)] for c in several]
    return list(zip(shown, ends, strict=True))


def share_rows(results: Results, confidence: float) -> Iterator[tuple[str, ...]]:
    """Yield success, verdicts and oversized steps of every condition."""
    for first, *others in run_measures.grouped(results.with_data, measures.scene):
        counts = run_measures.success, measures.refuted
        p_values = [
            inference.fisher_family([(count(first), count(c)) for c in others]) for count in counts
        ]
        told = [("–", "–"), *(map(markdown.p_value, own) for own in zip(*p_values, strict=True))]
        for c, (p_met, p_touching) in zip((first, *others), told, strict=True):
            met, refuted = (count(c).with_interval(confidence) for count in counts)
            beyond = markdown.spread(inference.spread(c.column("term_oversized_steps")))
            yield c.label, met, p_met, refuted, p_touching, beyond


def scopes(results: Results) -> Tasks:
    """Return the tasks whose scopes differ and that never end by reaching the goal."""
    if any(len(set(c.planner.scope)) > 1 for c in results.main):  # joint by joint another one
        return Tasks()
    found = measures.tasks(results, "scope", "")
    return Tasks(task for task in found if not any(c.solved for c in task.by_value.values()))


def size_rows(sizes: Tasks, settings: ReportSettings) -> Iterator[tuple[str, ...]]:
    """Yield success and expected running times with their intervals, a row per task and size."""
    level = settings.confidence
    for task in sizes:
        for value, c in task.by_value.items():
            shares = (
                count(c).with_interval(level) for count in (run_measures.success, measures.refuted)
            )
            efforts = []  # expected running times with their intervals
            for metric, scale in SCALES.items() if c.solved else ():
                runs = METRICS[metric](c), run_measures.solved(c)
                interval = inference.expected_interval(*runs, level, settings.num_resamples)
                expected, low, high = (
                    markdown.number(float(f"{scale * value:.3g}"))
                    for value in (inference.expected_effort(*runs), *interval)
                )
                efforts.append(f"{expected} [{low}, {high}]")
            yield task.name, f"{value:g}", *shares, *(efforts or ["∞"] * len(SCALES))


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # why searches ended, with the number of runs
    "ends": lambda condition: ", ".join(
        f"{name} {p.having}" for name, p in measures.reasons(condition).items() if p.having
    ),
    # (quantity, position, condition, runs) of every reason for which searches end
    "stop_reasons": lambda main: [
        (f"ended by {reason}", position, c.label, measures.reasons(c)[reason])
        for reason in measures.REASONS
        for position, c in enumerate(main)
    ],
    # the run of every condition whose path is drawn
    "shown_paths": lambda obstructed: [
        ShownPath(f"{c.label}\nrun {k}{'' if c.solved else ', not solved'}", c, k)
        for c in obstructed
        for k in (measures.shown_replicate(c),)
    ],
    "is_sweep": lambda main: len(main) > 1,
    "shown_task": lambda obstructed: obstructed[:1],
    # the conditions that have several phases
    "phased": lambda obstructed: tuple(c for c in obstructed if len(measures.phase_names(c)) > 1),
    "bodies": lambda condition: condition.problem(Problem).bodies,
    "thousandths": lambda condition: 1e3 * measures.residuals(condition),  # of the residuals
    # (title, condition) of every robot
    "titled_robots": lambda robots: [
        (c.label if len(robots) > 1 else "the robot", c) for c in robots
    ],
    # the first condition of every task against its others
    "scenes": lambda results: tuple(
        map(Family.of, run_measures.grouped(results.with_data, measures.scene))
    ),
    # the quantity that is compared: if no run meets its goal, the distance to it
    "goal_measures": lambda main: [
        Measure("evaluations to the goal", effort)
        if any(c.solved for c in main)
        else Measure("distance to the goal", measures.residuals)
    ],
    # the tasks whose numbers of parents differ, and those whose populations differ in size
    "parents": lambda results: measures.tasks(results, "num_parents"),
    "with_obstacles": lambda results: results._replace(
        conditions=measures.obstructed(results.conditions)
    ),
    "sizes": lambda results: measures.tasks(results, "num_offspring"),
    "num_runs": lambda sizes: sum(c.done for c in sizes.conditions),
    "size_ratios": lambda sizes, settings: {
        metric: claims.compare_sizes(sizes, metric, settings) for metric in METRICS
    },
    "are_compared": lambda size_ratios: any(size_ratios.values()),
    # whether some run meets its goal
    "shares_are_shown": lambda results, parents: (
        not parents and any(c.solved for c in results.with_data)
    ),
    "values_are_shown": lambda scopes, parents: not (scopes or parents),
}
