"""Corsépius 2001, Figs. 2–4: an evolution strategy on postures, task by task."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius.figures import (
    posture_history,
    posture_motions,
    posture_trap,
    solids,
)
from evoexp.papers.corsepius.figures.posture_motions import ShownPath
from evoexp.planners.posture_es.planner import PostureEs
from evoexp.report.figures import shares
from evoexp.report.kit import (
    ConditionResults,
    Drawing,
    Page,
    PlayedRun,
    Quantity,
    ReportSettings,
    Results,
    Table,
    by_column,
    compared_with_controls,
    counted,
    fisher_exact,
    generic,
    holm,
    markdown,
    planned_by,
    run_measures,
    spread,
)

INTRODUCTION = (
    "An individual is a posture. Every cycle random steps within a local scope of a few parents "
    "give the offspring, the best of which are the next parents; the path is the ancestry of the "
    "first posture that meets the goal. The cost is a sum of weighted terms in configuration and "
    "work space; lower is better. A run without a winner ends by stagnation or at its cap of "
    "cycles, and its path is the ancestry of the best posture. Solved: the goal is met, and every "
    "posture of the path is free by the spheres; the exact verdict judges the motion between "
    "postures, too."
)
TASKS = (
    "task",
    "goal met",
    "of these certified",
    "of these refuted",
    "ended by",
    "cycles",
    "evaluations",
    "steps",
)
PHASES = ("task", "phase", "goal of the phase met, of the runs that began it", "cycles")
BESIDE = (
    "task",
    "goal met",
    "goal met in the empty scene",
    "p",
    "cycles",
    "cycles in the empty scene",
)
BESIDE_NOTE = (
    "Empty scene: the same robot, goals and seeds, without the obstacles that are neither "
    "approached nor grasped. A goal that is missed there is not missed because of an obstacle. p: "
    "Fisher's exact tests, Holm over the tasks."
)
RELEASED = ("task", "runs", "deepest in another body", "highest above it", "median tilt", "worst")
RELEASED_NOTE = (
    "By exact distances to the nearest body that the object may touch, at the posture at which it "
    "is let go of."
)
CHECKS = (
    (
        "Paths between postures",
        "are not rated by the paper: solved paths can be refuted; `planner.edge_check` tests "
        "configurations between a parent and its child: `evoexp run experiment=corsepius_options`",
    ),
    (
        "Times",
        "the paper: Pentium III class PC; here: one core of this run's machine; the first run of a "
        "worker process loads the kernels, too",
    ),
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the tasks, or the generic page if another planner was run."""
    if not planned_by(results, PostureEs):
        return generic.page(results, settings)
    compared = (("distance to the goal", True, measures.residuals),)
    return Page(
        title=f"Corsépius 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=quantities(results),
        tables=tables(results, settings),
        claims=claims.judge_tasks(results, settings),
        checks=checks(results),
        comparisons=compared_with_controls(results, settings, compared),
        drawings=drawings(results, settings),
    )


def quantities(results: Results) -> tuple[Quantity, ...]:
    """Return the rows of the table of results."""
    row, column = partial(generic.quantity, results), by_column
    unit = results.with_data[0].condition.length_unit
    tilts = [
        row(
            f"greatest tilt {where} postures ({term.replace('_', ' ')})",
            "deg",
            column(f"term_greatest_{term}{part}_deg"),
        )
        for term in claims.TILTS
        if any(getattr(c.planner.objective, term) is not None for c in results.with_data)
        for where, part in (("at", ""), ("between", "_between"))
    ]
    return (
        *effort_quantities(results),
        row("length of the path in joint space", "rad", measures.path_lengths),
        row("length over the straight line of its ends", "–", measures.detours),
        row("clearance of the bodies over the whole motion (exact)", unit, column("clearance")),
        *tilts,
    )


def effort_quantities(results: Results) -> tuple[Quantity, ...]:
    """Return the rows that need no log, only summaries."""
    row, unit = partial(generic.quantity, results), results.with_data[0].condition.length_unit
    column = by_column
    return (
        row("cycles, all phases", "–", measures.cycles),
        row("evaluations", "–", measures.evaluations),
        row("distance to the goal of the last phase", unit, measures.residuals),
        row("steps of the path", "–", measures.num_steps),
        row("longest step", "scopes", column("term_longest_step_scopes")),
        row("steps beyond the scope", "–", column("term_oversized_steps")),
        row("CPU time of its search", "s", run_measures.search_seconds),
        row("evaluations per second of search", "1/s", run_measures.evaluations_per_second),
    )


def tables(results: Results, settings: ReportSettings) -> tuple[Table, ...]:
    """Return the tables of tasks, and of the phases of those that have several."""
    level = settings.confidence
    phases = tuple(row for c in _phased(results) for row in _phase_rows(c, level))
    beside, released = _beside_empty(results, level), tuple(map(_release_row, _releasing(results)))
    note = (
        f"Shares of runs, in brackets Wilson's {100 * level:g} % interval; of others median "
        "[quartiles] over all runs."
    )
    rows = tuple(_task_row(c, level) for c in results.with_data)
    found = (
        Table("Tasks", TASKS, rows, note),
        Table("With and without obstacles", BESIDE, beside, BESIDE_NOTE),
        Table("Phases", PHASES, phases),
        Table("Objects when they are let go of", RELEASED, released, RELEASED_NOTE),
    )
    return tuple(table for table in found if table.rows)


def _task_row(condition: ConditionResults, level: float) -> tuple[str, ...]:
    """Return the row of a task: shares of its runs, the ends of searches, efforts."""
    counts = run_measures.success, measures.certified, measures.refuted
    reasons = measures.reasons(condition).items()
    efforts = measures.cycles, measures.evaluations, measures.num_steps
    return (
        condition.label,
        *(count(condition).with_interval(level) for count in counts),
        ", ".join(f"{name} {p.having}" for name, p in reasons if p.having),
        *(markdown.spread(spread(effort(condition))) for effort in efforts),
    )


def _beside_empty(results: Results, level: float) -> tuple[tuple[str, ...], ...]:
    """Return a row per task that has an empty scene as its control: shares, test, cycles."""
    pairs = measures.with_empty_scenes(results.main)
    tested = [fisher_exact(run_measures.success(c), run_measures.success(e)) for c, e in pairs]
    return tuple(
        (
            c.label,
            *(run_measures.success(one).with_interval(level) for one in (c, e)),
            markdown.p_value(p),
            *(markdown.spread(spread(measures.cycles(one))) for one in (c, e)),
        )
        for (c, e), p in zip(pairs, holm(tested), strict=True)
    )


def _releasing(results: Results) -> tuple[ConditionResults, ...]:
    """Return the conditions in which an object is let go of in a run at least."""
    main = measures.among_obstacles(results.main)
    detaching = (c for c in main if measures.lets_go(c))
    return tuple(c for c in detaching if measures.releases(c))


def _release_row(condition: ConditionResults) -> tuple[str, ...]:
    """Return gap and tilt of the objects of a condition: medians and the worst."""
    found, unit = measures.releases(condition), condition.condition.length_unit
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


def _phased(results: Results) -> tuple[ConditionResults, ...]:
    """Return the conditions that have several phases."""
    several = (c for c in results.main if len(measures.phase_names(c)) > 1)
    return measures.among_obstacles(tuple(several))


def _phase_rows(condition: ConditionResults, level: float) -> Iterator[tuple[object, ...]]:
    """Return a row per phase: runs that met its goal, and cycles."""
    table = measures.phase_cycles(condition)
    for k, name in enumerate(measures.phase_names(condition)):
        own = table[table["phase"] == k]
        cycles = markdown.spread(spread(own["cycles"].to_numpy(dtype=np.float64)))
        yield (
            condition.label,
            f"{k + 1}  {name}",
            counted(own["reached"]).with_interval(level),
            cycles,
        )


def checks(results: Results) -> tuple[tuple[str, str], ...]:
    """Return the rows on collision models and times."""
    rows = []
    for c in measures.by_robot(results.main):
        bodies = measures.problem(c).bodies
        pairs = bodies.sorted_pairs
        text = (
            f"{len(bodies.names)} bodies covered by {bodies.num_shapes} shapes, at most "
            f"{bodies.inflation:.3g} {c.condition.length_unit} beyond them; pairs of bodies: "
            f"{len(pairs.tested)} tested, {len(pairs.adjacent)} neighbours or disabled, "
            f"{len(pairs.always)} always touch, {len(pairs.never)} never do"
        )
        rows.append((f"{c.label}: the model of collisions", text))
    return (*rows, *CHECKS)


def drawings(results: Results, settings: ReportSettings) -> tuple[Drawing, ...]:
    """Return the figures."""
    every, level = results.main, f"{100 * settings.confidence:g} %"
    main = measures.among_obstacles(every)
    shown = [
        ShownPath(f"{c.label}\nrun {k}{'' if c.solved else ', not solved'}", c, k)
        for c in main
        for k in (measures.shown_replicate(c),)
    ]
    reasons = [
        (f"ended by {reason}", position, c.label, measures.reasons(c)[reason])
        for reason in measures.REASONS
        for position, c in enumerate(every)
    ]
    return (
        _models(main),
        Drawing(
            "fig_2_scope",
            "Fig. 2: local search scope",
            "Left: the boxes that a posture's offspring are drawn from, along one path, in the "
            "plane of its two joints that move most; every child lies in its parent's box. "
            "Right: where the tool can be one step away from the start, for the scope, a half "
            "and twice of it: hulls of random steps, as seen from above.",
            partial(posture_motions.scope_table, main[0]),
            posture_motions.draw_scope,
            main[:1],
        ),
        Drawing(
            "history",
            "Approach to the goal",
            "Best so far against cycles: median and quartiles of the runs that began the phase; "
            "a run that has ended keeps its last value. The best posture is the one of least "
            "cost, so its distance may grow. At the ends of curves: numbers of runs that began "
            "the phase, equal ones once.",
            partial(posture_history.history_table, results._replace(conditions=main)),
            posture_history.draw_history,
            main,
        ),
        Drawing(
            "stop_reasons",
            "Why searches end",
            f"Share of runs, with Wilson's {level} interval.",
            partial(shares.shares_table, reasons, {}, settings.confidence),
            shares.draw_shares,
            every,
        ),
        _paths("paths", "Paths", PATHS, shown),
        *_manoeuvres(results, settings),
        *_trap(main),
    )


def _paths(stem: str, title: str, caption: str, shown: list[ShownPath]) -> Drawing:
    table = partial(posture_motions.motions_table, shown)
    draw = partial(posture_motions.draw_motions, same_scene=shown[0].by_phase)
    plays = tuple(PlayedRun(one.condition, one.replicate) for one in shown)
    return Drawing(stem, title, caption, table, draw, tuple(one.condition for one in shown), plays)


def _manoeuvres(results: Results, settings: ReportSettings) -> list[Drawing]:
    """Return the figures of conditions that have several phases."""
    phased, level = _phased(results), settings.confidence
    several = [c for c in phased if len(measures.phase_names(c)) > len(measures.subgoals(c)) + 1]
    ends = [f"_{results.position(c.label) + 1}" if len(several) > 1 else "" for c in several]
    shown = [ShownPath(c.label, c, measures.shown_replicate(c), True) for c in several]
    phases = Drawing(
        "phases",
        "Phases",
        "Of the runs that began a phase: how many met its goal (Wilson's "
        f"{100 * level:g} % interval), and their cycles.",
        partial(posture_history.phases_table, results._replace(conditions=phased), level),
        posture_history.draw_phases,
        phased,
    )
    title = "The manoeuvre, phase by phase"
    named = zip(ends, shown, strict=True)
    found = [_paths(f"manoeuvre{end}", title, MANOEUVRE, [one]) for end, one in named]
    return [*found, phases] if phased else found


def _trap(main: tuple[ConditionResults, ...]) -> list[Drawing]:
    """Return the figure of the local minimum, where runs get stuck that a sub-goal helps."""
    pair = posture_trap.pair(main)
    if pair is None:
        return []
    table = partial(posture_trap.trap_table, *pair)
    return [Drawing("trap", "The local minimum", TRAP, table, posture_trap.draw_trap, pair)]


PATHS = (
    "Per condition the run of median evaluations among the solved ones; where none is solved, "
    "among all. Lines: the links at every posture of the path, which is the winner's ancestry. "
    "It was not planned beforehand."
)
MANOEUVRE = (
    "The same path, one panel per phase. Green: the object while it is held, where the phase "
    "begins and ends."
)
TRAP = (
    "a: ways of the tools, of all runs that are stuck (crosses: their ends) and all that a "
    "sub-goal has helped. b: a way around must lead away from the goal, or along the wall, "
    "before it leads there. c: the cost over the two joints that moved most on the way to the "
    "median stuck posture, the others as they are there; grey: infeasible. d: the least cost "
    f"among {posture_trap.SAMPLES} random postures in boxes around it, which "
    "shows the distance to a better one."
)


def _models(main: tuple[ConditionResults, ...]) -> Drawing:
    found = measures.by_robot(main)
    shown = [(c.label if len(found) > 1 else "the robot", c) for c in found]
    return Drawing(
        "fig_3_4_models",
        "Figs. 3 and 4: robots, and the shapes that cover them",
        "Left: the bodies, which the exact verdict uses. Right: the spheres or capsules that "
        "cover them, which the search uses; the paper's sets have 10⁵ to 10⁶ spheres.",
        partial(solids.models_table, shown),
        solids.draw_models,
        found,
    )
