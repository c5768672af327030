"""Corsépius 2001, Figs. 2–4: an evolution strategy on postures, task by task."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from evoexp.numeric.elementary import DEGREE
from evoexp.papers import run_values
from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius.figures import posture_history, posture_motions, posture_trap, solids
from evoexp.papers.corsepius.figures.posture_motions import ShownPath
from evoexp.papers.corsepius.rules import PAPER
from evoexp.planners.posture_es.planner import PostureEs
from evoexp.report import kit
from evoexp.report.figures import shares
from evoexp.report.kit import generic, markdown, run_measures


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the tasks, or the generic page if another planner was run."""
    if not kit.planned_by(results, PostureEs):
        return generic.page(results, settings)
    compared = (("distance to the goal", True, measures.residuals),)
    return PAPER.page(
        results,
        "tasks",
        quantities=quantities(results),
        tables=tables(results, settings),
        claims=claims.judge_tasks(results, settings),
        checks=checks(results),
        comparisons=kit.compared_with_controls(results, settings, compared),
        drawings=drawings(results, settings),
    )


def quantities(results: kit.Results) -> tuple[kit.Quantity, ...]:
    """Return the rows of the table of results."""
    row, column = partial(generic.quantity, results), kit.by_column
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


def effort_quantities(results: kit.Results) -> tuple[kit.Quantity, ...]:
    """Return the rows that need no log, only summaries."""
    row, unit = partial(generic.quantity, results), results.with_data[0].condition.length_unit
    column = kit.by_column
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


def tables(results: kit.Results, settings: kit.ReportSettings) -> tuple[kit.Table, ...]:
    """Return the tables of tasks, and of the phases of those that have several."""
    level = settings.confidence
    phases = tuple(row for c in _phased(results) for row in _phase_rows(c, level))
    beside, released = _beside_empty(results, level), tuple(map(_release_row, _releasing(results)))
    rows = tuple(_task_row(c, level) for c in results.with_data)
    found = (
        PAPER.table("tasks", rows, level=100 * level),
        PAPER.table("beside", beside),
        PAPER.table("phases", phases),
        PAPER.table("released", released),
    )
    return tuple(table for table in found if table.rows)


def _task_row(condition: kit.ConditionResults, level: float) -> tuple[str, ...]:
    """Return the row of a task: shares of its runs, the ends of searches, efforts."""
    counts = run_measures.success, run_values.certified, measures.refuted
    reasons = measures.reasons(condition).items()
    efforts = measures.cycles, measures.evaluations, measures.num_steps
    return (
        condition.label,
        *(count(condition).with_interval(level) for count in counts),
        ", ".join(f"{name} {p.having}" for name, p in reasons if p.having),
        *(markdown.spread(kit.spread(effort(condition))) for effort in efforts),
    )


def _beside_empty(results: kit.Results, level: float) -> tuple[tuple[str, ...], ...]:
    """Return a row per task that has an empty scene as its control: shares, test, cycles."""
    pairs = measures.with_empty_scenes(results.main)
    tested = [kit.fisher_exact(run_measures.success(c), run_measures.success(e)) for c, e in pairs]
    return tuple(
        (
            c.label,
            *(run_measures.success(one).with_interval(level) for one in (c, e)),
            markdown.p_value(p),
            *(markdown.spread(kit.spread(measures.cycles(one))) for one in (c, e)),
        )
        for (c, e), p in zip(pairs, kit.holm(tested), strict=True)
    )


def _releasing(results: kit.Results) -> tuple[kit.ConditionResults, ...]:
    """Return the conditions in which an object is let go of in a run at least."""
    main = measures.among_obstacles(results.main)
    detaching = (c for c in main if measures.lets_go(c))
    return tuple(c for c in detaching if measures.releases(c))


def _release_row(condition: kit.ConditionResults) -> tuple[str, ...]:
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


def _phased(results: kit.Results) -> tuple[kit.ConditionResults, ...]:
    """Return the conditions that have several phases."""
    several = (c for c in results.main if len(measures.phase_names(c)) > 1)
    return measures.among_obstacles(tuple(several))


def _phase_rows(condition: kit.ConditionResults, level: float) -> Iterator[tuple[object, ...]]:
    """Return a row per phase: runs that met its goal, and cycles."""
    table = measures.phase_cycles(condition)
    for k, name in enumerate(measures.phase_names(condition)):
        own = table[table["phase"] == k]
        cycles = markdown.spread(kit.spread(own["cycles"].to_numpy(dtype=np.float64)))
        yield (
            condition.label,
            f"{k + 1}  {name}",
            kit.counted(own["reached"]).with_interval(level),
            cycles,
        )


def checks(results: kit.Results) -> tuple[tuple[str, str], ...]:
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
    return (*rows, *PAPER.checks("tasks"))


def drawings(results: kit.Results, settings: kit.ReportSettings) -> tuple[kit.Drawing, ...]:
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
        PAPER.drawing(
            "fig_2_scope",
            partial(posture_motions.scope_table, main[0]),
            posture_motions.draw_scope,
            main[:1],
        ),
        PAPER.drawing(
            "history",
            partial(posture_history.history_table, results._replace(conditions=main)),
            posture_history.draw_history,
            main,
        ),
        PAPER.drawing(
            "stop_reasons",
            partial(shares.shares_table, reasons, {}, settings.confidence),
            shares.draw_shares,
            every,
            level=level,
        ),
        _paths("paths", shown),
        *_manoeuvres(results, settings),
        *_trap(main),
    )


def _paths(name: str, shown: list[ShownPath], suffix: str = "") -> kit.Drawing:
    table = partial(posture_motions.motions_table, shown)
    draw = partial(posture_motions.draw_motions, same_scene=shown[0].by_phase)
    plays = tuple(kit.PlayedRun(one.condition, one.replicate) for one in shown)
    drawing = PAPER.drawing(name, table, draw, [one.condition for one in shown], plays)
    return drawing._replace(stem=drawing.stem + suffix)


def _manoeuvres(results: kit.Results, settings: kit.ReportSettings) -> list[kit.Drawing]:
    """Return the figures of conditions that have several phases."""
    phased, level = _phased(results), settings.confidence
    several = [c for c in phased if len(measures.phase_names(c)) > len(measures.subgoals(c)) + 1]
    ends = [f"_{results.position(c.label) + 1}" if len(several) > 1 else "" for c in several]
    shown = [ShownPath(c.label, c, measures.shown_replicate(c), True) for c in several]
    phases = PAPER.drawing(
        "phases",
        partial(posture_history.phases_table, results._replace(conditions=phased), level),
        posture_history.draw_phases,
        phased,
        level=100 * level,
    )
    found = [_paths("manoeuvre", [one], end) for end, one in zip(ends, shown, strict=True)]
    return [*found, phases] if phased else found


def _trap(main: tuple[kit.ConditionResults, ...]) -> list[kit.Drawing]:
    """Return the figure of the local minimum, where runs get stuck that a sub-goal helps."""
    pair = posture_trap.pair(main)
    if pair is None:
        return []
    table = partial(posture_trap.trap_table, *pair)
    samples = posture_trap.SAMPLES
    return [PAPER.drawing("trap", table, posture_trap.draw_trap, pair, samples=samples)]


def _models(main: tuple[kit.ConditionResults, ...]) -> kit.Drawing:
    found = measures.by_robot(main)
    shown = [(c.label if len(found) > 1 else "the robot", c) for c in found]
    return PAPER.drawing(
        "fig_3_4_models", partial(solids.models_table, shown), solids.draw_models, found
    )
