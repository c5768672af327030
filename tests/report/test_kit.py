"""The kit of a page: it offers what pages use, and pages take it from there."""

import re
from pathlib import Path

import pytest

import evoexp
from evoexp.report import kit

PAPERS = Path(evoexp.__file__).parent / "papers"
SOURCES = {path: path.read_text() for path in sorted(PAPERS.rglob("*.py"))}


@pytest.mark.parametrize("name", [name for name in vars(kit) if not name.startswith("_")])
def test_all_that_is_offered_is_there_and_used(name: str) -> None:
    assert hasattr(kit, name)
    assert any(re.search(rf"\b{name}\b", text) for text in SOURCES.values())


@pytest.mark.parametrize("paper", ["chen", "corsepius", "lavoie"])
def test_pages_take_the_parts_of_a_report_from_the_kit(paper: str) -> None:
    own = {path: text for path, text in SOURCES.items() if PAPERS / paper in path.parents}
    assert own
    for path, text in own.items():
        for module in re.findall(r"^from (evoexp\.report\S*) import", text, re.MULTILINE):
            is_offered = module in ("evoexp.report.kit", "evoexp.report")
            assert is_offered or module.startswith("evoexp.report.figures"), path
        for name in re.findall(r"^from evoexp\.report import (.*)$", text, re.MULTILINE):
            assert name == "kit", path
