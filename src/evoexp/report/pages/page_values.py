"""Values that every page may name: the parts of its results and settings, its comparisons."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from evoexp.report.pages.page_parts import PlayedRun, Quantity, quantity
from evoexp.report.results.run_measures import search_seconds
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.comparisons import (
    Comparison,
    Family,
    FamilyComparison,
    by_column,
    rows_by_name,
)
from evoexp.store.log import TERM

FEW = 4  # conditions whose average costs can be drawn beside the best ones


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # evaluations of each run per second of its search, (done,) [1/s]
    "evaluations_per_second": lambda condition: (
        condition.column("evaluations") / search_seconds(condition)
    ),
    # the quantities of a figure, without those that no run has
    "known": lambda of, results: {
        name: values
        for name, values in of.items()
        if any(not np.isnan(values(c)).all() for c in results.with_data)
    },
    # (quantity, position, condition, how many) of the shares of a figure
    "counts_of": lambda of, results: [
        (name, results.position(c.label), c.label, count(c))
        for name, count in of.items()
        for c in results.with_data
    ],
    "experiment": lambda results: results.experiment or "stored runs",  # as titles have it
    "conditions": lambda results: results.with_data,
    "main": lambda results: results.main,  # without controls and references
    "first": lambda results: results.with_data[0],
    "unit": lambda first: first.length_unit,  # of the first condition's scene
    "scenes_differ": lambda results: len({(c.robot, c.scenario) for c in results.with_data}) > 1,
    # some values of a figure are infinite
    "censored": lambda quantities, results: any(
        np.isposinf(of(c)).any() for of in quantities.values() for c in results.with_data
    ),
    "several": lambda results: len(results.with_data) > 1,  # there is something to compare
    "are_few": lambda results: len(results.evolved) <= FEW,
    "whole": lambda conditions: (Family.of(conditions),),  # the first one against all others
    "played": lambda condition: (PlayedRun(condition, condition.best_replicate),),
    "judge": lambda results, settings, rules: judging.judge(results, settings, rules),
    "confidence": lambda settings: settings.confidence,  # of every interval, in (0, 1)
    "level": lambda settings: 100 * settings.confidence,  # of every interval [%]
    "significance": lambda settings: settings.significance,
    "samples": lambda settings: settings.samples_per_segment,
}


def terms(results: Results) -> Iterator[Quantity]:
    """Yield the rows of the planner's own terms, those of the best solutions."""
    columns = {str(name) for c in results.with_data for name in c.summaries}
    for column in sorted(name for name in columns if name.startswith(TERM)):
        term = column.removeprefix(TERM)
        name, unit = term.replace("_", " "), "–"
        if term.endswith(("_deg", "_rad")):
            name, _, unit = name.rpartition(" ")
        elif "distance" in term or "clearance" in term:
            unit = results.with_data[0].length_unit or "–"
        yield quantity(results, name, unit, by_column(column))


def effect_rows(
    compared: tuple[FamilyComparison, ...], names: Mapping[str, str]
) -> dict[str, tuple[Comparison, ...]]:
    """Return the comparisons of families by quantity: of all, or of those that have a name."""
    rows = rows_by_name(compared)
    return {shown: rows[name] for name, shown in names.items() if name in rows} if names else rows
