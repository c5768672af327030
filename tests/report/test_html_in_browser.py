"""A report's page in a browser: tables sort, figures grow, nothing is cut on a narrow screen."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from test_home_page import RANA, RUN, summary
from test_html_page import ID, page_of

from chromium import CHROMIUM, Browser
from evoexp.report.pages.home_page import home_page
from evoexp.report.pages.html_page import html_page
from evoexp.report.pages.page_parts import Figures, FigureText, RunText, Table
from report_samples import smoke_report

pytestmark = [
    pytest.mark.browser,
    pytest.mark.matrix,
    pytest.mark.skipif(
        CHROMIUM is None, reason="needs chromium on PATH (Debian: apt-get install chromium)"
    ),
]
CELLS = "[...document.querySelectorAll('tbody')[0].rows].map(row => row.cells[1].textContent)"
PICTURE = (
    b'<svg xmlns="http://www.w3.org/2000/svg" height="72pt" width="144pt">'
    b'<rect width="144" height="72" fill="#0072B2"/></svg>'
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.close()


@pytest.fixture
def page(tmp_path: Path) -> Path:
    rows = tuple((f"row {k}", cell) for k, cell in enumerate(("10 [1, 2]", "−3", "–", "9", "∞")))
    text = page_of("plain")._replace(
        sections=(
            Table("Results", ("a", "b"), rows),
            Figures((FigureText("figure", "title", "caption", ("svg",)),)),
        ),
        runs=(RunText("label", ID, 1, 0, False),),
    )
    (tmp_path / "figure.svg").write_bytes(PICTURE)
    (tmp_path / "index.html").write_bytes(html_page(text, {"figure.svg": PICTURE}))
    return tmp_path / "index.html"


def test_tables_sort_by_number(browser: Browser, page: Path) -> None:
    browser.open(page.as_uri(), "true")
    orders = []
    for _ in range(3):
        browser.run("document.querySelectorAll('thead button')[1].click()")
        orders.append(browser.run(CELLS))
    assert orders == [
        ["−3", "9", "10 [1, 2]", "∞", "–"],
        ["∞", "10 [1, 2]", "9", "−3", "–"],
        ["10 [1, 2]", "−3", "–", "9", "∞"],
    ]
    assert browser.complaints == []


def test_a_figure_grows_on_click(browser: Browser, page: Path) -> None:
    browser.look(1280, 900)
    browser.open(page.as_uri(), "true")
    size = "document.querySelector('a.picture img').getBoundingClientRect().width"
    assert browser.run(size) == pytest.approx(192.0)  # 144 points
    browser.run("document.querySelector('a.picture').click()")
    assert browser.run("document.getElementById('zoom').open") is True
    assert browser.run("document.querySelector('#zoom img').src").endswith("figure.svg")
    browser.run("document.querySelector('#zoom button').click()")
    assert browser.run("document.getElementById('zoom').open") is False


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_a_page_never_scrolls_sideways(
    browser: Browser, tmp_path: Path, width: int, scheme: str
) -> None:
    folder = smoke_report(tmp_path, "rana_three_arms")
    browser.look(width, 900, scheme)
    browser.open((folder / "index.html").as_uri(), "true")
    assert browser.run("document.documentElement.scrollWidth") <= width
    picture = browser.screenshot()
    assert picture.startswith(b"\x89PNG") and len(picture) > 10_000
    assert browser.complaints == []
    assert not [url for url in browser.requests if not url.startswith(("data:", "file:"))]


def test_the_search_finds_claims_and_hashes(browser: Browser, tmp_path: Path) -> None:
    found = [summary("rana_planar"), summary("rana_puma")]
    (tmp_path / "index.html").write_bytes(home_page(found, [RANA], [RUN]))
    browser.open((tmp_path / "index.html").as_uri(), "true")
    assert browser.run("document.querySelector('section.search').hidden") is False
    for words, count in (("SHORT puma", 1), ("0123", 2), ("nothing like it", 0), ("", 0)):
        field = "document.getElementById('search')"
        browser.run(f"{field}.value = '{words}', {field}.dispatchEvent(new Event('input'))")
        assert browser.run("document.querySelectorAll('#found li').length") == count
    assert browser.complaints == []
