"""Lavoie & Boudreau 2001, Figs. 1–3: arms of seven and ten joints reach into a box."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from evoexp.papers.lavoie import claims, measures
from evoexp.papers.lavoie.figures import attempts, error_distribution, reaching_motions
from evoexp.papers.lavoie.figures.reaching_motions import ShownMotion
from evoexp.papers.lavoie.measures import RefutedMotions
from evoexp.papers.lavoie.rules import RULES
from evoexp.planners.reaching_tasks import Problem
from evoexp.report.kit import (
    Claim,
    ConditionResults,
    Drawing,
    Page,
    PlayedRun,
    Proportion,
    Quantity,
    ReportSettings,
    Results,
    body_contacts,
    by_column,
    generic,
    judging,
    markdown,
    run_measures,
)

INTRODUCTION = (
    "A genetic algorithm searches the posture A at the end of the first sub-path (SP1, tip near "
    "the via point), a second one the posture B at the end of the second (SP2, tip near the "
    "goal, inside the box); both are repeated until both are successful, ten times at most. The "
    "cost is the objective of SP2 (Eq. 4): position error + 0.7 · joint displacement, infinite "
    "in collision or outside the box; lower is better. A run has a solution if both searches "
    "were successful: they stopped below their values, 6 and 2 (unless `planner.success` is "
    "`finite`); its error is that of the tip at the end of SP2."
)
ACCEPTED = "Accepted motions that touch an obstacle between tested positions (exact verdict)"
REMOVED = (
    "Remedies",
    "more positions M, and chords from one position to the next: `evoexp run "
    "experiment=lavoie_sweeps_positions`; an arm blind to obstacles: `evoexp run "
    "experiment=lavoie_controls`",
)
CHECKS = (
    (
        "An error of 2 or more",
        "cannot come from a run that stopped below 2: the objective is at least the error. So "
        "P(error < 2) is the share of runs with a solution, and the printed 99.8 % says that 2 of "
        "1000 runs of the paper had none after ten attempts, or counted as successful without "
        "stopping below 2: `evoexp run experiment=lavoie_success`",
    ),
    (
        "Selection, crossover and mutation",
        "are not named by the paper, and the percentages depend on them: `evoexp run "
        "experiment=lavoie_operators`; so neither agreement nor disagreement with Fig. 3 says much "
        "of the paper's algorithm",
    ),
    (
        "Time of a run",
        "the paper prints its own (Pentium II, 400 MHz) inside Fig. 3 only; here: above, one core "
        "of this run's machine",
    ),
)
START = (
    "The ellipses as they are tested, exactly; the paper prints neither their places nor their "
    "sizes: ours make a box around the printed goal, open towards the printed via-point. The "
    "tip must end inside the box."
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


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the arms, or the generic page if another planner was run."""
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
    column = by_column
    tests = "tests of a link against an ellipse per second of search"
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
        row("CPU time of its search", "s", run_measures.search_seconds),
        row("evaluations per second of search", "1/s", run_measures.evaluations_per_second),
        row(tests, "1/s", measures.tests_per_second),
    )


def _claims(
    results: Results, settings: ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[Claim, ...]:
    judge, level = judging.judge(results, settings, RULES), settings.confidence
    shown = results.with_data
    return (
        *claims.percentages(judge, shown, level),
        *claims.more_joints_are_better(judge, shown, level),
        *(
            one
            for c in shown
            for one in (
                claims.no_start_needed(judge, c, level),
                claims.free_of_collision(judge, c, refuted[c.label].anywhere, level),
            )
            if one is not None
        ),
        *claims.judged_elsewhere(judge),
    )


def _checks(
    results: Results, settings: ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[tuple[str, str], ...]:
    """Return the rows on contacts, solutions, attempts and the literal reading of the shift."""

    def row(what: str, counts: dict[str, Proportion]) -> tuple[str, str]:
        texts = (f"{name}: {measures.text(p, settings.confidence)}" for name, p in counts.items())
        return what, "; ".join(texts)

    attempts = (
        f"{c.label}: {c.column('term_attempts').mean():.3f}, "
        f"{c.column('term_attempts').max():.0f} of at most {c.planner.num_attempts}"
        for c in results.with_data
    )
    success = {c.label: run_measures.success(c) for c in results.with_data}
    return (
        row(ACCEPTED, {label: found.anywhere for label, found in refuted.items()}),
        row("… on SP1", {label: found.sp1 for label, found in refuted.items()}),
        row("… on SP2", {label: found.sp2 for label, found in refuted.items()}),
        REMOVED,
        row("Runs with a solution", success),
        ("Attempts of SP1 → SP2: mean, most", "; ".join(attempts)),
        *CHECKS,
        *(one for c in results.with_data for one in _literal_shift(c)),
    )


def _literal_shift(condition: ConditionResults) -> list[tuple[str, str]]:
    """Return a row on the printed shift if the words vertically and horizontally are not swapped.

    There is none if nothing is shifted. The arm's collision model tells whether the start is free
    among the obstacles of the literal reading.
    """
    scenario: Any = condition.condition.scenario
    problem = condition.problem(Problem)
    dx, dy = scenario.obstacle_shift
    if dx == dy:
        return []
    literal = scenario.model_copy(update={"obstacle_shift": (dy, dx)})
    model = condition.planner.collision.bind(problem.assembly, literal.obstacle_table())
    contact = model.contact(problem.start, problem.start)
    told = "the start is free of collision"
    if contact:
        told = (
            f"the start is not free of collision: link {contact.link} touches obstacle "
            f"{contact.obstacle}"
        )
    what = f"{condition.label}: the printed shift of obstacles, read literally"
    return [(what, f"({dy:g}, {dx:g}) instead of ({dx:g}, {dy:g}): {told}")]


def _drawings(results: Results, settings: ReportSettings) -> tuple[Drawing, ...]:
    shown, level = results.with_data, f"{100 * settings.confidence:g} %"
    starts = [ShownMotion(c.label, c) for c in shown]
    distribution = partial(
        error_distribution.distribution_table,
        results,
        measures.errors,
        lambda c: [(one.bound, one.proportion) for one in measures.printed(c)],
        settings.confidence,
    )
    return (
        _postures("fig_1_start", "Fig. 1: start postures", START, starts),
        *_solutions(results),
        Drawing(
            "fig_3_error",
            "Fig. 3: probability of a position error below x",
            "Steps: share of all runs that end with a solution of a smaller error, with Wilson's "
            f"{level} interval at each x. Diamonds: the percentages that the paper prints, with "
            "the intervals of its own thousand runs.",
            distribution,
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


def _solutions(results: Results) -> Iterator[Drawing]:
    """Return the figures of each arm's median solution and of its median refuted solution."""
    for stem, title, caption, only_refuted in (
        ("fig_2_solution", "Fig. 2: solutions", SOLUTIONS, False),
        ("refuted", "Contacts between tested positions", THROUGH, True),
    ):
        shown = []
        for c in results.with_data:
            rows = run_measures.solved(c) & (measures.touches(c) | (not only_refuted))
            if rows.any():
                errors = measures.errors(c)
                shown.append(_solution(c, run_measures.median_replicate(c, errors, rows)))
        if shown:
            yield _postures(stem, title, caption, shown)


def _postures(stem: str, title: str, caption: str, shown: list[ShownMotion]) -> Drawing:
    table, draw = partial(reaching_motions.reaching_table, shown), reaching_motions.draw_reaching
    plays = tuple(PlayedRun(c, k) for _, c, k, _ in shown if k is not None)
    return Drawing(stem, title, caption, table, draw, tuple(one.condition for one in shown), plays)


def _solution(condition: ConditionResults, replicate: int) -> ShownMotion:
    """Return a run as it is drawn: its error, its contacts."""
    verdict = body_contacts.refuted(condition).get(replicate)
    found = measures.contacts(condition, replicate, verdict) if verdict else []
    error = float(measures.errors(condition)[condition.summaries.index.get_loc(replicate)])
    title = f"{condition.label}: run {replicate}, error {markdown.number(error)}"
    return ShownMotion(title, condition, replicate, found)
