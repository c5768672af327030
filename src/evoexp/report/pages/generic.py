"""The page of any experiment: results, convergence, all conditions compared with each other."""

from evoexp.report.pages.page_builder import own_page
from evoexp.report.pages.page_parts import Page
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of any experiment, whatever its planners are."""
    return own_page("generic", results, settings)
