"""Lavoie & Boudreau 2001, Figs. 1–3: arms of seven and ten joints reach into a box."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from evoexp.papers.lavoie import claims, measures
from evoexp.papers.lavoie.figures import reaching_motions, run_distributions
from evoexp.papers.lavoie.figures.reaching_motions import ShownMotion
from evoexp.papers.lavoie.measures import RefutedMotions
from evoexp.papers.lavoie.rules import PAPER, RULES
from evoexp.planners.reaching_tasks import Problem
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown, motion_geometry, run_measures


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
    own = {"errors": measures.errors, "tests_per_second": measures.tests_per_second}
    return PAPER.quantities(results, "arms", own)


def _claims(
    results: kit.Results, settings: kit.ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[kit.Claim, ...]:
    judge, shown = judging.judge(results, settings, RULES), results.with_data
    return (
        *claims.percentages(judge, shown),
        *claims.more_joints_are_better(judge, shown),
        *(
            one
            for c in shown
            for one in (
                claims.no_start_needed(judge, c),
                claims.free_of_collision(judge, c, refuted[c.label].anywhere),
            )
            if one is not None
        ),
        *claims.judged_elsewhere(judge),
    )


def _checks(
    results: kit.Results, settings: kit.ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[tuple[str, str], ...]:
    """Return the rows on contacts, solutions, attempts and the literal reading of the shift."""

    def told(counts: dict[str, kit.Proportion]) -> str:
        texts = (f"{name}: {p.with_interval(settings.confidence, 1)}" for name, p in counts.items())
        return "; ".join(texts)

    attempts = (
        f"{c.label}: {c.column('term_attempts').mean():.3f}, "
        f"{c.column('term_attempts').max():.0f} of at most {c.planner.num_attempts}"
        for c in results.with_data
    )
    return (
        *PAPER.checks(
            "arms",
            accepted=told({label: found.anywhere for label, found in refuted.items()}),
            sp1=told({label: found.sp1 for label, found in refuted.items()}),
            sp2=told({label: found.sp2 for label, found in refuted.items()}),
            solved=told({c.label: run_measures.success(c) for c in results.with_data}),
            attempts="; ".join(attempts),
        ),
        *(one for c in results.with_data for one in _literal_shift(c)),
    )


def _literal_shift(condition: kit.ConditionResults) -> tuple[tuple[str, str], ...]:
    """Return a row on the printed shift if the words vertically and horizontally are not swapped.

    There is none if nothing is shifted. The arm's collision model tells whether the start is free
    among the obstacles of the literal reading.
    """
    scenario: Any = condition.condition.scenario
    problem = condition.problem(Problem)
    dx, dy = scenario.obstacle_shift
    if dx == dy:
        return ()
    literal = scenario.model_copy(update={"obstacle_shift": (dy, dx)})
    model = condition.planner.collision.bind(problem.assembly, literal.obstacle_table())
    contact = model.contact(problem.start, problem.start)
    touching = f"link {contact.link} touches obstacle {contact.obstacle}" if contact else ""
    told = f"not free of collision: {touching}" if contact else "free of collision"
    return PAPER.checks("shift", label=condition.label, dx=dx, dy=dy, told=told)


def _drawings(results: kit.Results, settings: kit.ReportSettings) -> tuple[kit.Drawing, ...]:
    shown, share = results.with_data, settings.confidence
    level = f"{100 * share:g} %"
    starts = [ShownMotion(c.label, c) for c in shown]
    own = measures.errors, lambda c: [(p.bound, p.proportion) for p in measures.printed(c)], share
    return (
        _postures("fig_1_start", starts),
        *_solutions(results),
        PAPER.drawing(
            "fig_3_error",
            run_distributions.DISTRIBUTION,
            shown,
            results,
            *own,
            level=level,
        ),
        PAPER.drawing("attempts", run_distributions.ATTEMPTS, shown, results, share, level=level),
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
    return PAPER.drawing(name, (table, draw), [one.condition for one in shown], plays=plays)


def _solution(condition: kit.ConditionResults, replicate: int) -> ShownMotion:
    """Return a run as it is drawn: its error, its contacts."""
    verdict = motion_geometry.refuted(condition).get(replicate)
    found = measures.contacts(condition, replicate, verdict) if verdict else []
    error = float(measures.errors(condition)[condition.summaries.index.get_loc(replicate)])
    title = f"{condition.label}: run {replicate}, error {markdown.number(error)}"
    return ShownMotion(title, condition, replicate, found)
