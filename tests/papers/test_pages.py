"""Reports of smoke runs hold the figures and words that `pages.yaml` names."""

from collections import Counter
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from evoexp.registry import PAGES as REGISTERED
from evoexp.registry import registrations
from evoexp.report.pages.page_builder import page_of
from evoexp.report.results import stored_results
from evoexp.report.results.stored_results import Results
from matrix import examples
from report_samples import figure_stems, page_settings, smoke_report, smoke_results

PAGES: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("pages.yaml").read_text())
ALWAYS = ("chen_mission", "chen_placement", "corsepius_ball", "corsepius_scope", "lavoie")
FOREIGN = [  # the assumptions of Corsépius may be those of any planner
    page.name
    for page in registrations(REGISTERED)
    if page.module.startswith("evoexp.papers.") and "papers.rana" not in page.module
    if page.name != "corsepius_claims"
]


@pytest.mark.parametrize("name", examples(PAGES, ALWAYS.__contains__))
def test_a_page_has_its_figures_and_words(name: str, outputs: Path) -> None:
    page, directory = PAGES[name], smoke_report(outputs, name)
    stems, text = figure_stems(directory), (directory / "index.md").read_text()
    assert stems == set(page.get("figures", stems))
    for stem in page.get("some", ()):
        assert any(each == stem or each.startswith(f"{stem}_") for each in stems), stem
    assert [words for words in page.get("words", ()) if words not in text] == []
    assert [words for words in page.get("absent", ()) if words in text] == []
    expected = page.get("counts", {})
    assert {words: text.count(words) for words in expected} == expected
    for stem, columns in page.get("values", {}).items():
        table = pd.read_csv(directory / f"{stem}.csv")
        assert {each: sorted(table[each].dropna().unique()) for each in columns} == columns
    for stem, count in page.get("rows", {}).items():
        assert len(pd.read_csv(directory / f"{stem}.csv")) == count
    if "claims" in page:
        claims = page_of(smoke_results(outputs, name), page_settings(name)).claims
        assert Counter(claim.name for claim in claims) == page["claims"]


@pytest.mark.parametrize("figures", FOREIGN)
def test_other_planners_get_the_generic_page(results: Results, figures: str) -> None:
    page = page_of(results, page_settings("", figures))
    assert (page.title, page.claims) == (results.experiment, ())


@pytest.mark.parametrize("name", ["corsepius_population", "lavoie"])
def test_pages_of_thousands_of_runs_read_no_generation(
    outputs: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    results = smoke_results(outputs, name)
    monkeypatch.setattr(stored_results, "read_generations", None)  # to be called by nobody
    for drawing in page_of(results, page_settings(name)).drawings:
        assert len(drawing.table())
