"""Lavoie & Boudreau 2001, Figs. 1–3: arms of seven and ten joints reach into a box."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from evoexp.papers.lavoie import claims, measures
from evoexp.papers.lavoie.figures import attempts, error_distribution, reaching_motions
from evoexp.papers.lavoie.figures.reaching_motions import ShownMotion
from evoexp.papers.lavoie.measures import RefutedMotions
from evoexp.papers.lavoie.rules import PAPER, RULES
from evoexp.planners.reaching_tasks import Problem
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown, motion_geometry, run_measures

ACCEPTED = "Accepted motions that touch an obstacle between tested positions (exact verdict)"
REMOVED = (
    "Remedies",
    "more positions M, and chords from one position to the next: `evoexp run "
    "experiment=lavoie_sweeps_positions`; an arm blind to obstacles: `evoexp run "
    "experiment=lavoie_controls`",
)


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the arms, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    refuted = {c.label: measures.refuted(c) for c in results.with_data}
    return PAPER.page(
        results,
        "arms",
        quantities=quantities(results),
        claims=_claims(results, settings, refuted),
        checks=_checks(results, settings, refuted),
        drawings=_drawings(results, settings),
    )


def quantities(results: kit.Results) -> tuple[kit.Quantity, ...]:
    """Return the rows of the table of results."""
    row, unit = partial(generic.quantity, results), results.with_data[0].condition.length_unit
    cost, _, evaluations, queries = generic.quantities(results)
    column = kit.by_column
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
    results: kit.Results, settings: kit.ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[kit.Claim, ...]:
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
    results: kit.Results, settings: kit.ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[tuple[str, str], ...]:
    """Return the rows on contacts, solutions, attempts and the literal reading of the shift."""

    def row(what: str, counts: dict[str, kit.Proportion]) -> tuple[str, str]:
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
        *PAPER.checks("arms"),
        *(one for c in results.with_data for one in _literal_shift(c)),
    )


def _literal_shift(condition: kit.ConditionResults) -> list[tuple[str, str]]:
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


def _drawings(results: kit.Results, settings: kit.ReportSettings) -> tuple[kit.Drawing, ...]:
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
        _postures("fig_1_start", starts),
        *_solutions(results),
        PAPER.drawing(
            "fig_3_error", distribution, error_distribution.draw_distribution, shown, level=level
        ),
        PAPER.drawing(
            "attempts",
            partial(attempts.attempts_table, results, settings.confidence),
            attempts.draw_attempts,
            shown,
            level=level,
        ),
    )


def _solutions(results: kit.Results) -> Iterator[kit.Drawing]:
    """Return the figures of each arm's median solution and of its median refuted solution."""
    for name, only_refuted in (("fig_2_solution", False), ("refuted", True)):
        shown = []
        for c in results.with_data:
            rows = run_measures.solved(c) & (measures.touches(c) | (not only_refuted))
            if rows.any():
                errors = measures.errors(c)
                shown.append(_solution(c, run_measures.median_replicate(c, errors, rows)))
        if shown:
            yield _postures(name, shown)


def _postures(name: str, shown: list[ShownMotion]) -> kit.Drawing:
    table, draw = partial(reaching_motions.reaching_table, shown), reaching_motions.draw_reaching
    plays = tuple(kit.PlayedRun(c, k) for _, c, k, _ in shown if k is not None)
    return PAPER.drawing(name, table, draw, [one.condition for one in shown], plays)


def _solution(condition: kit.ConditionResults, replicate: int) -> ShownMotion:
    """Return a run as it is drawn: its error, its contacts."""
    verdict = motion_geometry.refuted(condition).get(replicate)
    found = measures.contacts(condition, replicate, verdict) if verdict else []
    error = float(measures.errors(condition)[condition.summaries.index.get_loc(replicate)])
    title = f"{condition.label}: run {replicate}, error {markdown.number(error)}"
    return ShownMotion(title, condition, replicate, found)
