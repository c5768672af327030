"""All conditions of an experiment against each other: quantities, and shares of runs."""

import itertools
from collections.abc import Callable

import numpy as np

from evoexp.report.figures import matrix
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Drawing, Table
from evoexp.report.pages.page_words import WORDS
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.run_measures import search_seconds, success
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Comparison, Measure, by_column, compared
from evoexp.report.statistics.comparisons import adjusted as adjusted_rows
from evoexp.report.statistics.inference import Proportion, fisher_exact, holm, newcombe

MOST = 6  # conditions of which every pair is tabled; of more, the first against each other one

Pair = tuple[ConditionResults, ConditionResults]


EFFORTS = (  # quantities that every planner records; lower is better
    Measure("best cost", by_column("best_cost")),
    Measure("evaluations", by_column("evaluations")),
    Measure("collision queries", by_column("collision_queries")),
    Measure("CPU time, search [s]", search_seconds),
)
SHARES: dict[str, Callable[[ConditionResults], Proportion]] = {
    "solved": success,
    # of the motions that the exact verdict judged
    "certified": lambda c: Proportion(c.verdicts.certified, c.verdicts.judged),
    "required margin kept": lambda c: Proportion(c.verdicts.with_margin, c.verdicts.judged),
}


def differing(results: Results) -> list[Measure]:
    """Return the quantities that are not the same in every run."""
    return [
        one
        for one in EFFORTS
        if len(np.unique(np.concatenate([one.values(c) for c in results.evolved]))) > 1
    ]


def pairs(results: Results) -> list[Pair]:
    """Return the pairs that tables hold; references have no seeds and stand aside."""
    first, *others = results.evolved
    if len(others) < MOST:
        return list(itertools.combinations(results.evolved, 2))
    return [(first, other) for other in others]


def comparisons(
    results: Results, settings: ReportSettings
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare conditions in every quantity in which they differ.

    Returns:
        (heading, one comparison per pair), p-values adjusted within each quantity.
    """
    of = "pairs of conditions"
    if len(results.evolved) > MOST:
        of = f"{results.evolved[0].label} against each other condition"
    found = (
        (f"{one.name}: {of}", compared(pairs(results), one.values, settings, named=_named))
        for one in differing(results)
    )
    return tuple((heading, rows) for heading, rows in found if rows)


def share_tables(results: Results, settings: ReportSettings) -> tuple[Table, ...]:
    """Return shares of runs with intervals, and how far they differ from each other."""
    level = 100 * settings.confidence
    rows = [
        (c.label, *(of(c).with_interval(settings.confidence, 0) for of in SHARES.values()))
        for c in results.with_data
    ]
    between = [
        row for name, of in SHARES.items() for row in _differences(results, settings, name, of)
    ]
    found = (
        WORDS.table("shares", rows, level=level),
        WORDS.table("share_differences", between, level=level),
    )
    return found if between else found[:1]


def _differences(
    results: Results,
    settings: ReportSettings,
    name: str,
    of: Callable[[ConditionResults], Proportion],
) -> list[tuple[object, ...]]:
    """Return one row per pair; none where the share is the same in all conditions."""
    found = [(a, b, of(a), of(b)) for a, b in pairs(results) if of(a).total and of(b).total]
    if len({p.share for _, _, *both in found for p in both}) < 2:
        return []
    p_values = [fisher_exact(one, two) for _, _, one, two in found]
    rows: list[tuple[object, ...]] = []
    for (a, b, one, two), p, adjusted in zip(found, p_values, holm(p_values), strict=True):
        between = (one.share - two.share, *newcombe(one, two, settings.confidence))
        difference, low, high = (f"{100 * x + 0.0:.0f}" for x in between)
        points = f"{difference} [{low}, {high}]".replace("-", "−")
        tests = markdown.p_value(p), markdown.p_value(adjusted)
        rows.append((name, _named(a, b), points, *tests))
    return rows


def matrix_drawing(results: Results, settings: ReportSettings) -> tuple[Drawing, ...]:
    """Return the matrix of effect sizes in the best cost, of three conditions or more."""
    best = EFFORTS[0]
    if len(results.evolved) < 3 or best not in differing(results):
        return ()
    every = [
        (pair, rows)
        for pair in itertools.combinations(results.evolved, 2)
        if (rows := compared([pair], best.values, settings))
    ]
    tested = adjusted_rows([row for _, rows in every for row in rows])
    labels = [(a.label, b.label) for (a, b), _ in every]
    given = results.evolved, labels, tested, settings.significance
    return (WORDS.drawing("matrix", matrix.MATRIX, *given),)


def _named(first: ConditionResults, second: ConditionResults) -> str:
    return f"{first.label} against {second.label}"
