"""The page of `evoexp compare`: planners in one currency, by their proven answers alone."""

import itertools
from collections.abc import Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from evoexp.errors import NothingStored
from evoexp.records import FloatArray
from evoexp.report import markdown
from evoexp.report.comparisons import compared
from evoexp.report.figures import effort_curves
from evoexp.report.figures.effort_curves import MAX_PANELS, problem_order
from evoexp.report.page_parts import Drawing, Page, Table
from evoexp.report.pages import ranking
from evoexp.report.planner_runs import PlannerRuns, of_results
from evoexp.report.problem_ranks import standing
from evoexp.report.proportions import Proportion
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import (
    Interval,
    Spread,
    expected_effort,
    expected_interval,
    quantile,
    spread,
)
from evoexp.report.verdicts import Comparison

INTRODUCTION = (
    "An answer counts if the exact certifier proves the whole motion free of contact and it is a "
    "solution of the task, whatever the planner's own model says. It is rated by the length of its "
    "path in joint space; a path as long as the straight line from start to goal would be the "
    "shortest of all. Effort is counted in configurations that a planner asked to be judged for "
    "collision."
)
TARGETS = (
    "any at all, or one at most 4, 3, 2, 1.5, 1.2, 1.1, 1.05 times as long as the straight line."
)
EFFORT = (
    "Effort: expected running time (Hansen et al. 2009), the collision queries of all runs, failed "
    "ones included, per run with a proven answer; in brackets the bootstrap interval. Lengths: "
    "median and quartiles over runs, ∞: no proven answer. Refuted: last solutions that the "
    "planner's own model accepts and the certifier refutes."
)


class Rated(NamedTuple):
    """A condition, rated by the proven answers of its runs.

    Attributes:
        condition: Its label.
        planner: Its name in figures.
        problem: Name of the problem.
        runs: That are finished.
        proven: Runs with a proven answer.
        first_own: Median of the queries to the first answer that the planner's own model accepts.
        queries: Expected running time to a proven answer [collision queries].
        interval: Of it, by bootstrap.
        lengths: Best proven length of a run: median and quartiles [rad, m].
        straight: Distance from start to goal; NaN where goals differ.
        refuted: Last solutions that the planner's own model accepts and the certifier refutes.
        judged: Last solutions that were judged.
    """

    condition: str
    planner: str
    problem: str
    runs: int
    proven: int
    first_own: float
    queries: float
    interval: Interval
    lengths: Spread
    straight: float
    refuted: int
    judged: int

    @property
    def in_lines(self) -> Spread:
        """The lengths in units of the straight line from start to goal."""
        median, lower, upper, count = self.lengths
        return Spread(median / self.straight, lower / self.straight, upper / self.straight, count)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page.

    Raises:
        NothingStored: If no run has a motion.
    """
    return page_of_runs(of_results(results.evolved), results, settings)


def page_of_runs(runs: Sequence[PlannerRuns], results: Results, settings: ReportSettings) -> Page:
    """Build the page from runs that are judged already.

    Raises:
        NothingStored: If there are none.
    """
    if not runs:
        raise NothingStored(f"{results.experiment or 'compare'}: no stored solution is a motion")
    found = standing(runs)
    return Page(
        title=f"{results.experiment or 'stored runs'}: proven answers",
        introduction=INTRODUCTION,
        tables=(_table(rated(runs, settings), settings), *ranking.tables(found, settings)),
        comparisons=_comparisons(runs, settings),
        drawings=(*_drawings(runs), *ranking.drawings(found, runs, settings)),
    )


def _drawings(runs: Sequence[PlannerRuns]) -> Iterator[Drawing]:
    """Yield the figures: curves of all problems and of each, or of one with its lengths."""
    conditions, problems = tuple(own.condition for own in runs), problem_order(runs)
    yield Drawing(
        stem="targets_reached",
        title="Targets reached",
        caption=f"Share of (problem, target, run) with a proven answer: {TARGETS} Left and high is "
        "good.",
        table=partial(effort_curves.share_table, runs),
        draw=effort_curves.draw_shares,
        conditions=conditions,
    )
    if len(problems) == 1:
        yield Drawing(
            stem="proven_lengths",
            title="Best proven length so far",
            caption="Median and quartiles over runs; a curve begins where half of the runs "
            "have a proven answer, its band where three quarters have one.",
            table=partial(effort_curves.length_table, runs),
            draw=effort_curves.draw_lengths,
            conditions=conditions,
        )
        return
    first = f" The first {MAX_PANELS} of {len(problems)}; the CSV has all."
    yield Drawing(
        stem="targets_by_problem",
        title="Targets reached, problem by problem",
        caption="The same of each problem by itself: share of (target, run). A planner that was "
        f"not run on a problem has no curve there.{first * (len(problems) > MAX_PANELS)}",
        table=partial(effort_curves.problem_share_table, runs),
        draw=effort_curves.draw_shares_by_problem,
        conditions=conditions,
    )


def rated(runs: Sequence[PlannerRuns], settings: ReportSettings) -> list[Rated]:
    """Return the conditions that have motions, rated by their proven answers."""
    return [_rated(own, settings) for own in runs]


def _rated(own: PlannerRuns, settings: ReportSettings) -> Rated:
    verdicts, table = own.condition.verdicts, own.table
    effort, reached = own.first_reached()
    first = table[table["solved"].astype(bool)].groupby("replicate")["collision_queries"].min()
    first_own = first.reindex(list(own.replicates)).fillna(np.inf).to_numpy(np.float64)
    return Rated(
        own.label,
        own.planner,
        own.problem.name,
        len(own.replicates),
        int(reached.sum()),
        quantile(first_own, 0.5),
        expected_effort(effort, reached),
        expected_interval(effort, reached, settings.confidence, settings.num_resamples),
        spread(own.best_lengths),
        own.problem.straight,
        verdicts.solved_refuted,
        verdicts.judged,
    )


def _table(rows: Sequence[Rated], settings: ReportSettings) -> Table:
    headers = (
        "condition",
        "runs",
        "with a proven answer",
        "queries to the first answer of its own model, median",
        "queries per proven answer",
        "best proven length [rad, m]",
        "the same in straight lines",
        "refuted",
    )
    cells = tuple(
        (
            row.condition,
            row.runs,
            Proportion(row.proven, row.runs).with_interval(settings.confidence, 0),
            markdown.number(row.first_own),
            f"{markdown.number(row.queries)} ({_between(row.interval)})",
            markdown.spread(row.lengths),
            markdown.spread(row.in_lines) if row.straight > 0.0 else "–",
            f"{row.refuted} of {row.judged}",
        )
        for row in rows
    )
    return Table("Answers", headers, cells, EFFORT)


def _between(interval: tuple[float, float]) -> str:
    return " to ".join(markdown.number(value) for value in interval)


def _comparisons(
    runs: Sequence[PlannerRuns], settings: ReportSettings
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare the planners of each problem on common seeds."""
    by_label = {own.label: own for own in runs}
    pairs = [
        (a.condition, b.condition)
        for a, b in itertools.combinations(runs, 2)
        if a.problem == b.problem
    ]

    def lengths(condition: ConditionResults) -> FloatArray:
        return by_label[condition.label].best_lengths

    rows = compared(pairs, lengths, settings, named=lambda a, b: f"{a.label} – {b.label}")
    return (("best proven length", rows),) if rows else ()
