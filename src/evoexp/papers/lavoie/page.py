"""Lavoie & Boudreau 2001: arms of seven and ten joints reach into a box. Figs.

1–3, attempts, refuted motions.
"""

from functools import partial

import numpy as np

from evoexp.errors import SettingError
from evoexp.papers.lavoie import claims, measures
from evoexp.papers.lavoie.figures import attempts, error_distribution, reaching_motions
from evoexp.papers.lavoie.figures.reaching_motions import Shown
from evoexp.papers.lavoie.measures import PRINTED, Refuted
from evoexp.report import body_contacts, markdown
from evoexp.report.claims import Claim
from evoexp.report.judging import not_judged
from evoexp.report.page import Drawing, Page, Quantity
from evoexp.report.pages import generic
from evoexp.report.proportions import Proportion
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

INTRODUCTION = (
    "A genetic algorithm searches the posture A at the end of the first sub-path (SP1, tip near "
    "the via point), a second one the posture B at the end of the second (SP2, tip near the "
    "goal, inside the box); both are repeated until both are successful, ten times at most. The "
    "cost is the objective of SP2 (Eq. 4): position error + 0.7 · joint displacement, infinite "
    "in collision or outside the box; lower is better. A run has a solution if both searches "
    "were successful: they stopped below their values, 6 and 2 (unless `planner.success` is "
    "`finite`); its error is that of the tip at the end of SP2."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; the generic one where planners are others."""
    if not measures.fits(results):
        return generic.page(results, settings)
    refuted = {c.label: measures.refuted(c) for c in results.with_data}
    return Page(
        title=f"Lavoie & Boudreau 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=quantities(results),
        claims=_claims(results, settings, refuted),
        checks=_checks(results, settings, refuted),
        drawings=_drawings(results, settings),
    )


def quantities(results: Results) -> tuple[Quantity, ...]:
    """Return the rows of the table of results."""
    row, unit = partial(generic.quantity, results), results.with_data[0].condition.length_unit
    cost, _, evaluations, queries = generic.quantities(results)
    column = generic.by_column
    return (
        row("position error of SP2 (runs without a solution: ∞)", unit, measures.errors),
        cost._replace(name="objective of SP2"),
        row("joint displacement of SP1", "rad", column("term_joint_displacement_sp1_rad")),
        row("joint displacement of SP2", "rad", column("term_joint_displacement_sp2_rad")),
        row("position error of SP1", unit, column("term_position_error_sp1")),
        row("attempts", "–", column("term_attempts")),
        evaluations,
        queries,
        row("clearance of the bodies over the whole motion (exact)", unit, column("clearance")),
        row("CPU time of a run, exact verdict included", "s", column("cpu_s")),
        row("CPU time of its search", "s", measures.search_seconds),
        row("evaluations per second of search", "1/s", measures.evaluations_per_second),
        row(
            "tests of a link against an ellipse per second of search",
            "1/s",
            measures.tests_per_second,
        ),
    )


def _claims(
    results: Results, settings: ReportSettings, refuted: dict[str, Refuted]
) -> tuple[Claim, ...]:
    found: list[Claim] = []
    for c in results.with_data:
        found += claims.percentages(not_judged(results), c, settings)
    found += claims.more_joints_are_better(results, settings)
    for c in results.with_data:
        found.append(claims.no_start_needed(results, c))
        found.append(claims.free_of_collision(results, c, refuted[c.label].anywhere, settings))
    return (*found, *claims.judged_elsewhere())


def _checks(
    results: Results, settings: ReportSettings, refuted: dict[str, Refuted]
) -> tuple[tuple[str, str], ...]:
    level, shown = settings.confidence, results.with_data

    def line(what: str, of: dict[str, Proportion]) -> tuple[str, str]:
        return what, "; ".join(
            f"{label}: {measures.text(found, level)}" for label, found in of.items()
        )

    accepted = "Accepted motions that touch an obstacle between tested positions (exact verdict)"
    rows = [
        line(accepted, {label: found.anywhere for label, found in refuted.items()}),
        line("… on SP1", {label: found.sp1 for label, found in refuted.items()}),
        line("… on SP2", {label: found.sp2 for label, found in refuted.items()}),
        (
            "What removes it",
            "more positions M, and chords from one position to the next: `evoexp run "
            "experiment=lavoie_sweeps_positions`; what an arm blind to obstacles does: `evoexp run "
            "experiment=lavoie_controls`",
        ),
        line("Runs with a solution", {c.label: Proportion(c.solved, c.done) for c in shown}),
        (
            "Attempts of SP1 → SP2: mean, most",
            "; ".join(
                f"{c.label}: {c.column('term_attempts').mean():.3f}, "
                f"{c.column('term_attempts').max():.0f} of at most {c.planner.num_attempts}"
                for c in shown
            ),
        ),
        ("An error of 2 or more", AT_LEAST_TWO),
        ("Selection, crossover and mutation", OPERATORS),
        ("Time of a run", TIME),
    ]
    literal = ((c, _literal_shift(c)) for c in shown)
    rows += [
        (f"{c.label}: the printed shift of obstacles, read literally", text)
        for c, text in literal
        if text
    ]
    return tuple(rows)


AT_LEAST_TWO = (
    "cannot come from a run that stopped below 2: the objective is at least the error. So "
    "P(error < 2) is the share of runs with a solution, and the printed 99.8 % says that 2 of "
    "1000 runs of the paper had none after ten attempts, or counted as successful without "
    "stopping below 2: `evoexp run experiment=lavoie_success`"
)


OPERATORS = (
    "are not named by the paper, and the percentages depend on them: `evoexp run "
    "experiment=lavoie_operators`; so neither agreement nor disagreement with Fig. 3 says much "
    "of the paper's algorithm"
)
TIME = (
    "the paper prints its own (Pentium II, 400 MHz) inside Fig. 3 only; here: above, one core of "
    "this run's machine"
)


def _literal_shift(condition: ConditionResults) -> str:
    """Say what happens where the words vertically and horizontally are not swapped.

    Empty where nothing is shifted.
    """
    scenario = condition.condition.scenario
    dx, dy = scenario.obstacle_shift  # type: ignore[attr-defined]
    if dx == dy:
        return ""
    literal = scenario.model_copy(update={"obstacle_shift": (dy, dx)})
    try:
        condition.planner.prepare(condition.condition.robot, literal)
    except SettingError as error:
        return f"({dy:g}, {dx:g}) instead of ({dx:g}, {dy:g}) is refused: {error}"
    return f"({dy:g}, {dx:g}) instead of ({dx:g}, {dy:g}): the start is free of collision"


def _drawings(results: Results, settings: ReportSettings) -> tuple[Drawing, ...]:
    shown, level = results.with_data, f"{100 * settings.confidence:g} %"
    return (
        _postures(
            "fig_1_start", "Fig. 1: start postures", START, [Shown(c.label, c) for c in shown]
        ),
        *_solutions(results),
        Drawing(
            "fig_3_error",
            "Fig. 3: probability of a position error below x",
            "Steps: share of all runs that end with a solution of a smaller error, with Wilson's "
            f"{level} interval at each x. Diamonds: the percentages that the paper prints, with "
            "the intervals of its own thousand runs.",
            partial(
                error_distribution.distribution_table,
                results,
                measures.errors,
                _printed,
                settings.confidence,
            ),
            error_distribution.draw_distribution,
            shown,
        ),
        Drawing(
            "attempts",
            "Attempts",
            f"Share of runs that took so many attempts of SP1 → SP2, with Wilson's {level} "
            "interval; above: runs.",
            partial(attempts.attempts_table, results, settings.confidence),
            attempts.draw_attempts,
            shown,
        ),
    )


START = (
    "The ellipses as they are tested, exactly; their places and sizes are read off the paper's "
    "Fig. 1. The tip must end inside the box."
)
SOLUTIONS = (
    "The paper shows one solution of the arm of seven joints. Here: per arm the run whose "
    "position error is the median of all solved runs (the lower one of two); intermediate "
    "postures are tested positions (Eq. 3), the later the stronger."
)
THROUGH = (
    "Per arm the accepted run of median position error among those that the exact verdict "
    "refutes: every tested position is free, and the arm passes through an obstacle between two "
    "of them."
)


def _solutions(results: Results) -> list[Drawing]:
    """Return the figures of solutions.

    The median one of each arm, and the median one of those that are refuted.
    """
    found = []
    for stem, title, caption, only_refuted in (
        ("fig_2_solution", "Fig. 2: solutions", SOLUTIONS, False),
        ("refuted", "What the tested positions let through", THROUGH, True),
    ):
        shown = []
        for c in results.with_data:
            rows = measures.solved(c) & (measures.touches(c) | (not only_refuted))
            if rows.any():
                shown.append(_solution(c, _median_replicate(c, rows)))
        if shown:
            found.append(_postures(stem, title, caption, shown))
    return found


def _postures(stem: str, title: str, caption: str, shown: list[Shown]) -> Drawing:
    table = partial(reaching_motions.reaching_table, shown)
    return Drawing(
        stem,
        title,
        caption,
        table,
        reaching_motions.draw_reaching,
        tuple(one.condition for one in shown),
    )


def _printed(condition: ConditionResults) -> list[error_distribution.Point]:
    own = measures.num_joints(condition)
    return [(one.bound, one.proportion) for one in PRINTED if one.joints == own]


def _median_replicate(condition: ConditionResults, rows: np.ndarray) -> int:
    """Return the replicate of median position error (the lower one of two) among some rows.

    Done,.
    """
    candidates = np.flatnonzero(rows)
    ordered = candidates[np.argsort(measures.errors(condition)[candidates], kind="stable")]
    return int(condition.summaries.index[ordered[(len(ordered) - 1) // 2]])


def _solution(condition: ConditionResults, replicate: int) -> Shown:
    verdict = body_contacts.refuted(condition).get(replicate)
    found = measures.contacts(condition, replicate, verdict) if verdict else []
    error = float(measures.errors(condition)[condition.summaries.index.get_loc(replicate)])
    title = f"{condition.label}: run {replicate}, error {markdown.number(error)}"
    return Shown(title, condition, replicate, found)
