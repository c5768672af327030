"""All conditions of an experiment against each other: quantities, and shares of runs."""

import itertools
from collections.abc import Callable

import numpy as np

from evoexp.report.pages import markdown
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.run_measures import search_seconds, success
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Comparison, Measure, Values, by_column, compared
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


def differing_values(differing: list[Measure]) -> dict[str, Values]:
    """Return the values of these quantities by name."""
    return {one.name: one.values for one in differing}


def pairs(results: Results) -> list[Pair]:
    """Return the pairs that tables hold; references have no seeds and stand aside."""
    first, *others = results.evolved
    if len(others) < MOST:
        return list(itertools.combinations(results.evolved, 2))
    return [(first, other) for other in others]


def pairs_of_conditions(
    results: Results, settings: ReportSettings, differing: list[Measure]
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare pairs in every quantity in which they differ; p-values are adjusted within each."""
    of = "pairs of conditions"
    if len(results.evolved) > MOST:
        of = f"{results.evolved[0].label} against each other condition"
    found = (
        (f"{one.name}: {of}", compared(pairs(results), one.values, settings, named=_named))
        for one in differing
    )
    return tuple((heading, rows) for heading, rows in found if rows)


def share_rows_of_all(results: Results, confidence: float) -> list[tuple[str, ...]]:
    """Return shares of runs with intervals, a row per condition."""
    return [
        (c.label, *(of(c).with_interval(confidence) for of in SHARES.values()))
        for c in results.with_data
    ]


def difference_rows(results: Results, confidence: float) -> list[tuple[str, ...]]:
    """Return how far shares differ from each other; no row of one that is the same everywhere."""
    rows: list[tuple[str, ...]] = []
    for name, of in SHARES.items():
        found = [(a, b, of(a), of(b)) for a, b in pairs(results) if of(a).total and of(b).total]
        if len({p.share for _, _, *both in found for p in both}) < 2:
            continue
        p_values = [fisher_exact(one, two) for _, _, one, two in found]
        for (a, b, one, two), p, adjusted in zip(found, p_values, holm(p_values), strict=True):
            between = (one.share - two.share, *newcombe(one, two, confidence))
            difference, low, high = (f"{100 * x + 0.0:.0f}" for x in between)
            points = f"{difference} [{low}, {high}]".replace("-", "−")
            tests = markdown.p_value(p), markdown.p_value(adjusted)
            rows.append((name, _named(a, b), points, *tests))
    return rows


def compared_pairs(
    results: Results, settings: ReportSettings, differing: list[Measure]
) -> list[tuple[tuple[str, str], Comparison]]:
    """Return (labels, comparison of best costs) of all pairs of three conditions or more."""
    best = EFFORTS[0]
    if len(results.evolved) < 3 or best not in differing:
        return []
    every = [
        ((a.label, b.label), row)
        for a, b in itertools.combinations(results.evolved, 2)
        for row in compared([(a, b)], best.values, settings)
    ]
    tested = adjusted_rows([row for _, row in every])
    return [(labels, row) for (labels, _), row in zip(every, tested, strict=True)]


def _named(first: ConditionResults, second: ConditionResults) -> str:
    return f"{first.label} against {second.label}"
