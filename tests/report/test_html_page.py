"""Pages in HTML, reports' and home: well-formed, offline, and inert, whatever strangers write."""

import json
from pathlib import Path

import pandas as pd
import pytest
from matplotlib.figure import Figure

from evoexp.report.pages import html_page, markdown
from evoexp.report.pages.page_parts import Document, Drawing, PlayedRun, Player, Table, Verdict
from html_reader import Page, markdown_tables
from report_samples import shown_run, smoke_report

HOSTILE = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "</title></script><script>alert(1)</script>",
    "[x](javascript:alert(1))",
    "{{ 7 * 7 }} {% if %} `<b>` `",
    "<!-- & &lt; &amp;lt;",
)
HASH = "0123456789ab"
LOGS = (
    (0, f"../../runs/{HASH}/replicates/0000.mcap", "162.8, certified"),
    (1, f"../../runs/{HASH}/replicates/0001.failed.json", "failed"),
)
PLAYER = Player("GA", "motion_1.html")


def page_of(text: str) -> Document:
    """Return a page on which nothing is told but one text."""
    run = shown_run(text, HASH, (162.8,), ("failed",))
    plays = (PlayedRun(run, 0),)
    return Document(
        *(text, f"evoexp report {text}", text, text, (("Partial results", text),), text),
        (
            Table(text, (text, "n"), ((text, 1), (f"`{text}`", 2)), text),
            Table("Claims", ("claim", "verdict"), ((text, Verdict("reproduced")),)),
        ),
        (Drawing("figure", text, text, pd.DataFrame, Figure, (run,), plays),),
        (Table("Failures", ("condition", "replicate", "reason"), ((text, 0, text),)),),
        (run,),
        formats=("svg", "png"),
        players={plays[0].key: PLAYER},
    )


PLAIN = page_of("plain")


def read(document: Document = PLAIN) -> Page:
    return Page(html_page.html_page(document, {}))


def skeleton(page: Page) -> tuple[list[str], set[str], set[str]]:
    """Return all that no text may change: tags, names of attributes, and addresses."""
    tags = [each.tag for each in page.elements if each.tag not in ("code", "a", "li")]
    addresses = {each.split("#")[0] for each in page.addresses() if not each.startswith("data:")}
    return tags, {name for each in page.elements for name in each.attributes}, addresses


@pytest.mark.parametrize("text", HOSTILE)
def test_texts_of_strangers_are_only_text_and_read_back(text: str, tmp_path: Path) -> None:
    content = html_page.html_page(page_of(text), {})
    page = Page(content)
    assert skeleton(page) == skeleton(read())
    assert page.all("h1")[0].text == page.all("title")[0].text == text
    assert page.all("img", alt=text)
    assert page.tables()[0][1][0] == " ".join(text.replace("`<b>`", "<b>").split())
    (tmp_path / "index.html").write_bytes(content)
    found = html_page.read_summary(tmp_path)
    assert (found.title, found.command, found.partial) == (text, f"report {text}", text)
    assert (found.claims, found.questions) == (((text, "reproduced"),), ())
    assert found.runs == ((HASH, text),)
    assert (found.failed, found.picture) == (1, "figure.svg")


FIELDS = '{"title": "t", "command": "", "partial": "", "failed": 0, "headings": [], "claims": []'


@pytest.mark.parametrize(
    "data",
    ["null", "[]", "{}", '{"title": 1}', FIELDS + ', "runs": [], "picture": "../../x.svg"}'],
)
def test_a_page_of_nobody_is_no_report(data: str, tmp_path: Path) -> None:
    page = f'<script type="application/json" id="summary">{data}</script>'
    (tmp_path / "index.html").write_text(page)
    assert html_page.read_summary(tmp_path) is None


def test_codes_that_name_a_run_of_the_page_link_to_its_commands() -> None:
    found = html_page.inline(f"`{HASH}` `ffffffffffff` {HASH}", frozenset([HASH]))
    link = f'<a href="#run-{HASH}"><code>{HASH}</code></a>'
    assert found == f"{link} <code>ffffffffffff</code> {HASH}"
    assert html_page.inline("a `b") == "a `b"
    assert html_page.inline("`a` `b") == "<code>a</code> `b"


def test_heads_that_name_a_condition_link_to_its_run() -> None:
    table = Table("Results", ("quantity", "GA (n\u00a0=\u00a020)", "GA 2"), (("GA", "GA", 1),))
    page = read(PLAIN._replace(results=(table,), figures=(), runs=(shown_run("GA", HASH, (1.0,)),)))
    links = [e.text for e in page.all("a") if e.attributes["href"] == f"#run-{HASH}"]
    assert links == ["GA (n\u00a0=\u00a020)", "GA"]


def test_a_motion_is_played_inside_the_figure_that_shows_it() -> None:
    page = read()
    first, frame = page.all("iframe")
    figure, after = page.all("figure")[0], page.all("section", id="failures")[0]
    order = [page.elements.index(each) for each in (first, figure, frame, after)]
    assert order == sorted(order) and frame.attributes["src"] == "motion_1.html"
    assert first.attributes["src"] == "motion_1.html#again"  # plays in the first screen


def test_a_page_begins_with_its_answers() -> None:
    """A sentence, a word and a number per claim; its evidence, and what is long, unfolds."""
    verdicts = [
        Verdict("reproduced", "A12 0.8"),
        Verdict("depends on the reading (reproduced under 11 of 12)", "A12 0.7"),
        *[Verdict("undecided", "n = 20", is_ours=True)] * 4,
    ]
    rows = tuple((f"claim {k}", verdict, f"so {k}") for k, verdict in enumerate(verdicts))
    tables = (
        Table("Wide", tuple("abcdefg"), (tuple(range(7)),)),
        Table("Claims", tuple("abc"), rows),
    )
    page = read(PLAIN._replace(results=tables, introduction="It is. Eq. 3 i.e. so. More of it."))
    assert [each.text for each in page.all("p", class_="introduction")] == ["It is. Eq. 3 i.e. so."]
    deciding = [each.text for each in page.all("span", class_="deciding")]
    assert deciding == ["A12 0.8", "reproduced under 11 of 12", *["n = 20"] * 4]
    (counts,) = page.all("p", class_="counts")
    assert " ".join(counts.text.split()).endswith("Our questions: 4 undecided")
    assert [each.text.split("\n")[0] for each in page.all("details", class_="more")] == [
        "moreMore of it.",
        "1 more",
    ]
    (picture, *_) = page.all("a", class_="picture")
    places = [page.all("ul", class_="claims")[0], picture, page.all("table", class_="sortable")[0]]
    order = [page.elements.index(each) for each in places]
    assert order == sorted(order)
    assert [each.text for each in page.all("details", class_="columns")] == ["all 7 columns"]


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
    assert html_page.number_columns(["name"], [(cell,) for cell in cells])[0] is numeric


def test_verdicts_are_counted_in_one_order() -> None:
    verdicts = ["not judged (budget smoke)", "contradicted", "reproduced", "not judged (no data)"]
    counts = (("reproduced", 1), ("contradicted", 1), ("not judged", 2))
    assert html_page.verdict_counts(verdicts) == counts


def test_failures_stand_at_the_top() -> None:
    failures = tuple(("GA", k, f"ValueError: {k}") for k in range(5))
    page = read(PLAIN._replace(appendix=(Table("Failures", ("a", "b", "c"), failures),)))
    (notice,) = page.all("div", class_="notice failed")
    assert "5 replicates failed." in notice.text
    assert "GA, replicate 2: ValueError: 2" in notice.text and "ValueError: 3" not in notice.text
    assert page.elements.index(notice) < page.elements.index(page.all("h2")[0])
    (link,) = (e for e in page.all("a") if e.text == "All failures")
    assert link.attributes["href"] == "#failures"


def test_logs_of_a_run_are_linked_and_its_commands_can_be_copied() -> None:
    page, commands = read(), ("show", "reproduce", "view")
    found = {e.attributes["href"]: e.text for e in page.all("a")}
    assert {file: str(k) for k, file, _ in LOGS}.items() <= found.items()
    (logs,) = page.all("ol", class_="logs")
    assert logs.text == "0 162.8, certified1 failed"
    copied = [each.text for each in page.all("code", class_="copy")]
    assert copied == [f"evoexp {command} {HASH}" for command in commands]
    alone = read(PLAIN._replace(runs=(shown_run("none", HASH, ()),)))
    assert len(alone.all("code", class_="copy")) == 1


@pytest.mark.parametrize("name", ["rana_planar", "rana_three_arms"])
def test_a_report_in_html_says_what_it_says_in_markdown(
    name: str, tmp_path_factory: pytest.TempPathFactory, blank_figures: None
) -> None:
    folder = smoke_report(tmp_path_factory.mktemp("outputs"), name)
    content, text = (folder / "index.html").read_bytes(), (folder / "index.md").read_text()
    page = Page(content)
    page.check(folder)
    claims, *tables = markdown_tables(text)
    assert page.tables() == tables
    shown_claims = page.all("ul", class_="claims")
    sentences = [each.text for each in page.all("span", class_="sentence")]
    assert sentences == [row[0] for row in claims[1:]]
    evidence = " ".join(" ".join(each.text for each in shown_claims).split())
    assert all(cell in evidence for row in claims[1:] for cell in row)
    headings = [line.lstrip("# ") for line in text.splitlines() if line.startswith("#")]
    shown = [e.text for e in page.elements if e.tag in ("h1", "h2", "h3")]
    assert [markdown.inert(each) for each in shown] == [*headings, "Runs, logs, commands"]
    assert b"http" not in content and len(content) < 5_000_000
    files = {path.name for path in folder.iterdir()} - {"index.html"}
    known = {f"#{e.attributes['id']}" for e in page.all("tr") if "id" in e.attributes}
    assert known and files | known <= set(page.addresses())


RANA = html_page.Paper(
    "rana", "Rana 1995", "arms", ("rana_planar", "rana_puma", "lavoie"), {"rana_puma": 3}
)
CLAIMS = (("free", "reproduced"), ("short", "contradicted"), ("fast", "not judged (no runs)"))
RUN = html_page.StoredRun(HASH, "rana_planar", "GA", "paper", 3, 20, 0)


def summary(folder: str, command: str = "", picture: str = "") -> html_page.ReportSummary:
    headings = (("Claims", "claims"), ("GA against others", "ga-against-others"))
    words, runs = command or f"report {folder}", ((HASH, "GA"),)
    about, ours = f"about {folder}", (("ours", "undecided"),)
    return html_page.ReportSummary(
        folder, about, words, "", 0, headings, CLAIMS, ours, runs, picture
    )


def test_a_card_counts_the_claims_of_whole_experiments() -> None:
    pictures = {"rana_planar": "fig_5.svg", "rana_planar+12345678": "scene.svg"}
    found = [summary(folder, picture=picture) for folder, picture in pictures.items()]
    found.append(summary("rana_three@smoke"))
    (card,) = html_page.site(found, [RANA], [])["papers"]
    counts = (("reproduced", 1), ("contradicted", 1), ("not judged", 1))
    ours = (("undecided", 1),)
    assert card["tallies"] == (("The paper's sentences", counts), ("Our questions", ours))
    assert (card["unjudged"], card["missing"]) == (3, ["rana_puma"])
    assert card["face"].picture_url == "rana_planar/fig_5.svg"
    assert card["reports"] == found
    assert found[1].url() == "rana_planar%2B12345678/index.html?home"


def test_a_claim_counts_once_that_of_the_readings_first() -> None:
    scene = summary("rana_planar")._replace(rules=(("free", "rule"),))
    told = (("planar: free", "depends on the reading (…)"),)
    readings = summary("rana_claims")._replace(claims=told, rules=(("planar: free", "rule"),))
    paper = RANA._replace(claims={"rana_planar": 3, "rana_claims": 1})
    (card,) = html_page.site([scene, readings], [paper], [])["papers"]
    counts = (("depends on the reading", 1), ("contradicted", 1), ("not judged", 1))
    assert [own for _, own in card["tallies"]] == [counts, (("undecided", 1),)]


def test_reports_of_no_paper_stand_by_themselves() -> None:
    compared = summary("compare_rana_planar", "compare rana_planar")
    others = html_page.site([summary("arena_rana"), compared, summary("ranaplanar")], [RANA], [])[
        "others"
    ]
    assert [(name, [each.folder for each in own], not_run) for name, own, not_run in others] == [
        ("Arenas and other experiments", ["arena_rana", "ranaplanar"], ["lavoie"]),
        ("Comparisons", ["compare_rana_planar"], []),
    ]


def test_an_experiment_that_was_not_run_says_its_command() -> None:
    page = Page(html_page.home_page([summary("rana_planar")], [RANA], []))
    commands = [each.text for each in page.all("code", class_="copy")]
    assert commands == [f"evoexp run experiment={name}" for name in ("rana_puma", "lavoie")]


@pytest.mark.parametrize(
    ("done", "planned", "failed", "damage", "state"),
    [
        (20, 20, 0, "", "done"),
        (3, 20, 0, "", "partial"),
        (0, 20, 0, "", "planned"),
        (3, 20, 1, "", "failed"),
        (0, 0, 0, "config.json: damaged", "damaged"),
    ],
)
def test_a_run_has_a_state(done: int, planned: int, failed: int, damage: str, state: str) -> None:
    run = RUN._replace(done=done, planned=planned, failed=failed, damage=damage)
    page = Page(html_page.home_page([summary("rana_planar")], [RANA], [run]))
    cells = dict(zip(*page.tables()[0], strict=True))
    counts = "" if damage else f": {done} of {planned}" + f", {failed} failed" * bool(failed)
    assert (cells["hash"], cells["replicates"]) == (HASH, state + counts)
    assert cells["reports"] == "rana_planar"
    assert f"rana_planar/index.html?home#run-{HASH}" in page.addresses()
    assert ("not finished" in page.all("main")[0].text) == (state != "done")


def test_partial_reports_are_named_at_the_top() -> None:
    partial = summary("rana_planar")._replace(partial="GA: 3 of 20 replicates done, 0 failed")
    page = Page(html_page.home_page([partial, summary("rana_puma")], [RANA], []))
    (notice,) = page.all("div", class_="notice")
    assert "1 of 2 reports were drawn before all planned replicates were there" in notice.text
    assert "rana_planar" in notice.text and "rana_puma" not in notice.text
    assert page.elements.index(notice) < page.elements.index(page.all("h2")[0])


def test_the_search_knows_titles_headings_claims_and_hashes() -> None:
    content = html_page.home_page([summary("rana_planar")], [RANA], [RUN])
    entries = json.loads(Page(content).all("script", id="search-index")[0].text)
    assert [(each["kind"], each["text"]) for each in entries] == [
        ("report", "about rana_planar"),
        ("heading", "GA against others"),
        *((f"claim, {verdict}", text) for text, verdict in (*CLAIMS, ("ours", "undecided"))),
        ("run", f"{HASH} GA"),
    ]
    assert entries[1]["url"] == "rana_planar/index.html?home#ga-against-others"


@pytest.mark.parametrize("text", HOSTILE)
def test_texts_of_strangers_are_only_text_at_home(text: str) -> None:
    pairs, runs = ((text, text),), ((HASH, text),)
    folder = text.replace("/", "")
    hostile = html_page.ReportSummary(
        folder, text, text, text, 1, pairs, pairs, pairs, runs, "figure.svg"
    )
    run = RUN._replace(experiment=text, label=text, budget=text)
    paper = html_page.Paper("rana", text, text, (f"rana_{text}",), {})
    page = Page(html_page.home_page([hostile], [paper], [run]))
    tags = [each.tag for each in page.elements]
    assert tags.count("script") == 2 and not {"b", "img"} & set(tags)
    assert not [name for each in page.elements for name in each.attributes if name[:2] == "on"]
    assert all(":" not in each.replace("data:,", "") for each in page.addresses())
    assert page.tables()[0][1][2] == " ".join(text.split())
    first, *_ = json.loads(page.all("script", id="search-index")[0].text)
    assert first["text"] == text
    assert ":" not in first["url"] and not first["url"].startswith("/")
