"""A report's page in a browser: tables sort, figures grow, nothing is cut on a narrow screen."""

from pathlib import Path

import pytest
from test_html_page import PLAIN, RANA, RUN, summary

from chromium import NEEDS_BROWSER, Browser
from chromium import browser as browser
from evoexp.report.pages.html_page import home_page, html_page
from evoexp.report.pages.page_parts import Table
from report_samples import smoke_report

pytestmark = [*NEEDS_BROWSER, pytest.mark.matrix]
CELLS = "[...document.querySelectorAll('tbody')[0].rows].map(row => row.cells[1].textContent)"
PICTURE = (
    b'<svg xmlns="http://www.w3.org/2000/svg" height="72pt" width="144pt">'
    b'<rect width="144" height="72" fill="#0072B2"/></svg>'
)


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Browser:
    """Open a page of one table and one figure."""
    rows = tuple((f"row {k}", cell) for k, cell in enumerate(("10 [1, 2]", "−3", "–", "9", "∞")))
    results = (Table("Results", ("a", "b"), rows),)
    text = PLAIN._replace(results=results, appendix=(), formats=("svg",), players={})
    (tmp_path / "figure.svg").write_bytes(PICTURE)
    (tmp_path / "index.html").write_bytes(html_page(text, {"figure.svg": PICTURE}))
    browser.look(1280, 900)
    browser.open((tmp_path / "index.html").as_uri(), "true")
    return browser


def test_tables_sort_by_number(opened: Browser) -> None:
    orders = []
    for _ in range(3):
        opened.run("document.querySelectorAll('thead button')[1].click()")
        orders.append(opened.run(CELLS))
    assert orders == [
        ["−3", "9", "10 [1, 2]", "∞", "–"],
        ["∞", "10 [1, 2]", "9", "−3", "–"],
        ["10 [1, 2]", "−3", "–", "9", "∞"],
    ]
    assert opened.complaints == []


def test_a_figure_grows_on_click(opened: Browser) -> None:
    size = "document.querySelector('figure a.picture img').getBoundingClientRect().width"
    assert opened.run(size) == pytest.approx(192.0)  # 144 points
    opened.run("document.querySelector('a.picture').click()")
    assert opened.run("document.getElementById('zoom').open") is True
    assert opened.run("document.querySelector('#zoom img').src").endswith("figure.svg")
    opened.run("document.querySelector('#zoom button').click()")
    assert opened.run("document.getElementById('zoom').open") is False


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 390, 1280])
def test_a_page_never_scrolls_sideways(
    browser: Browser, tmp_path: Path, width: int, scheme: str
) -> None:
    folder = smoke_report(tmp_path, "rana_three_arms")
    browser.look(width, 900, scheme)
    browser.open((folder / "index.html").as_uri(), "true")
    assert browser.run("document.documentElement.scrollWidth") <= width
    wide = "[...document.querySelectorAll('.scroll')].some(e => e.scrollWidth > e.clientWidth)"
    assert width < 1280 or not browser.run(wide)
    assert (
        browser.run("document.querySelector('.shown a.picture').getBoundingClientRect().top") < 800
    )
    assert len(browser.screenshot()) > 10_000
    assert browser.complaints == []
    assert not [url for url in browser.requests if not url.startswith(("data:", "file:"))]


def test_the_search_finds_claims_and_hashes(browser: Browser, tmp_path: Path) -> None:
    found = [summary("rana_planar"), summary("rana_puma")]
    (tmp_path / "index.html").write_bytes(home_page(found, [RANA], [RUN]))
    browser.open((tmp_path / "index.html").as_uri(), "true")
    assert browser.run("document.querySelector('section.search').hidden") is False
    field = "document.getElementById('search')"
    for words, count in (("SHORT puma", 1), ("0123", 2), ("nothing like it", 0), ("", 0)):
        browser.run(f"{field}.value = '{words}', {field}.dispatchEvent(new Event('input'))")
        assert browser.run("document.querySelectorAll('#found li').length") == count
    assert browser.complaints == []
