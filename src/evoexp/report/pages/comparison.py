"""The page of `evoexp compare`: planners in one currency, by their proven answers alone."""

import itertools
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from evoexp.errors import NothingStored
from evoexp.report import markdown
from evoexp.report.comparisons import compared
from evoexp.report.figures import effort_curves
from evoexp.report.page_parts import Drawing, Page, Table
from evoexp.report.proportions import Proportion
from evoexp.report.proven_answers import answers, best_lengths, first_reached, straight_line
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
EFFORT = (
    "Effort: expected running time (Hansen et al. 2009), the collision queries of all runs, failed "
    "ones included, per run with a proven answer; in brackets the bootstrap interval. Lengths: "
    "median and quartiles over runs, ∞: no proven answer. Refuted: last solutions that the "
    "planner's own model accepts and the certifier refutes."
)
Planners = dict[str, list[ConditionResults]]


class Rated(NamedTuple):
    """A condition, rated by the proven answers of its runs.

    Attributes:
        condition: Its label.
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
    found = {c.label: answers(c) for c in results.evolved}
    conditions = [c for c in results.evolved if len(found[c.label])]
    if not conditions:
        raise NothingStored(f"{results.experiment or 'compare'}: no stored solution is a motion")
    planners = _planners(conditions)
    drawn = [
        Drawing(
            stem="targets_reached",
            title="Targets reached",
            caption="Share of (problem, target, run) with a proven answer: any at all, or one at "
            "most 4, 3, 2, 1.5, 1.2, 1.1, 1.05 times as long as the straight line. Left and high "
            "is good.",
            table=partial(effort_curves.share_table, planners, found),
            draw=effort_curves.draw_shares,
            conditions=tuple(conditions),
        )
    ]
    if _num_problems(conditions) == 1:
        drawn.append(
            Drawing(
                stem="proven_lengths",
                title="Best proven length so far",
                caption="Median and quartiles over runs; a curve begins where half of the runs "
                "have a proven answer, its band where three quarters have one.",
                table=partial(effort_curves.length_table, planners, found),
                draw=effort_curves.draw_lengths,
                conditions=tuple(conditions),
            )
        )
    return Page(
        title=f"{results.experiment or 'stored runs'}: proven answers",
        introduction=INTRODUCTION,
        tables=(_table(rated(results, settings), settings),),
        comparisons=_comparisons(conditions, found, settings),
        drawings=tuple(drawn),
    )


def _planners(conditions: Sequence[ConditionResults]) -> Planners:
    """Return the conditions by planner; of one problem each condition is a planner."""
    if _num_problems(conditions) == 1:
        return {c.label: [c] for c in conditions}
    found: Planners = {}
    kinds = list(dict.fromkeys(c.condition.planner for c in conditions))
    for c in conditions:
        same = [kind for kind in kinds if kind.component == c.condition.planner.component]
        number = f" {same.index(c.condition.planner) + 1}" if len(same) > 1 else ""
        found.setdefault(f"{c.condition.planner.component}{number}", []).append(c)
    return found


def _num_problems(conditions: Sequence[ConditionResults]) -> int:
    return len({(c.condition.robot, c.condition.scenario) for c in conditions})


def rated(results: Results, settings: ReportSettings) -> list[Rated]:
    """Return the conditions that have motions, rated by their proven answers."""
    found = {c.label: answers(c) for c in results.evolved}
    return [_rated(c, found[c.label], settings) for c in results.evolved if len(found[c.label])]


def _rated(c: ConditionResults, table: pd.DataFrame, settings: ReportSettings) -> Rated:
    runs, verdicts = c.summaries.index, c.verdicts
    effort, reached = first_reached(table, runs, np.inf, c.column("collision_queries"))
    first = table[table["solved"]].groupby("replicate")["collision_queries"].min()
    return Rated(
        c.label,
        c.done,
        int(reached.sum()),
        quantile(first.reindex(runs).fillna(np.inf).to_numpy(np.float64), 0.5),
        expected_effort(effort, reached),
        expected_interval(effort, reached, settings.confidence, settings.num_resamples),
        spread(best_lengths(table, runs)),
        straight_line(table),
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
    conditions: Sequence[ConditionResults],
    found: Mapping[str, pd.DataFrame],
    settings: ReportSettings,
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare the planners of each problem on common seeds."""
    pairs = [
        (a, b)
        for a, b in itertools.combinations(conditions, 2)
        if (a.condition.robot, a.condition.scenario) == (b.condition.robot, b.condition.scenario)
    ]

    def lengths(condition: ConditionResults) -> np.ndarray:
        return best_lengths(found[condition.label], condition.summaries.index)

    rows = compared(pairs, lengths, settings, named=lambda a, b: f"{a.label} – {b.label}")
    return (("best proven length", rows),) if rows else ()
