"""The Python door: frames of what is stored."""

from pathlib import Path

import numpy as np
import pytest

import evoexp
from evoexp.cli import main
from evoexp.errors import AmbiguousHash, NothingStored, SettingError, UnknownHash, UnknownOption
from evoexp.loading import Frames
from evoexp.records import GenerationRow, ReplicateSummary
from evoexp.testing import conditions
from store_lookup import find_runs

SMALL = ("ga.population_size=8", "ga.num_generations=2", "planner.num_new_trajectories=1")
LABELS = ["via-point GA", "random search", "multi-start"]


def loaded(outputs: Path | str | None, *words: str, **options: bool) -> Frames:
    return evoexp.load("rana_planar", *words, budget="smoke", outputs=outputs, **options)


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("frames") / "outputs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EVOEXP_OUTPUTS", str(root))
        words = ["experiment=rana_planar", "budget=smoke", "runner=serial", "--no-report"]
        assert main(["run", *words, *SMALL]) == 0
    return root


def test_by_experiment(outputs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    generations, summaries = loaded(outputs, *SMALL)
    assert summaries["label"].tolist() == np.repeat(LABELS, 2).tolist()
    assert summaries["replicate"].tolist() == [0, 1] * 3
    assert (summaries["status"] == "done").all()
    assert generations["label"].tolist() == np.repeat(LABELS, 6).tolist()
    assert generations["index"].tolist() == [0, 1, 2] * 6
    assert {*ReplicateSummary._fields, "label"} - {"terms"} <= set(summaries)
    columns = {*GenerationRow._fields, "label", "condition", "replicate"} - {"terms", "chain"}
    assert columns <= set(generations)
    assert "term_collisions" in set(summaries) & set(generations)
    last = generations[generations["index"] == 2]
    assert last["best_cost"].tolist() == summaries["best_cost"].tolist()
    ids = [each.id for each in conditions("experiment=rana_planar", *SMALL).values()]
    assert summaries["condition"].tolist() == np.repeat(ids, 2).tolist()
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(outputs))  # where nothing is said, as in commands
    for place in (None, str(outputs)):
        assert loaded(place, *SMALL).summaries.equals(summaries)


def test_by_hash(outputs: Path) -> None:
    for run in find_runs(outputs):
        generations, summaries = evoexp.load(run.hash12[:6], outputs=outputs)
        assert set(summaries["condition"]) == {run.condition_id} and len(summaries) == 2
        assert set(generations["condition"]) == {run.condition_id}
        assert len(generations) == 6
        assert evoexp.load(run.condition_id, outputs=outputs).summaries.equals(summaries)


def test_a_sweep_gives_what_is_stored_of_it(outputs: Path) -> None:
    frames = loaded(outputs, *SMALL[1:], "ga.population_size=8,9", multirun=True)
    assert set(frames.summaries["label"]) == {f"{label} · population_size=8" for label in LABELS}


def test_conditions_that_become_one_have_its_rows_once(outputs: Path) -> None:
    generations, summaries = loaded(outputs, *SMALL, "control=null")
    assert summaries["label"].tolist() == ["control=null"] * 2
    assert generations["label"].tolist() == ["control=null"] * 6


def test_what_cannot_be_loaded(outputs: Path, tmp_path: Path) -> None:
    for k in "01":
        (tmp_path / f"runs/abc00000000{k}").mkdir(parents=True)
        (tmp_path / f"runs/abc00000000{k}/config.json").write_text("{}")
    hint = "did you mean 'rana_planar'"
    nothing = r"rana_planar: nothing stored in .*; run it: evoexp run experiment=rana_pla"
    ambiguous = "hash: 'abc' is ambiguous: abc000000000, abc000000001"
    few = "ga.population_size: must be at least 1, was 0"
    none = "experiment or hash: no option 'rana_planr'; "
    for words, budget, place, kind, message in (
        (["rana_planr"], "paper", outputs, UnknownOption, none + hint),
        (["abcdef"], "paper", outputs, UnknownHash, "hash: no run 'abcdef' among the 3 in"),
        (["rana_planar"], "paper", tmp_path, NothingStored, nothing),
        (["rana_planar", "ga.population_size=0"], "paper", outputs, SettingError, few),
        (["rana_planar"], "smok", outputs, UnknownOption, "budget: no option 'smok'; did you mean"),
        (["abc"], "paper", tmp_path, AmbiguousHash, ambiguous),
    ):
        with pytest.raises(kind, match=message):
            evoexp.load(*words, budget=budget, outputs=place)
