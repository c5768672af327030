"""The page in HTML: the same words as in Markdown, well-formed, offline, and inert."""

import json
from pathlib import Path

import pytest

from evoexp.report.pages import markdown
from evoexp.report.pages.home_page import read_summary
from evoexp.report.pages.html_page import html_page, inline, number_columns, verdict_counts
from evoexp.report.pages.page_parts import (
    Document,
    Figures,
    FigureText,
    LogText,
    Player,
    RunText,
    Table,
    Verdict,
)
from html_reader import Page, markdown_tables
from report_samples import smoke_report

SCRIPT = "<script>alert(1)</script>"
HOSTILE = (
    SCRIPT,
    '"><img src=x onerror=alert(1)>',
    "</title></script><script>alert(1)</script>",
    "[x](javascript:alert(1))",
    "{{ 7 * 7 }} {% if %} `<b>` `",
    "<!-- & &lt; &amp;lt;",
)
ID = "0123456789ab" + "0" * 52

LOGS = (
    LogText(0, f"../../runs/{ID[:12]}/replicates/0000.mcap", "162.8, certified"),
    LogText(1, f"../../runs/{ID[:12]}/replicates/0001.failed.json", "failed"),
)
FIGURE = FigureText("figure", "", "", ("svg", "png"), (Player("GA", "motion_1.html"),))


def page_of(text: str) -> Document:
    """Return a page on which nothing is told but one text."""
    table = Table(text, (text, "n"), ((text, 1), (f"`{text}`", 2)), text)
    claims = Table("Claims", ("claim", "verdict"), ((text, Verdict("reproduced")),))
    failures = Table("Failures", ("condition", "replicate", "reason"), ((text, 0, text),))
    return Document(
        text,
        f"evoexp report {text}",
        text,
        text,
        (("Partial results", text),),
        text,
        (
            table,
            claims,
            Figures((FIGURE._replace(title=text, caption=text),)),
            failures,
        ),
        (RunText(text, ID, 1, 1, False, LOGS),),
    )


def hrefs(page: Page) -> list[str]:
    return [address for address in page.addresses() if not address.startswith("data:")]


@pytest.mark.parametrize("text", HOSTILE)
def test_texts_of_strangers_are_only_text(text: str) -> None:
    page, plain = Page(html_page(page_of(text), {})), Page(html_page(page_of("plain"), {}))
    assert [each.tag for each in page.elements if each.tag not in ("code", "a", "li")] == [
        each.tag for each in plain.elements if each.tag not in ("code", "a", "li")
    ]
    assert {each.split("#")[0] for each in hrefs(page)} == {
        each.split("#")[0] for each in hrefs(plain)
    }
    names = {name for each in page.elements for name in each.attributes}
    assert names == {name for each in plain.elements for name in each.attributes}
    assert page.all("h1")[0].text == text
    assert page.all("title")[0].text == text
    assert page.all("img", alt=text)
    assert page.tables()[0][1][0] == " ".join(text.replace("`<b>`", "<b>").split())


@pytest.mark.parametrize("text", HOSTILE)
def test_the_summary_is_read_back_and_ends_no_script(text: str, tmp_path: Path) -> None:
    (tmp_path / "index.html").write_bytes(html_page(page_of(text), {}))
    found = read_summary(tmp_path)
    assert found is not None
    assert (found.title, found.command, found.partial) == (text, f"report {text}", text)
    assert found.claims == ((text, "reproduced"),)
    assert found.runs == ((ID[:12], text),)
    assert (found.failed, found.picture) == (1, "figure.svg")


@pytest.mark.parametrize(
    "data",
    [
        "null",
        "[]",
        "{}",
        '{"title": 1}',
        json.dumps(
            {
                "title": "t",
                "command": "",
                "partial": "",
                "failed": 0,
                "headings": [],
                "claims": [],
                "runs": [],
                "picture": "../../x.svg",
            }
        ),
    ],
)
def test_a_page_of_nobody_is_no_report(data: str, tmp_path: Path) -> None:
    page = f'<script type="application/json" id="summary">{data}</script>'
    (tmp_path / "index.html").write_text(page)
    assert read_summary(tmp_path) is None


def test_codes_that_name_a_run_of_the_page_link_to_its_commands() -> None:
    known = frozenset([ID[:12]])
    assert inline(f"`{ID[:12]}` `ffffffffffff` {ID[:12]}", known) == (
        f'<a href="#run-{ID[:12]}"><code>{ID[:12]}</code></a> <code>ffffffffffff</code> {ID[:12]}'
    )
    assert inline("a `b") == "a `b"
    assert inline("`a` `b") == "<code>a</code> `b"


def test_heads_that_name_a_condition_link_to_its_run() -> None:
    table = Table("Results", ("quantity", "GA (n\u00a0=\u00a020)", "GA 2"), (("GA", "GA", 1),))
    text = page_of("plain")._replace(sections=(table,))
    page = Page(html_page(text._replace(runs=(RunText("GA", ID, 1, 0, False),)), {}))
    links = [e.text for e in page.all("a") if e.attributes["href"] == f"#run-{ID[:12]}"]
    assert links == ["GA (n\u00a0=\u00a020)", "GA"]


def test_every_log_of_a_run_is_linked() -> None:
    page = Page(html_page(page_of("plain"), {}))
    found = {e.attributes["href"]: e.text for e in page.all("a")}
    assert {file: str(k) for k, file, _ in LOGS}.items() <= found.items()
    (logs,) = page.all("ol", class_="logs")
    assert logs.text == "0 162.8, certified1 failed"


def test_a_motion_is_played_inside_the_figure_that_shows_it() -> None:
    page = Page(html_page(page_of("plain"), {}))
    (frame,) = page.all("iframe")
    figure, after = page.all("figure")[0], page.all("section", id="failures")[0]
    order = [page.elements.index(each) for each in (figure, frame, after)]
    assert order == sorted(order) and frame.attributes["src"] == "motion_1.html"


@pytest.mark.parametrize(
    ("cells", "numeric"),
    [
        (["1", "−2.5", "∞", "–"], True),
        (["162.8 [160.7, 168.1]", "20 of 20 (84–100 %)", "1e−09"], True),
        (["1", "rana"], False),
        (["4da921ed6875"], False),
        (["3D"], False),
        (["–", "–"], False),
        (["20 of 20 runs never below 1 unit; least 1.001, median 1.015"], False),
    ],
)
def test_columns_of_numbers_are_told_apart(cells: list[str], numeric: bool) -> None:
    assert number_columns(["name"], [(cell,) for cell in cells])[0] is numeric


def test_verdicts_are_counted_in_one_order() -> None:
    verdicts = ["not judged (budget smoke)", "contradicted", "reproduced", "not judged (no data)"]
    counts = (("reproduced", 1), ("contradicted", 1), ("not judged", 2))
    assert verdict_counts(verdicts) == counts


def test_failures_stand_at_the_top() -> None:
    failures = tuple(("GA", k, f"ValueError: {k}") for k in range(5))
    text = page_of("plain")._replace(sections=(Table("Failures", ("a", "b", "c"), failures),))
    page = Page(html_page(text, {}))
    (notice,) = page.all("div", class_="notice failed")
    assert "5 replicates failed." in notice.text
    assert "GA, replicate 2: ValueError: 2" in notice.text
    assert "ValueError: 3" not in notice.text
    assert page.elements.index(notice) < page.elements.index(page.all("h2")[0])
    assert [e.attributes["href"] for e in page.all("a") if e.text == "All failures"] == [
        "#failures"
    ]


def test_commands_of_a_run_can_be_copied() -> None:
    page = Page(html_page(page_of("plain"), {}))
    assert [each.text for each in page.all("code", class_="copy")] == [
        f"evoexp {command} {ID[:12]}" for command in ("show", "reproduce", "view")
    ]
    alone = page_of("plain")._replace(runs=(RunText("none", ID, 0, 0, False),))
    assert len(Page(html_page(alone, {})).all("code", class_="copy")) == 1


@pytest.mark.parametrize("name", ["rana_planar", "rana_three_arms"])
def test_a_report_in_html_says_what_it_says_in_markdown(
    name: str, tmp_path_factory: pytest.TempPathFactory, blank_figures: None
) -> None:
    folder = smoke_report(tmp_path_factory.mktemp("outputs"), name)
    content, text = (folder / "index.html").read_bytes(), (folder / "index.md").read_text()
    page = Page(content)
    page.check(folder)
    assert page.tables() == markdown_tables(text)
    headings = [line.lstrip("# ") for line in text.splitlines() if line.startswith("#")]
    shown = [e.text for e in page.elements if e.tag in ("h1", "h2", "h3")]
    assert [markdown.inert(each) for each in shown] == [*headings, "Runs, logs, commands"]
    assert b"http" not in content
    assert len(content) < 5_000_000
    files = {path.name for path in folder.iterdir()} - {"index.html"}
    assert files <= set(page.addresses())
    known = [e.attributes["id"] for e in page.all("tr") if "id" in e.attributes]
    assert known
    assert {f"#{each}" for each in known} <= set(page.addresses())
