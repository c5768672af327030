"""The home page: cards of papers, other reports, runs and a search; inert, whatever reports say."""

import json

import pytest
from test_html_page import HOSTILE

from evoexp.report.pages.home_page import Paper, ReportSummary, StoredRun, home_page, site
from html_reader import Page

RANA = Paper("rana", "Rana 1995", "arms", ("rana_planar", "rana_puma", "lavoie"), {"rana_puma": 3})
CLAIMS = (("free", "reproduced"), ("short", "contradicted"), ("fast", "not judged (no runs)"))
HASH = "0123456789ab"
RUN = StoredRun(HASH, "rana_planar", "GA", "paper", 3, 20, 0)


def summary(folder: str, command: str = "", picture: str = "") -> ReportSummary:
    headings = (("Claims", "claims"), ("GA against others", "ga-against-others"))
    words = command or f"report {folder}"
    runs = ((HASH, "GA"),)
    return ReportSummary(folder, f"about {folder}", words, "", 0, headings, CLAIMS, runs, picture)


def test_a_card_counts_the_claims_of_whole_experiments() -> None:
    found = [
        summary("rana_planar", picture="fig_5.svg"),
        summary("rana_planar+12345678", picture="scene.svg"),
        summary("rana_three@smoke"),
    ]
    (card,) = site(found, [RANA], [])["papers"]
    assert card["counts"] == (("reproduced", 1), ("contradicted", 1), ("not judged", 1))
    assert card["unjudged"] == 3
    assert card["missing"] == ["rana_puma"]
    assert card["face"].picture_url == "rana_planar/fig_5.svg"
    assert card["reports"] == found
    assert found[1].url() == "rana_planar%2B12345678/index.html?home"


def test_reports_of_no_paper_stand_by_themselves() -> None:
    found = [
        summary("arena_rana"),
        summary("compare_rana_planar", "compare rana_planar"),
        summary("ranaplanar"),
    ]
    groups = {
        name: [report.folder for report in reports]
        for name, reports in site(found, [RANA], [])["others"]
    }
    assert groups == {
        "Arenas and other experiments": ["arena_rana", "ranaplanar"],
        "Comparisons": ["compare_rana_planar"],
    }


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
    assert run.state == state
    page = Page(home_page([summary("rana_planar")], [RANA], [run]))
    (head, row) = page.tables()[0]
    cells = dict(zip(head, row, strict=True))
    assert (cells["hash"], cells["state"], cells["done"]) == (HASH, state, str(done))
    assert cells["reports"] == "rana_planar"
    assert f"rana_planar/index.html?home#run-{HASH}" in page.addresses()
    assert ("not finished" in page.all("main")[0].text) == (state != "done")


def test_partial_reports_are_named_at_the_top() -> None:
    partial = summary("rana_planar")._replace(partial="GA: 3 of 20 replicates done, 0 failed")
    page = Page(home_page([partial, summary("rana_puma")], [RANA], []))
    (notice,) = page.all("div", class_="notice")
    assert "1 of 2 reports were drawn before all planned replicates were there" in notice.text
    assert "rana_planar" in notice.text and "rana_puma" not in notice.text
    assert page.elements.index(notice) < page.elements.index(page.all("h2")[0])


def test_the_search_knows_titles_headings_claims_and_hashes() -> None:
    content = home_page([summary("rana_planar")], [RANA], [RUN])
    entries = json.loads(Page(content).all("script", id="search-index")[0].text)
    assert [(each["kind"], each["text"]) for each in entries] == [
        ("report", "about rana_planar"),
        ("heading", "GA against others"),
        *((f"claim, {verdict}", text) for text, verdict in CLAIMS),
        ("run", f"{HASH} GA"),
    ]
    assert entries[1]["url"] == "rana_planar/index.html?home#ga-against-others"


@pytest.mark.parametrize("text", HOSTILE)
def test_what_strangers_write_is_only_text(text: str) -> None:
    folder = text.replace("/", "")
    hostile = ReportSummary(
        folder,
        text,
        text,
        text,
        1,
        ((text, text),),
        ((text, text),),
        ((HASH, text),),
        "figure.svg",
    )
    run = RUN._replace(experiment=text, label=text, budget=text)
    paper = Paper("rana", text, text, (f"rana_{text}",), {})
    page = Page(home_page([hostile], [paper], [run]))
    tags = [each.tag for each in page.elements]
    assert tags.count("script") == 2
    assert "b" not in tags
    assert not page.all("img")
    assert not [name for each in page.elements for name in each.attributes if name[:2] == "on"]
    assert all(":" not in each.replace("data:,", "") for each in page.addresses())
    assert page.tables()[0][1][2] == " ".join(text.split())
    entries = json.loads(page.all("script", id="search-index")[0].text)
    assert entries[0]["text"] == text
    assert ":" not in entries[0]["url"] and not entries[0]["url"].startswith("/")
