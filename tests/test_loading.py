"""The Python door: frames of what is stored."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import evoexp
from composed import composed
from evoexp.cli import main
from evoexp.configuration import compose
from evoexp.errors import AmbiguousHash, NothingStored, SettingError, UnknownHash, UnknownOption
from evoexp.records import GenerationRow, ReplicateSummary
from evoexp.store.run_directory import RunDirectory
from store_lookup import find_runs

SMALL = ("ga.population_size=8", "ga.num_generations=2", "planner.num_new_trajectories=1")
LABELS = ["via-point GA", "random search", "multi-start"]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("frames") / "outputs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EVOEXP_OUTPUTS", str(root))
        assert (
            main(
                [
                    "run",
                    "experiment=rana_planar",
                    "budget=smoke",
                    *SMALL,
                    "runner=serial",
                    "--no-report",
                ]
            )
            == 0
        )
    return root


def test_by_experiment(outputs: Path) -> None:
    generations, summaries = evoexp.load("rana_planar", *SMALL, budget="smoke", outputs=outputs)
    assert summaries["label"].tolist() == np.repeat(LABELS, 2).tolist()
    assert summaries["replicate"].tolist() == [0, 1] * 3
    assert (summaries["status"] == "done").all()
    assert generations["label"].tolist() == np.repeat(LABELS, 6).tolist()
    assert generations["index"].tolist() == [0, 1, 2] * 6
    assert {*ReplicateSummary._fields, "label"} - {"terms"} <= set(summaries)
    assert {*GenerationRow._fields, "label", "condition", "replicate"} - {"terms", "chain"} <= set(
        generations
    )
    assert "term_collisions" in set(summaries) & set(generations)
    last = generations[generations["index"] == 2]
    assert last["best_cost"].tolist() == summaries["best_cost"].tolist()
    ids = [
        c.id
        for _, c in compose.expand(["experiment=rana_planar", "budget=smoke", *SMALL])[0].conditions
    ]
    assert summaries["condition"].tolist() == np.repeat(ids, 2).tolist()


def test_by_hash(outputs: Path) -> None:
    for run in find_runs(outputs):
        generations, summaries = evoexp.load(run.hash12[:6], outputs=outputs)
        assert set(summaries["condition"]) == {run.condition_id} and len(summaries) == 2
        assert set(generations["condition"]) == {run.condition_id}
        assert len(generations) == 6
        assert evoexp.load(run.condition_id, outputs=outputs).summaries.equals(summaries)


def test_where_nothing_is_said_the_outputs_are_those_of_the_commands(
    outputs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(outputs))
    frames = evoexp.load("rana_planar", *SMALL, budget="smoke")
    assert frames.summaries.equals(
        evoexp.load("rana_planar", *SMALL, budget="smoke", outputs=str(outputs)).summaries
    )


def test_a_sweep_gives_what_is_stored_of_it(outputs: Path) -> None:
    words = [word for word in SMALL if "population" not in word]
    frames = evoexp.load(
        "rana_planar",
        *words,
        "ga.population_size=8,9",
        budget="smoke",
        multirun=True,
        outputs=outputs,
    )
    assert set(frames.summaries["label"]) == {f"{label} · population_size=8" for label in LABELS}


def test_conditions_that_become_one_have_its_rows_once(outputs: Path) -> None:
    words = ("rana_planar", *SMALL, "control=null")
    generations, summaries = evoexp.load(*words, budget="smoke", outputs=outputs)
    assert summaries["label"].tolist() == ["via-point GA"] * 2
    assert generations["label"].tolist() == ["via-point GA"] * 6


def test_failed_replicates_are_rows(outputs: Path, tmp_path: Path) -> None:
    condition = composed("experiment=rana_obstacles", "budget=smoke")
    run = RunDirectory(tmp_path, condition.id)
    run.create(condition.to_json(), {})
    run.write_failure(1, "ArithmeticError: told to fail", "Traceback")
    generations, summaries = evoexp.load("rana_obstacles", budget="smoke", outputs=tmp_path)
    (row,) = summaries.to_dict("records")
    assert (row["label"], row["replicate"], row["status"]) == ("rana_obstacles", 1, "failed")
    assert row["stop_reason"] == "ArithmeticError: told to fail"
    assert pd.isna(row["best_cost"])
    assert len(generations) == 0
    assert "best_cost" in generations


def test_what_cannot_be_loaded(outputs: Path, tmp_path: Path) -> None:
    with pytest.raises(
        UnknownOption,
        match="experiment or hash: no option 'rana_planr'; did you mean 'rana_planar'",
    ):
        evoexp.load("rana_planr", outputs=outputs)
    with pytest.raises(UnknownHash, match="hash: no run 'abcdef' among the 3 in"):
        evoexp.load("abcdef", outputs=outputs)
    with pytest.raises(
        NothingStored,
        match=r"rana_planar: nothing stored in .*; run it: evoexp run experiment=rana_pla",
    ):
        evoexp.load("rana_planar", outputs=tmp_path)
    with pytest.raises(SettingError, match="ga.population_size: must be at least 1, was 0"):
        evoexp.load("rana_planar", "ga.population_size=0", outputs=outputs)
    with pytest.raises(UnknownOption, match="budget: no option 'smok'; did you mean 'smoke'"):
        evoexp.load("rana_planar", budget="smok", outputs=outputs)
    for k in "01":
        (tmp_path / f"runs/abc00000000{k}").mkdir(parents=True)
        (tmp_path / f"runs/abc00000000{k}/config.json").write_text("{}")
    with pytest.raises(AmbiguousHash, match="hash: 'abc' is ambiguous: abc000000000, abc000000001"):
        evoexp.load("abc", outputs=tmp_path)
