"""Corsépius 2001: an evolution strategy on postures, task by task. Figs.

2-4, histories, paths, phases.
"""

from functools import partial

import numpy as np

from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius.figures import (
    posture_history,
    posture_models,
    posture_motions,
    posture_trap,
    search_scope,
)
from evoexp.papers.corsepius.figures.posture_motions import Shown
from evoexp.report import markdown
from evoexp.report.figures import shares
from evoexp.report.page import Drawing, Page, Quantity, Table
from evoexp.report.pages import generic
from evoexp.report.proportions import Proportion
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import spread

INTRODUCTION = (
    "An individual is a posture. Every cycle random steps within a local scope of a few parents "
    "give the offspring, the best of which are the next parents; the path is the ancestry of the "
    "first one that meets the goal. The cost is a sum of weighted terms in configuration and "
    "work space; lower is better. A run without a winner ends by stagnation or at its cap of "
    "cycles, and its path is that of the best posture. Solved: the goal is met, and every "
    "posture of the path is free by the spheres; what lies between postures the exact verdict "
    "tells."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; the generic one where planners are others."""
    if not measures.fits(results) or not results.main:
        return generic.page(results, settings)
    return Page(
        title=f"Corsépius 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=quantities(results),
        tables=tables(results, settings),
        claims=claims.of_tasks(results, settings),
        checks=checks(results),
        comparisons=generic.comparisons(
            results, settings, (("distance to the goal", True, measures.residuals),)
        ),
        drawings=drawings(results, settings),
    )


def quantities(results: Results) -> tuple[Quantity, ...]:
    """Return the rows of the table of results."""
    row, column = partial(generic.quantity, results), generic.by_column
    unit = results.with_data[0].condition.length_unit
    rows = [
        *effort_quantities(results),
        row("length of the path in joint space", "rad", measures.path_lengths),
        row("length over the straight line of its ends", "–", measures.detours),
        row("clearance of the bodies over the whole motion (exact)", unit, column("clearance")),
    ]
    for term in ("upright", "keep_parallel"):
        if any(getattr(c.planner.objective, term) is not None for c in results.with_data):
            name = term.replace("_", " ")
            rows.append(
                row(
                    f"greatest tilt at postures ({name})",
                    "deg",
                    column(f"term_greatest_{term}_deg"),
                )
            )
            between = column(f"term_greatest_{term}_between_deg")
            rows.append(row(f"greatest tilt between postures ({name})", "deg", between))
    return tuple(rows)


def effort_quantities(results: Results) -> tuple[Quantity, ...]:
    """Return those rows that the summaries alone give."""
    row, unit = partial(generic.quantity, results), results.with_data[0].condition.length_unit
    column = generic.by_column
    return (
        row("cycles, all phases", "–", measures.cycles),
        row("evaluations", "–", measures.evaluations),
        row("distance to the goal of the last phase", unit, measures.residuals),
        row("steps of the path", "–", measures.num_steps),
        row("longest step", "scopes", column("term_longest_step_scopes")),
        row("steps beyond the scope", "–", column("term_oversized_steps")),
        row("CPU time of its search", "s", measures.search_seconds),
        row("evaluations per second of search", "1/s", _speed),
    )


def _speed(condition: ConditionResults) -> np.ndarray:
    return np.asarray(measures.evaluations(condition) / measures.search_seconds(condition))


def tables(results: Results, settings: ReportSettings) -> tuple[Table, ...]:
    """Return what became of every task, and of every phase of those that have several."""
    level = settings.confidence
    rows = []
    for c in results.with_data:
        met, refuted, certified = measures.success(c), measures.refuted(c), measures.certified(c)
        counts = (measures.text(one, level) for one in (met, certified, refuted))
        rows.append(
            (c.label, *counts, _reasons(c), *(markdown.spread(spread(v(c))) for v in PER_RUN))
        )
    headers = (
        "task",
        "goal met",
        "of these certified",
        "of these refuted",
        "ended by",
        "cycles",
        "evaluations",
        "steps",
    )
    shares = (
        f"in brackets Wilson's {100 * level:g} % interval; of others median [quartiles] over all "
        "runs."
    )
    found = [Table("Tasks", headers, tuple(rows), f"Shares of runs, {shares}")]
    phases = tuple(
        row for c in results.main if len(measures.phase_names(c)) > 1 for row in _phases(c, level)
    )
    if phases:
        columns = ("task", "phase", "goal of the phase met, of the runs that began it", "cycles")
        found.append(Table("Phases", columns, phases))
    return tuple(found)


PER_RUN = (measures.cycles, measures.evaluations, measures.num_steps)


def checks(results: Results) -> tuple[tuple[str, str], ...]:
    """Return what is found of models and times."""
    rows = []
    for c in measures.by_robot(results.main):
        bodies = c.prepared.problem.bodies
        covers = (
            f"{len(bodies.names)} bodies covered by {bodies.num_shapes} shapes, at most "
            f"{bodies.inflation:.3g}"
        )
        pairs = (
            f"pairs of bodies: {len(bodies.pairs)} tested, {len(bodies.adjacent)} neighbours or "
            "disabled, "
        )
        pairs += f"{len(bodies.always)} always touch, {len(bodies.never)} never do"
        text = f"{covers} {c.condition.length_unit} beyond them; {pairs}"
        rows.append((f"{c.label}: the model of collisions", text))
    rows.append(("Paths between postures", BETWEEN))
    rows.append(("Times", TIMES))
    return tuple(rows)


BETWEEN = (
    "are not rated by the paper: what is solved can be refuted; `planner.edge_check` tests "
    "configurations between a parent and its child: `evoexp run experiment=corsepius_options`"
)
TIMES = (
    "the paper: Pentium III class PC; here: one core of this run's machine; the first run of a "
    "worker process loads the kernels, too"
)


def _reasons(condition: ConditionResults) -> str:
    found = measures.reasons(condition)
    return ", ".join(
        f"{name} {proportion.having}" for name, proportion in found.items() if proportion.having
    )


def _phases(condition: ConditionResults, level: float) -> list[tuple[object, ...]]:
    table = measures.phase_cycles(condition)
    rows: list[tuple[object, ...]] = []
    for k, name in enumerate(measures.phase_names(condition)):
        own = table[table["phase"] == k]
        reached = Proportion(int(own["reached"].sum()), len(own))
        spent = spread(own["cycles"].to_numpy(dtype=np.float64))
        rows.append(
            (
                condition.label,
                f"{k + 1}  {name}",
                measures.text(reached, level),
                markdown.spread(spent),
            )
        )
    return rows


def drawings(results: Results, settings: ReportSettings) -> tuple[Drawing, ...]:
    """Return the figures."""
    main, level = results.main, f"{100 * settings.confidence:g} %"
    found = (
        _models(main),
        Drawing(
            "fig_2_scope",
            "Fig. 2: local search scope",
            "Left: the boxes that a posture's offspring are drawn from, along one path, in the "
            "plane of its two joints that move most; every child lies in its parent's box. "
            "Right: where the tool can be one step away from the start, for the scope, a half "
            "and twice of it: hulls of random steps, as seen from above.",
            partial(search_scope.scope_table, main[0], measures.shown_replicate(main[0])),
            search_scope.draw_scope,
            main[:1],
        ),
        Drawing(
            "history",
            "Approach to the goal",
            "Best so far against cycles: median and quartiles of the runs that began the phase; "
            "one that has ended keeps its last value. What is best goes by cost, so a distance "
            "may grow. At the curves: how many runs.",
            partial(posture_history.history_table, results),
            posture_history.draw_history,
            main,
        ),
        Drawing(
            "stop_reasons",
            "Why searches end",
            f"Share of runs, with Wilson's {level} interval.",
            partial(
                shares.shares_table, posture_history.reasons_rows(results), {}, settings.confidence
            ),
            shares.draw_shares,
            main,
        ),
        Drawing(
            "paths",
            "Paths",
            PATHS,
            partial(posture_motions.motions_table, [_shown(c) for c in main]),
            posture_motions.draw_motions,
            main,
        ),
    )
    return (*found, *_manoeuvres(results, settings), *_trap(main))


def _manoeuvres(results: Results, settings: ReportSettings) -> list[Drawing]:
    """Return the figures of conditions that have several phases."""
    main, found = results.main, []
    several = [c for c in main if len(measures.phase_names(c)) > len(measures.subgoals(c)) + 1]
    for c in several:
        one = Shown(c.label, c, measures.shown_replicate(c), True)
        stem = "manoeuvre" if len(several) == 1 else f"manoeuvre_{results.position(c.label) + 1}"
        table = partial(posture_motions.motions_table, [one])
        found.append(
            Drawing(
                stem,
                "The manoeuvre, phase by phase",
                PHASES,
                table,
                posture_motions.draw_motions,
                (c,),
            )
        )
    phased = tuple(c for c in main if len(measures.phase_names(c)) > 1)
    if phased:
        level = f"{100 * settings.confidence:g} %"
        caption = (
            f"Of the runs that began a phase: how many met its goal (Wilson's {level} interval), "
            "and their cycles."
        )
        table = partial(
            posture_history.phases_table, results._replace(conditions=phased), settings.confidence
        )
        found.append(
            Drawing("phases", "Phases", caption, table, posture_history.draw_phases, phased)
        )
    return found


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
    "Nobody planned it."
)
PHASES = (
    "The same path, one panel per phase. Green: the object while it is held, where the phase "
    "begins and ends."
)
TRAP = (
    "a: where the tools go, all runs that are stuck (crosses: their ends) and all that a "
    "sub-goal has helped. b: a way around must lead away from the goal, or along the wall, "
    "before it leads there. c: the cost over the two joints that moved most on the way to the "
    "median stuck posture, the others as they are there; grey: infeasible. d: the least cost "
    f"among {posture_trap.SAMPLES} random postures in boxes around it: how far away something "
    "better is."
)


def _models(main: tuple[ConditionResults, ...]) -> Drawing:
    found = measures.by_robot(main)
    shown = [(c.label if len(found) > 1 else "the robot", c) for c in found]
    return Drawing(
        "fig_3_4_models",
        "Figs. 3 and 4: robots, and what stands for them",
        "Left: the bodies, by which the exact verdict judges. Right: the spheres or capsules "
        "that cover them, by which the search does; the paper's sets have 10⁵ to 10⁶ spheres.",
        partial(posture_models.models_table, shown),
        posture_models.draw_models,
        found,
    )


def _shown(condition: ConditionResults) -> Shown:
    replicate = measures.shown_replicate(condition)
    state = "" if measures.solved(condition).any() else ", not solved"
    return Shown(f"{condition.label}\nrun {replicate}{state}", condition, replicate)
