"""Corsépius 2001, Figs. 2–4: an evolution strategy on postures, task by task."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from evoexp.numeric.elementary import DEGREE
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
    tilts = (
        kit.quantity(
            results,
            f"greatest tilt {where} postures ({term.replace('_', ' ')})",
            "deg",
            kit.by_column(f"term_greatest_{term}{part}_deg"),
        )
        for term in claims.TILTS
        if any(getattr(c.planner.objective, term) is not None for c in results.with_data)
        for where, part in (("at", ""), ("between", "_between"))
    )
    own = {"path_lengths": measures.path_lengths, "detours": measures.detours}
    return (*effort_quantities(results), *PAPER.quantities(results, "paths", own), *tilts)


def effort_quantities(results: kit.Results) -> tuple[kit.Quantity, ...]:
    """Return the rows that need no log, only summaries."""
    own = {"residuals": measures.residuals, "num_steps": measures.num_steps}
    return PAPER.quantities(results, "effort", own)


def tables(results: kit.Results, settings: kit.ReportSettings) -> tuple[kit.Table, ...]:
    """Return the tables of tasks, and of the phases of those that have several."""
    level = settings.confidence
    phases = tuple(row for c in _phased(results) for row in _phase_rows(c, level))
    letting_go = filter(measures.lets_go, measures.among_obstacles(results.main))
    released = tuple(_release_row(c) for c in letting_go if measures.releases(c))
    rows = tuple(_task_row(c, level) for c in results.with_data)
    found = (
        PAPER.table("tasks", rows, level=100 * level),
        PAPER.table("beside", _beside_empty(results, level)),
        PAPER.table("phases", phases),
        PAPER.table("released", released),
    )
    return tuple(table for table in found if table.rows)


def _task_row(condition: kit.ConditionResults, level: float) -> tuple[str, ...]:
    """Return the row of a task: shares of its runs, the ends of searches, efforts."""
    counts = run_measures.success, kit.certified, measures.refuted
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
    by_robot = measures.by_robot(main)
    titled = [(c.label if len(by_robot) > 1 else "the robot", c) for c in by_robot]
    models = PAPER.drawing("fig_3_4_models", solids.MODELS, by_robot, titled)
    pair, samples = posture_trap.pair(main), posture_trap.SAMPLES
    return (
        models,
        PAPER.drawing("fig_2_scope", posture_motions.SCOPE, main[:1], main[0]),
        PAPER.drawing("history", posture_history.HISTORY, main, results._replace(conditions=main)),
        PAPER.drawing(
            "stop_reasons",
            shares.SHARES,
            every,
            reasons,
            {},
            settings.confidence,
            level=level,
        ),
        _paths("paths", shown),
        *_manoeuvres(results, settings),
        *([PAPER.drawing("trap", posture_trap.TRAP, pair, *pair, samples=samples)] if pair else ()),
    )


def _paths(name: str, shown: list[ShownPath], suffix: str = "") -> kit.Drawing:
    table = partial(posture_motions.motions_table, shown)
    draw = partial(posture_motions.draw_motions, same_scene=shown[0].by_phase)
    plays = tuple(kit.PlayedRun(one.condition, one.replicate) for one in shown)
    drawing = PAPER.drawing(name, (table, draw), [one.condition for one in shown], plays=plays)
    return drawing._replace(stem=drawing.stem + suffix)


def _manoeuvres(results: kit.Results, settings: kit.ReportSettings) -> list[kit.Drawing]:
    """Return the figures of conditions that have several phases."""
    phased, level = _phased(results), settings.confidence
    several = [c for c in phased if len(measures.phase_names(c)) > len(measures.subgoals(c)) + 1]
    ends = [f"_{results.position(c.label) + 1}" if len(several) > 1 else "" for c in several]
    shown = [ShownPath(c.label, c, measures.shown_replicate(c), True) for c in several]
    phases = PAPER.drawing(
        "phases",
        posture_history.PHASES,
        phased,
        results._replace(conditions=phased),
        level,
        level=100 * level,
    )
    found = [_paths("manoeuvre", [one], end) for end, one in zip(ends, shown, strict=True)]
    return [*found, phases] if phased else found
