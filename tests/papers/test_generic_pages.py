"""What the pages of papers do with runs of planners that they are not about."""

import pytest

from evoexp.registry import PAGES, registrations
from evoexp.report.pages.page_builder import page_of
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results
from report_samples import REPORT

ANY = ("corsepius_assumptions",)  # pages that any planner may have
FOREIGN = [
    page.name
    for page in registrations(PAGES)
    if page.module.startswith("evoexp.papers.") and "papers.rana" not in page.module
    if page.name not in ANY
]


@pytest.mark.parametrize("figures", FOREIGN)
def test_other_planners_get_the_generic_page(results: Results, figures: str) -> None:
    page = page_of(results, ReportSettings(**REPORT | {"figures": figures}))  # type: ignore[arg-type]
    assert page.title == results.experiment
    assert page.claims == ()
