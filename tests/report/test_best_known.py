"""Best known lengths: the file, its update, and the targets that follow from it."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from composed import script
from evoexp.errors import EvoexpError
from evoexp.report.figures.effort_curves import share_table
from evoexp.report.pages import comparison
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.comparison_files import (
    BestKnown,
    parsed,
    read_best_known,
    shipped_best_known,
)
from evoexp.report.results.planner_runs import MULTIPLES, of_results, problem_key
from evoexp.report.results.stored_results import Results

ROOT = Path(__file__).parents[2]
ONE = BestKnown(problem='a "quoted": name', length=1.0 / 3.0, run="0123456789ab", replicate=7)
TWO = BestKnown(problem="λ", length=2.0, run="111111111111", replicate=0)
KNOWN = {"123456789012": ONE, "00000000001e": TWO}  # keys that YAML would take for numbers


@pytest.fixture
def update() -> Any:
    return script("update-best-known")


def test_what_is_written_is_read(update: Any) -> None:
    for entries in (KNOWN, {}, shipped_best_known()):
        assert parsed(update.to_yaml(entries), "x") == entries
    assert parsed(b"", "x") == {}
    text = (ROOT / "src/evoexp/assets/best_known.yaml").read_bytes()
    assert text == update.to_yaml(shipped_best_known())


REFUSED: dict[str, str] = yaml.safe_load(
    Path(__file__).with_name("refused_data.yaml").read_text(encoding="utf-8")
)["best_known"]


@pytest.mark.parametrize(("text", "said"), REFUSED.items())
def test_what_cannot_be_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "f.yaml"
    path.write_text(text)
    with pytest.raises(EvoexpError) as caught:
        read_best_known(path)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_only_shorter_lengths_are_put_in(update: Any) -> None:
    found = {
        "123456789012": ONE.model_copy(update={"length": 0.5}),
        "00000000001e": TWO.model_copy(update={"problem": "other", "length": 1.5, "replicate": 3}),
        "abcdefabcdef": TWO,
    }
    now, lines = update.lowered(KNOWN, found)
    shorter = TWO.model_copy(update={"length": 1.5, "replicate": 3})  # its name stays
    assert now == {"123456789012": ONE, "00000000001e": shorter, "abcdefabcdef": TWO}
    assert lines == ["λ (00000000001e): 2 → 1.5", "λ (abcdefabcdef): new → 2"]
    assert update.lowered(now, found) == (now, [])


def test_targets_are_multiples_of_the_best_known_not_of_the_best_here(
    results: Results, settings: ReportSettings
) -> None:
    plain = of_results(results.evolved)
    key, straight = plain[0].problem.key, plain[0].problem.straight
    known = of_results(results.evolved, {key: 0.7 * straight, "other": 1.0})
    one = of_results(results.evolved[:1], {key: 0.7 * straight})  # whoever is compared
    for runs, length in ((plain, straight), (known, 0.7 * straight), (one, 0.7 * straight)):
        targets = tuple(m * length for m in MULTIPLES)
        assert {own.problem.targets for own in runs} == {targets}
    low, high = (share_table(runs)["share"].astype(float).max() for runs in (known, plain))
    assert low <= high
    for runs, words in ((plain, "straight line"), (known, "best known")):
        row = comparison.page(results, settings, runs).tables[0].rows[0]
        assert (row[1], row[-1]) == (f"`{key}`", words)


def test_the_script_writes_what_the_store_has_of_these_problems(
    update: Any,
    stored: Path,
    results: Results,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))
    file, runs = tmp_path / "known.yaml", of_results(results.evolved)
    assert update.main(["rana_planar", "--file", str(file)]) == 0  # runs of another budget, there
    ((key, best),) = read_best_known(file).items()
    assert key == problem_key(results.evolved[0].condition) and best.problem != best.run
    assert best.length == min(own.best_lengths.min() for own in runs)
    (own,) = (own for own in runs if own.condition and own.condition.run.hash12 == best.run)
    assert own.best_lengths[own.replicates.index(best.replicate)] == best.length
    assert f"({key}): new → " in capsys.readouterr().out
    before = file.read_bytes()
    assert update.main(["rana_planar", "--file", str(file)]) == 0
    assert "nothing is shorter" in capsys.readouterr().out and file.read_bytes() == before
    with pytest.raises(SystemExit):
        update.main(["rana_planer"])
    assert "did you mean 'rana_planar'?" in capsys.readouterr().err
