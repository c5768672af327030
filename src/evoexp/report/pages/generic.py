"""The page of any experiment: results, convergence, all conditions compared with each other."""

from collections.abc import Mapping

from evoexp.report.pages.page_parts import Page
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.comparisons import Measure, Values

FEW = 4  # conditions whose average costs can be drawn beside the best ones


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of any experiment, whatever its planners are."""
    from evoexp.report.pages import page_builder  # which names the functions of this file

    return page_builder.own_page("generic", results, settings)


def scenes(results: Results) -> str:
    """Warn where conditions differ in robot or scenario; empty if they do not."""
    if len({(c.robot, c.scenario) for c in results.with_data}) < 2:
        return ""
    return (
        "The conditions differ in robot or scenario: their costs are compared as numbers, whatever "
        "they measure."
    )


def are_few(results: Results) -> bool:
    """Return whether average costs are drawn."""
    return len(results.evolved) <= FEW


def differing_values(differing: list[Measure]) -> Mapping[str, Values]:
    """Return the values of the quantities that are not the same in every run, by name."""
    return {one.name: one.values for one in differing}
