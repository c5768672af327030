"""Best known lengths: the file, its update, and the targets that follow from it."""

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from evoexp.errors import SettingError
from evoexp.report.figures.effort_curves import share_table
from evoexp.report.pages import comparison
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.best_known import (
    BestKnown,
    parsed,
    read_best_known,
    shipped_best_known,
)
from evoexp.report.results.planner_runs import MULTIPLES, of_results, problem_key
from evoexp.report.results.stored_results import Results

ROOT = Path(__file__).parents[2]
ONE = BestKnown('a "quoted": name', 1.0 / 3.0, "0123456789ab", 7)
TWO = BestKnown("λ", 2.0, "111111111111", 0)
KNOWN = {"123456789012": ONE, "00000000001e": TWO}  # keys that YAML would take for numbers


@pytest.fixture
def update() -> ModuleType:
    """Return the script."""
    path = str(ROOT / "scripts/update-best-known")
    spec = spec_from_loader("update_best_known", SourceFileLoader("update_best_known", path))
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_is_written_is_read(update: ModuleType) -> None:
    to_yaml = update.to_yaml
    assert parsed(to_yaml(KNOWN), "x") == KNOWN
    assert parsed(to_yaml({}), "x") == {} == parsed(b"", "x")
    for key, each in shipped_best_known().items():
        assert parsed(to_yaml({key: each}), "x") == {key: each}
    text = (ROOT / "src/evoexp/assets/best_known.yaml").read_bytes()
    assert text == to_yaml(shipped_best_known())


ENTRY = '{problem: a, length: 1.0, run: "0123456789ab", replicate: 0}'
REFUSED = {
    "- 1": "f.yaml: must be a mapping of keys of problems",
    "a: [": "f.yaml: must be YAML",
    f"box_panda: {ENTRY}": "must be keys of 12 hex digits in quotation marks, was 'box_panda'",
    f"123456789012: {ENTRY}": "must be keys of 12 hex digits in quotation marks, was 123456789012",
    '"123456789012": 3.0': "123456789012: must be a mapping of problem, length, run, replicate",
    f'"123456789012": {ENTRY.replace("1.0", "-1.0")}': "length: must be a number above 0, was -1.0",
    f'"123456789012": {ENTRY.replace("1.0", ".inf")}': "length: must be a number above 0",
    f'"123456789012": {ENTRY.replace("1.0", "true")}': "length: must be a number above 0",
    f'"123456789012": {ENTRY.replace("89ab", "89")}': "run: must be 12 hex digits",
    f'"123456789012": {ENTRY.replace(": 0}", ": -1}")}': "replicate: must be a whole number",
}


@pytest.mark.parametrize(("text", "said"), REFUSED.items())
def test_what_cannot_be_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "f.yaml"
    path.write_text(text)
    with pytest.raises(SettingError) as caught:
        read_best_known(path)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_only_shorter_lengths_are_put_in(update: ModuleType) -> None:
    found = {
        "123456789012": ONE._replace(length=0.5),
        "00000000001e": TWO._replace(problem="other", length=1.5, replicate=3),
        "abcdefabcdef": TWO,
    }
    now, lines = update.lowered(KNOWN, found)
    assert now["123456789012"] == ONE
    assert now["00000000001e"] == TWO._replace(length=1.5, replicate=3)  # its name stays
    assert now["abcdefabcdef"] == TWO
    assert lines == ["λ (00000000001e): 2 → 1.5", "λ (abcdefabcdef): new → 2"]
    assert update.lowered(now, found) == (now, [])


def test_the_shortest_is_that_of_all_proven_answers(update: ModuleType, results: Results) -> None:
    runs = of_results(results.evolved)
    ((key, best),) = update.shortest(runs).items()
    assert key == problem_key(results.evolved[0].condition)
    assert best.length == min(own.best_lengths.min() for own in runs)
    (own,) = (own for own in runs if own.condition and own.condition.run.hash12 == best.run)
    assert own.best_lengths[own.replicates.index(best.replicate)] == best.length


def test_targets_are_multiples_of_the_best_known_not_of_the_best_here(
    results: Results, settings: ReportSettings
) -> None:
    plain = of_results(results.evolved)
    key, straight = plain[0].problem.key, plain[0].problem.straight
    assert plain[0].problem.targets == tuple(m * straight for m in MULTIPLES)
    known = of_results(results.evolved, {key: 0.7 * straight, "other": 1.0})
    assert known[0].problem.targets == tuple(m * (0.7 * straight) for m in MULTIPLES)
    assert len({own.problem for own in known}) == 1  # the same for all planners
    one = of_results(results.evolved[:1], {key: 0.7 * straight})
    assert one[0].problem.targets == known[0].problem.targets  # whoever is compared
    low, high = (share_table(runs)["share"].astype(float).max() for runs in (known, plain))
    assert low <= high
    for runs, words in ((plain, "straight line"), (known, "best known")):
        table = comparison.page(results, settings, runs).tables[0]
        assert table.rows[0][-1] == words and table.rows[0][1] == f"`{key}`"


def test_the_script_writes_what_the_store_has_of_these_problems(
    update: ModuleType,
    stored: Path,
    results: Results,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))
    file = tmp_path / "known.yaml"
    assert update.main(["rana_planar", "--file", str(file)]) == 0  # runs of another budget, there
    ((key, best),) = read_best_known(file).items()
    assert best.length == min(own.best_lengths.min() for own in of_results(results.evolved))
    assert best.problem != best.run and not np.isnan(best.length)
    assert f"({key}): new → " in capsys.readouterr().out
    before = file.read_bytes()
    assert update.main(["rana_planar", "--file", str(file)]) == 0
    assert "nothing is shorter" in capsys.readouterr().out and file.read_bytes() == before
    with pytest.raises(SystemExit):
        update.main(["rana_planer"])
    assert "did you mean 'rana_planar'?" in capsys.readouterr().err
