"""`evoexp pack`, archives as words of other commands, and `evoexp clean`."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import Evoexp, content, with_manifest

from evoexp.store.archive import pack
from evoexp.store.log import SUMMARY
from evoexp.store.run_directory import RunDirectory
from forged_logs import with_message, with_metadata
from store_lookup import find_runs


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
    assert "its logs were compared in place; nothing was added to" in said.out
    assert not (tmp_path / "elsewhere").exists()
    said = evoexp("report", str(packed))
    assert said.code == 0
    assert list((tmp_path / "elsewhere" / "reports").glob("*/index.md"))


def test_show_and_diff_look_into_an_archive(
    evoexp: Evoexp, packed: Path, stored: Path, refused: Callable[..., str]
) -> None:
    one, two = find_runs(stored)[:2]
    assert evoexp("diff", f"{packed}:{one.hash12}", one.hash12).text.count("two.tar") == 1
    shutil.rmtree(stored)
    said = evoexp("show", str(packed))
    assert said.code == 0 and one.hash12 in said.out and two.hash12 in said.out
    assert f"one run on a screen: evoexp show {packed}:" in said.out
    for more in ((), ("--all",)):
        said = evoexp("show", f"{packed}:{one.hash12[:6]}", *more)
        assert said.code == 0 and said.out.startswith(f"condition    {one.condition_id}")
        assert f"directory {packed}".replace(" ", "") in "".join(said.out.split())
    names = {each["condition"] for each in json.loads(evoexp("show", str(packed), "--json").out)}
    assert names == {one.condition_id, two.condition_id}
    for other, code in ((one, 0), (two, 1)):
        assert evoexp("diff", f"{packed}:{one.hash12}", f"{packed}:{other.hash12}").code == code
    assert f"choose one: {packed}:" in refused("diff", str(packed), f"{packed}:{one.hash12}")
    assert "begins 0 (holds: " in refused("show", f"{packed}:ffff")


@pytest.mark.parametrize(
    "words",
    [
        *(("list", "--json"), ("verify", "--json"), ("show", "ONE", "--json")),
        ("diff", "ONE", "TWO", "--json"),
    ],
)
def test_an_archive_looks_as_its_runs_do_after_they_are_taken_in(
    evoexp: Evoexp, packed: Path, stored: Path, words: tuple[str, ...]
) -> None:
    one, two = (run.hash12 for run in find_runs(stored)[:2])
    shutil.rmtree(stored)

    def said(place: str) -> tuple[int, object]:
        hashes = {"ONE": f"{place}{one}", "TWO": f"{place}{two}"}
        archive = [str(packed)] if place and words[0] in ("list", "verify") else []
        answer = evoexp(*(hashes.get(word, word) for word in words), *archive)
        found = json.loads(answer.out)
        if words[0] == "show":
            del found["origin"]["directory"]
        return answer.code, found["runs"] if words[0] == "list" else found

    before = said(f"{packed}:")
    assert not stored.exists()
    assert evoexp("report", str(packed)).code == 0
    assert said("") == before


def test_list_and_verify_look_into_an_archive(
    evoexp: Evoexp, packed: Path, stored: Path, run: RunDirectory, tmp_path: Path
) -> None:
    one, two = find_runs(stored)[:2]
    words = evoexp("list", str(packed)).text.split()
    assert words[:3] == ["runs", "in", str(packed)] and "experiments" not in words
    listed = json.loads(evoexp("list", f"{packed}:{two.hash12}", "--json").out)
    assert listed["experiments"] == []
    assert [each["hash"] for each in listed["runs"]] == [two.condition_id]
    assert f"no failed replicates in {packed}" in evoexp("list", "--failed", str(packed)).out
    said = evoexp("verify", str(packed), one.hash12)
    assert said.code == 0 and "3 runs, 6 logs: all is well" in said.out
    log = run.log_path(1)
    log.write_bytes(with_metadata(log.read_bytes(), SUMMARY, clearance=0.125))
    pack([run], tmp_path / "forged.tar")
    said = evoexp("verify", str(tmp_path / "forged.tar"), str(packed))
    assert said.code == 1 and "1 damaged file in 1 of them" in said.out
    assert "mend" not in said.out and str(stored) not in said.out


def test_an_archive_is_compared_and_not_what_is_stored_already(
    evoexp: Evoexp, run: RunDirectory, tmp_path: Path
) -> None:
    """Its log would stay behind the stored one, which is whole."""
    elsewhere = RunDirectory(tmp_path / "elsewhere", run.condition_id)
    shutil.copytree(run.path, elsewhere.path)
    log = elsewhere.log_path(1)
    log.write_bytes(with_message(log.read_bytes(), "/generation", lambda row: row | {"note": 1}))
    pack([elsewhere], tmp_path / "forged.tar")
    said = evoexp("reproduce", str(tmp_path / "forged.tar"))
    assert said.code == 1 and "1 of 2 MATCH" in said.out
    assert evoexp("reproduce", run.hash12).code == 0


EVIL = "evoexp run experiment=x; rm -rf ~"


def test_the_texts_of_an_archive_are_shown_as_its_own(
    evoexp: Evoexp, run: RunDirectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_manifest(run, command=EVIL, label="[red]mine[/red]")
    pack([run], tmp_path / "theirs.tar")
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "elsewhere"))
    assert evoexp("report", str(tmp_path / "theirs.tar")).code == 0
    said = evoexp("show", run.hash12)
    assert "taken from theirs.tar" in said.out
    assert "rm -rf" not in said.out and "[red]mine[/red]" in said.out
    RunDirectory(tmp_path / "elsewhere", run.condition_id).log_path(1).write_bytes(b"")
    for words in (("verify",), ("list",), ("show", run.hash12)):
        said = evoexp(*words)
        assert "rm -rf" not in said.out + said.err
        assert "mend: evoexp run experiment=" in said.out or words != ("verify",)


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        (EVIL, "evoexp run 'experiment=x;' rm -rf '~'"),
        ("rm -rf ~", "evoexp run experiment=…"),
        ("evoexp run 'experiment=x", "evoexp run experiment=…"),
        ("evoexp run `id` $(id) | sh", "evoexp run '`id`' '$(id)' '|' sh"),
        ("evoexp run x\nrm -rf ~", "evoexp run experiment=…"),
        (["evoexp", "run"], "evoexp run experiment=…"),
    ],
)
def test_a_command_of_a_manifest_is_one_command(
    run: RunDirectory, command: object, shown: str
) -> None:
    with_manifest(run, command=command)
    assert run.command == shown


@pytest.mark.parametrize(
    "entries",
    [
        {"label": "a\nb"},
        {"label": "a\u202eb"},
        {"experiment": 7},
        {"options": ["a"]},
        {"options": {"robot": "x"}},
        {"options": {"robot": {"name": "x\n", "origin": "evoexp"}}},
        {"options": {"robot": {"name": "../../x", "origin": "evoexp"}}},
        {"options": {"/etc": {"name": "x", "origin": "evoexp"}}},
        {"git": "main"},
        {"versions": [1]},
    ],
)
def test_a_manifest_of_other_kinds_is_damaged(
    evoexp: Evoexp, run: RunDirectory, entries: dict[str, object]
) -> None:
    with_manifest(run, **entries)
    (problems,) = (r["problems"] for r in json.loads(evoexp("verify", run.hash12, "--json").out))
    assert problems["manifest.json"].startswith("damaged: ")
    for words in (("list",), ("show", run.hash12)):
        said = evoexp(*words)
        assert said.code == 0 and "Traceback" not in said.err and "\x1b" not in said.out


def test_what_is_no_archive_is_refused(refused: Callable[..., str], tmp_path: Path) -> None:
    (tmp_path / "bad.tar").write_bytes(b"nothing")
    (tmp_path / "folder.tar").mkdir()
    faults = {"bad": "no archive of runs", "none": "no such file", "folder": "is a directory"}
    for name, fault in faults.items():
        path = str(tmp_path / f"{name}.tar")
        for command in ("show", "list", "verify", "reproduce", "report", "compare"):
            assert f"{path}: " in (said := refused(command, path)) and fault in said
        assert fault in refused("diff", "4da921", f"{path}:4da921")
    assert "list: must be given an archive of runs, RUNS.tar, was '4da921'" in refused(
        "list", "4da921"
    )


def test_clean_deletes_what_it_lists_and_only_if_told_so(
    evoexp: Evoexp, run: RunDirectory, stored: Path
) -> None:
    rubbish = {
        "temporary": run.replicates / ".0007.mcap.12345.tmp",
        "damaged": run.replicates / "0001.mcap.damaged",
        "failed": run.replicates / "0009.failed.json",
        "empty": stored / "runs" / "0123456789ab",
    }
    whole = content(stored)
    rubbish["empty"].mkdir()
    (rubbish["empty"] / ".lock").touch()
    for kind in ("temporary", "damaged", "failed"):
        rubbish[kind].write_text("{}")
    before = content(stored)
    found = json.loads(evoexp("clean", "all", "--json").out)
    assert {each["kind"]: each["path"] for each in found} == {k: str(p) for k, p in rubbish.items()}
    assert content(stored) == before
    assert evoexp("clean", "--yes").code == 0
    assert [kind for kind, path in rubbish.items() if path.exists()] == ["failed"]
    assert evoexp("clean", "failed", "--yes").code == 0
    assert content(stored) == whole
    assert "nothing to delete" in evoexp("clean", "all").out


@pytest.mark.parametrize(("count", "more"), [(20, ""), (21, " (1 more than shown)")])
def test_clean_counts_what_it_does_not_show(
    evoexp: Evoexp, run: RunDirectory, count: int, more: str
) -> None:
    for k in range(count):
        (run.replicates / f".{k:04d}.mcap.1.tmp").write_text("")
    said = evoexp("clean").out
    assert f"\n{count} files or folders{more}, 0.00 MB" in said
    assert said.count(".mcap.1.tmp") == 20


def test_clean_leaves_a_run_that_is_written(evoexp: Evoexp, run: RunDirectory) -> None:
    rest = run.replicates / "0001.mcap.damaged"
    rest.write_text("")
    with run.lock():
        said = evoexp("clean", "--yes")
    assert said.code == 0 and "another process is writing it now" in said.out
    assert rest.exists()
