"""Values that every page may name: the parts of its results and settings, its comparisons."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from evoexp.report.pages.page_parts import PlayedRun, Quantity
from evoexp.report.pages.page_words import quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.claim_rules import Rules
from evoexp.report.statistics.comparisons import (
    Comparison,
    Family,
    FamilyComparison,
    Values,
    by_column,
    rows_by_name,
)
from evoexp.report.statistics.inference import Proportion
from evoexp.report.statistics.judging import Judge
from evoexp.store.messages import TERM


def experiment(results: Results) -> str:
    """Return the name of the experiment, as titles have it."""
    return results.experiment or "stored runs"


def conditions(results: Results) -> tuple[ConditionResults, ...]:
    """Return the conditions with data."""
    return results.with_data


def main(results: Results) -> tuple[ConditionResults, ...]:
    """Return the conditions with data without controls and references."""
    return results.main


def first(results: Results) -> ConditionResults:
    """Return the first condition with data."""
    return results.with_data[0]


def unit(first: ConditionResults) -> str:
    """Return the unit of length of the first condition's scene."""
    return first.length_unit


def confidence(settings: ReportSettings) -> float:
    """Return the level of every interval, in (0, 1)."""
    return settings.confidence


def level(settings: ReportSettings) -> float:
    """Return the level of every interval [%]."""
    return 100 * settings.confidence


def judge(results: Results, settings: ReportSettings, rules: Rules) -> Judge:
    """Return the judge of the paper's claims."""
    return judging.judge(results, settings, rules)


def several(results: Results) -> bool:
    """Return whether there is something to compare: two conditions with data or more."""
    return len(results.with_data) > 1


def significance(settings: ReportSettings) -> float:
    """Return the adjusted p-value below which a difference counts."""
    return settings.significance


def samples(settings: ReportSettings) -> int:
    """Return the configurations per segment of a path at which figures measure distances."""
    return settings.samples_per_segment


def whole(conditions: tuple[ConditionResults, ...]) -> tuple[Family, ...]:
    """Return the first condition against all others."""
    return (Family.of(conditions),)


def played(condition: ConditionResults) -> tuple[PlayedRun, ...]:
    """Return the best replicate, whose motion a figure shows."""
    return (PlayedRun(condition, condition.best_replicate),)


def terms(results: Results) -> Iterator[Quantity]:
    """Yield the rows of the planner's own terms, those of the best solutions."""
    for term in results.terms:
        name, unit = term.replace("_", " "), "–"
        if term.endswith(("_deg", "_rad")):
            name, _, unit = name.rpartition(" ")
        elif "distance" in term or "clearance" in term:
            unit = results.with_data[0].length_unit or "–"
        yield quantity(results, name, unit, by_column(TERM + term))


def known(of: Mapping[str, Values], results: Results) -> dict[str, Values]:
    """Return the quantities of a figure, without those that no run has."""
    values = of.items()
    return {k: v for k, v in values if any(not np.isnan(v(c)).all() for c in results.with_data)}


def censored(quantities: Mapping[str, Values], results: Results) -> str:
    """Explain infinite values of a figure; empty if there are none."""
    every = (of(c) for of in quantities.values() for c in results.with_data)
    if not any(np.isposinf(values).any() for values in every):
        return ""
    return (
        ' A run that never gets there counts as infinite ("never"), so that boxes are of all runs; '
        "beside: runs that get there, of all."
    )


def effect_rows(
    compared: tuple[FamilyComparison, ...], names: Mapping[str, str]
) -> dict[str, tuple[Comparison, ...]]:
    """Return the comparisons of families by quantity: of all, or of those that have a name."""
    rows = rows_by_name(compared)
    return {shown: rows[name] for name, shown in names.items() if name in rows} if names else rows


def counts_of(
    of: Mapping[str, Callable[[ConditionResults], Proportion]], results: Results
) -> list[tuple[str, int, str, Proportion]]:
    """Return (quantity, position, condition, how many) of the shares of a figure."""
    return [
        (name, results.position(c.label), c.label, count(c))
        for name, count in of.items()
        for c in results.with_data
    ]
