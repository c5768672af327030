from pathlib import Path

import pytest

from evoexp import cli
from report_samples import SMALL, expand


@pytest.fixture(autouse=True)
def outputs(stored: Path, monkeypatch: pytest.MonkeyPatch, blank_figures: None) -> Path:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))
    return stored


def report(*words: str) -> int:
    return cli.main(["report", *words])


def page(captured: pytest.CaptureFixture[str]) -> Path:
    """Return the page in Markdown beside the one that is named."""
    named = Path(captured.readouterr().out.removeprefix("report: ").strip())
    assert named.name == "index.html"
    return named.with_suffix(".md")


@pytest.mark.matrix
def test_an_experiment_with_overrides(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert report("rana_planar", *SMALL) == 0
    index = page(capsys)
    assert index == outputs / "reports" / expand("rana_planar").report_name / "index.md"
    arguments = " ".join(word for word in SMALL if not word.startswith("budget"))
    assert f"Made by `evoexp report rana_planar budget=smoke {arguments}`" in index.read_text()


def test_an_experiment_may_be_named_as_the_folder_of_its_report(
    capsys: pytest.CaptureFixture[str],
) -> None:
    small = [word for word in SMALL if not word.startswith("budget")]
    assert report("rana_planar@smoke", *small, "report.dpi=40") == 0
    text = page(capsys).read_text()
    assert "Made by `evoexp report rana_planar budget=smoke" in text


def test_the_experiment_may_be_an_override_as_for_run(capsys: pytest.CaptureFixture[str]) -> None:
    given = "experiment=rana_planar", *SMALL, "report.dpi=40"
    assert report(*given, "--only", "random search") == 0
    text = page(capsys).read_text()
    assert "--only 'random search'`" in text
    assert "| via-point GA |" not in text


def test_runs_by_prefixes_of_their_hashes(
    outputs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ids = [c.condition.id for c in expand("rana_planar").conditions]
    assert report(ids[0][:6], ids[1][:8].upper()) == 0
    index = page(capsys)
    assert index.parent.name == f"{ids[0][:12]}+{ids[1][:12]}"
    text = index.read_text()
    assert f"`evoexp report {ids[0][:12]} {ids[1][:12]}`" in text
    assert f"{ids[0][:12]} against {ids[1][:12]}" in text


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["rana_plana"], "experiment: no option 'rana_plana'; did you mean 'rana_planar'?"),
        (["ffffffffffff"], "hash: no run 'ffffffffffff' among the 4"),
        (["rana_planar", "rana_x"], "experiment: no option 'rana_x'"),
        (["rana_planar", "seed=77"], "try: evoexp run experiment=rana_planar seed=77"),
        (["rana_planar", "ga.pop_size=3"], "ga.pop_size: unknown setting"),
        (["rana_planar", "report.dpi=0"], "report.dpi: must be at least 1, was 0"),
        (["rana_planar", *SMALL, "report.figures=nope"], "report.figures: no option 'nope'"),
        (["rana_planar@smok"], "budget: no option 'smok'; did you mean 'smoke'?"),
        (["rana_planar@smoke", "rana_puma"], "budget: must be one for all experiments, was 'rana_"),
        (["rana_planar@smoke", "budget=quick"], "budget: must be one for all experiments"),
    ],
)
def test_what_cannot_be_reported_is_one_line(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert report(*words) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_overrides_and_hashes_exclude_each_other(capsys: pytest.CaptureFixture[str]) -> None:
    prefix = expand("rana_planar").conditions[0].condition.id[:8]
    assert report(prefix, "budget=smoke") == 2
    assert (
        "overrides: must be left out where runs are given by their hashes"
        in capsys.readouterr().err
    )
