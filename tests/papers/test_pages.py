"""Reports of smoke runs hold the figures and words that `pages.yaml` names."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from matrix import examples
from report_samples import figure_stems, smoke_report

PAGES: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("pages.yaml").read_text())
ALWAYS = ("chen_mission", "chen_placement", "corsepius_ball", "lavoie")


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
