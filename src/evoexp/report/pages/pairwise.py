"""All conditions of an experiment against each other: quantities, and shares of runs."""

import itertools
from collections.abc import Callable

import numpy as np

from evoexp.report.pages import markdown
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.run_measures import search_seconds, success
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Comparison, Pair, Values, by_column, compared
from evoexp.report.statistics.inference import Proportion, fisher_exact, holm, newcombe

MOST = 6  # conditions of which every pair is tabled; of more, the first against each other one


EFFORTS: dict[str, Values] = {  # quantities that every planner records; lower is better
    "best cost": by_column("best_cost"),
    "evaluations": by_column("evaluations"),
    "collision queries": by_column("collision_queries"),
    "CPU time, search [s]": search_seconds,
}
SHARES: dict[str, Callable[[ConditionResults], Proportion]] = {
    "solved": success,
    # of the motions that the exact verdict judged
    "certified": lambda c: Proportion(c.verdicts.certified, c.verdicts.judged),
    "required margin kept": lambda c: Proportion(c.verdicts.with_margin, c.verdicts.judged),
}


def differing(results: Results) -> dict[str, Values]:
    """Return the quantities that are not the same in every run, by name."""
    return {
        name: values
        for name, values in EFFORTS.items()
        if len(np.unique(np.concatenate([values(c) for c in results.evolved]))) > 1
    }


def pairs(results: Results) -> list[Pair]:
    """Return the pairs that tables hold; references have no seeds and stand aside."""
    first, *others = results.evolved
    if len(others) < MOST:
        return list(itertools.combinations(results.evolved, 2))
    return [(first, other) for other in others]


def pairs_of_conditions(
    results: Results, settings: ReportSettings, differing: dict[str, Values]
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare pairs in every quantity in which they differ; p-values are adjusted within each."""
    of = "pairs of conditions"
    if len(results.evolved) > MOST:
        of = f"{results.evolved[0].label} against each other condition"
    found = (
        (f"{name}: {of}", compared(pairs(results), values, settings, named=_named))
        for name, values in differing.items()
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


def _named(first: ConditionResults, second: ConditionResults) -> str:
    return f"{first.label} against {second.label}"
