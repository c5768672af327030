"""`evoexp pack`, archives as words of `reproduce` and `report`, and `evoexp clean`."""

import json
from pathlib import Path

import pytest
from command_samples import Evoexp, content

from evoexp.store.run_directory import find_runs


@pytest.fixture
def packed(evoexp: Evoexp, stored: Path, tmp_path: Path) -> Path:
    path = tmp_path / "two.tar"
    said = evoexp("pack", *(run.hash12 for run in find_runs(stored)[:2]), "-o", str(path))
    assert said.code == 0 and "2 runs, 4 logs" in said.out
    return path


def test_an_archive_is_reproduced_and_reported_elsewhere(
    evoexp: Evoexp, packed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "elsewhere"))
    said = evoexp("reproduce", str(packed))
    assert said.code == 0 and "4 of 4 MATCH" in said.out
    assert evoexp("verify").code == 0
    said = evoexp("report", str(packed))
    assert said.code == 0
    assert list((tmp_path / "elsewhere" / "reports").glob("*/index.md"))


def test_what_cannot_be_packed_is_refused(evoexp: Evoexp, stored: Path, tmp_path: Path) -> None:
    assert "no run 'ffff'" in evoexp("pack", "ffff").err
    bad = tmp_path / "bad.tar"
    bad.write_bytes(b"nothing")
    for command in ("reproduce", "report"):
        said = evoexp(command, str(bad))
        assert said.code == 2 and said.err.count("\n") == 1 and "no archive of runs" in said.err


def test_clean_deletes_what_it_lists_and_only_if_told_so(evoexp: Evoexp, stored: Path) -> None:
    run = find_runs(stored)[0]
    rubbish = {
        "temporary": run.replicates / ".0007.mcap.12345.tmp",
        "damaged": run.replicates / "0001.mcap.damaged",
        "failed": run.replicates / "0009.failed.json",
        "empty": stored / "runs" / "0123456789ab",
    }
    for kind, path in rubbish.items():
        if kind == "empty":
            path.mkdir()
            (path / ".lock").touch()
        else:
            path.write_text("{}")
    before = content(stored)
    found = json.loads(evoexp("clean", "all", "--json").out)
    assert {each["kind"]: each["path"] for each in found} == {k: str(p) for k, p in rubbish.items()}
    assert content(stored) == before
    assert evoexp("clean", "--yes").code == 0
    assert [path.exists() for path in rubbish.values()] == [False, False, True, False]
    assert evoexp("clean", "failed", "--yes").code == 0
    kept = {path: data for path, data in before.items() if path not in rubbish.values()}
    assert content(stored) == kept
    assert "nothing to delete" in evoexp("clean", "all").out


@pytest.mark.parametrize(("count", "more"), [(20, ""), (21, " (1 more than shown)")])
def test_clean_counts_what_it_does_not_show(
    evoexp: Evoexp, stored: Path, count: int, more: str
) -> None:
    run = find_runs(stored)[0]
    for k in range(count):
        (run.replicates / f".{k:04d}.mcap.1.tmp").write_text("")
    said = evoexp("clean").out
    assert f"\n{count} files or folders{more}, 0.00 MB" in said
    assert said.count(".mcap.1.tmp") == 20


def test_clean_leaves_a_run_that_is_written(evoexp: Evoexp, stored: Path) -> None:
    run = find_runs(stored)[0]
    rest = run.replicates / "0001.mcap.damaged"
    rest.write_text("")
    with run.lock():
        said = evoexp("clean", "--yes")
    assert said.code == 0 and "another process is writing it now" in said.out
    assert rest.exists()


def test_an_unknown_kind_is_refused(evoexp: Evoexp) -> None:
    said = evoexp("clean", "temporry")
    assert said.code == 2 and "did you mean 'temporary'" in said.err
