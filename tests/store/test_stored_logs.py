"""Logs of another day: those in `data`, smoke runs of November 2026, stay readable for ever.

They are never written anew. If a later evoexp cannot read them, the schema version of logs is to be
raised, and the refusal to name it; if results change, a revision, and `reproduce` says so.
"""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from evoexp.cli import main
from evoexp.condition import Condition, revisions
from evoexp.store.log_reader import generation_columns, read_log, read_solution, read_summary

DATA = Path(__file__).parent / "data"
DIGESTS = {  # as they were written
    "coevolution": "18964fca62600e24672e1ffb9eb97e29",  # with fronts
    "grid_path_ga": "cf5d7fb0187a352dad5d0a1076b4ab83",
    "placement_optimum": "dcfe9ffa09729a34129533a8b5eb9a63",  # with an array
    "posture_es": "86b7b24f0c644a4a955408753e1a5647",
    "random_search": "0fa38193786918e0f468bb64ac08fb11",
    "redundant_ga": "4ed0511df8661ed6cf8cff9911ed808a",
    "two_stage": "78f6cb1558d1b606382dae8f63dfa98c",
    "urdf": "6d3553c1366ced32771052a9201da6d9",  # with the files of a robot
    "via_point_ga": "bcf5cc5a1d6ee1be599733e5df47fd3d",
}


def test_they_are_few_and_small() -> None:
    assert {path.stem for path in DATA.glob("*.mcap")} == DIGESTS.keys()
    assert sum(path.stat().st_size for path in DATA.iterdir()) < 100_000


@pytest.mark.parametrize("name", DIGESTS)
def test_it_loads_is_shown_and_is_reproduced_while_the_revisions_are_the_same(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = DATA / f"{name}.mcap"
    log = read_log(path)
    assert log.condition_id == hashlib.sha256(log.config_json).hexdigest()
    assert log.summary.digest == DIGESTS[name]
    assert read_summary(path) == log.summary
    assert (read_solution(path).values == log.solutions[-1].values).all()
    assert len(generation_columns(path)["best_cost"]) == len(log.generations) > 0
    assert bool(log.fronts) == (name == "coevolution")
    assert len(log.cpu_s) == len(log.generations)
    assert np.isnan(log.cpu_s).all()  # older than that these times were logged
    arrays = log.arrays()
    assert list(arrays) == (["minima"] if name == "placement_optimum" else [])
    assert all(array.size for array in arrays.values())
    assert bool(set(log.attachments) - {"minima.npy"}) == (name == "urdf")
    assert main(["show", str(path)]) == 0
    assert log.condition_id[:12] in capsys.readouterr().out
    changed = [pair for pair in revisions(json.loads(log.config_json)) if pair[1] != pair[2]]
    code = main(["reproduce", str(path)])
    said = capsys.readouterr()
    if changed:
        assert (code, said.err.count("\n")) == (2, 1)
        assert "was revision" in said.err
    else:
        assert (code, said.err) == (0, "")
        assert "1 of 1 MATCH" in said.out


def test_another_revision_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = read_log(DATA / "via_point_ga.mcap").config_json
    planner = Condition.from_json(config).planner
    monkeypatch.setattr(type(planner), "revision", planner.revision + 1)
    assert any(stored != installed for _, stored, installed in revisions(json.loads(config)))
    test_it_loads_is_shown_and_is_reproduced_while_the_revisions_are_the_same(
        "via_point_ga", capsys
    )


def test_the_files_of_a_robot_are_taken_from_the_log_alone(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "evoexp", "reproduce", str(DATA / "urdf.mcap")]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "1 of 1 MATCH" in done.stdout or "was revision" in done.stderr
