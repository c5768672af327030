from pathlib import Path

import pytest

from evoexp import cli
from report_samples import SMALL, expand

OTHERS = [word for word in SMALL if not word.startswith("budget")]


@pytest.fixture(autouse=True)
def outputs(stored: Path, monkeypatch: pytest.MonkeyPatch, blank_figures: None) -> Path:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))
    return stored


def report(capsys: pytest.CaptureFixture[str], *words: str) -> Path:
    """Return the page in Markdown beside the one that the command names."""
    assert cli.main(["report", *words]) == 0
    named = Path(capsys.readouterr().out.removeprefix("report: ").strip())
    assert named.name == "index.html"
    return named.with_suffix(".md")


def test_a_report_names_the_command_that_draws_it(
    outputs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    index = report(capsys, "rana_planar", *SMALL)
    assert index == outputs / "reports" / expand("rana_planar").report_name / "index.md"
    made_by = f"Made by `evoexp report rana_planar budget=smoke {' '.join(OTHERS)}`"
    assert made_by in index.read_text()


def test_the_experiment_may_be_an_override_as_for_run(capsys: pytest.CaptureFixture[str]) -> None:
    words = "experiment=rana_planar", *SMALL, "report.dpi=40", "--only", "random search"
    text = report(capsys, *words).read_text()
    assert "--only 'random search'`" in text and "| via-point GA |" not in text


def test_runs_by_prefixes_of_their_hashes(capsys: pytest.CaptureFixture[str]) -> None:
    one, two, *_ = (c.condition.id for c in expand("rana_planar").conditions)
    index = report(capsys, one[:6], two[:8].upper())
    assert index.parent.name == f"{one[:12]}+{two[:12]}"
    text = index.read_text()
    assert f"`evoexp report {one[:12]} {two[:12]}`" in text
    assert f"{one[:12]} against {two[:12]}" in text
