"""`evoexp list` and `evoexp show`.

What is stored, what is shipped, what failed, what is damaged.
"""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import SMALL, Evoexp

from evoexp import shipped
from evoexp.configuration import compose
from evoexp.configuration.search_path import description, options
from evoexp.shipped import Shipped
from evoexp.store.run_directory import RunDirectory
from evoexp.store.tables import read_summaries
from shipped_conditions import expanded
from store_lookup import find_runs

PLANAR = ("experiment=rana_planar", *SMALL)


@pytest.fixture(params=[80, 140])
def width(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setenv("COLUMNS", str(request.param))
    return int(request.param)


def cells(out: str) -> dict[str, list[str]]:
    """Return hash → the other cells of the first line of its row."""
    rows = [
        [cell.strip() for cell in line.strip("│").split("│")]
        for line in out.splitlines()
        if line.startswith("│")
    ]
    return {row[0]: row[1:] for row in rows if re.fullmatch("[0-9a-f]{12}", row[0])}


def test_without_runs(evoexp: Evoexp, outputs: Path) -> None:
    said = evoexp("list")
    assert said.code == 0
    assert f"no runs stored in {outputs}" in said.out
    for name in options("experiment"):
        assert f"│ {name} " in said.out
        assert description(name).split(" ")[0] in said.out
    assert not outputs.exists()


def test_stored_runs(evoexp: Evoexp, stored: Path, width: int) -> None:
    runs = find_runs(stored)
    runs[0].write_failure(7, "ArithmeticError: [/] is told to fail", "Traceback …")
    said = evoexp("list")
    assert said.code == 0
    assert "…" not in said.out
    assert max(map(len, said.out.splitlines())) <= width
    rows = cells(said.out)
    assert list(rows) == [run.hash12 for run in runs]
    assert [row[1:3] for row in rows.values()] == [["2", "1"], ["2", "0"], ["2", "0"]]
    assert "(changed)" in said.out
    assert "via-point" in said.out


@pytest.mark.examples(1)
@pytest.mark.parametrize("name", ["rana_planar", "rana", "rana_planar_ablations"])
def test_a_condition_that_experiments_share_is_named_as_it_was_run(
    name: str, evoexp: Evoexp, outputs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    label, condition = expanded(name, "paper").conditions[0]
    RunDirectory(outputs, condition.id).create(
        condition.to_json(), {"experiment": name, "label": label}
    )
    assert cells(evoexp("list").out)[condition.id[:12]][0] == f"{name}, {label}, paper"


def test_damaged_runs_are_listed_beside_the_others(
    evoexp: Evoexp, stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    condition = (
        compose.expand(["experiment=rana_planar", "budget=smoke", "seed=5"])[0]
        .conditions[0]
        .condition
    )
    first, second, third = find_runs(stored)
    without_manifest = RunDirectory(stored, condition.id)
    without_manifest.create(condition.to_json(), {})
    (without_manifest.path / "manifest.json").unlink()
    (first.path / "config.json").write_text("{}")
    log = second.log_path(1)
    log.write_bytes(log.read_bytes()[:-10])
    (stored / "runs/0123456789ab").mkdir()  # made, and killed before anything was written
    (stored / "runs/notes").mkdir()
    said = evoexp("list")
    assert said.code == 0
    rows = cells(said.out)
    assert list(rows) == sorted(
        [first.hash12, second.hash12, third.hash12, without_manifest.hash12]
    )
    assert rows[first.hash12][1:3] == ["2", "0"], "its logs know what it is"
    assert rows[second.hash12][1:3] == ["1", "0"]
    assert rows[without_manifest.hash12] == ["(no manifest)", "0", "0", "0", "–"]
    assert (
        "config.json (damaged: its hash 44136fa355b3 is not the directory's name)"
        in rows[first.hash12][0]
    )
    assert "0001.mcap (cut" in rows[second.hash12][0]
    assert "0001.mcap (cut" in said.err


def test_show(evoexp: Evoexp, stored: Path, width: int) -> None:
    for run in find_runs(stored):
        run.write_failure(7, "ArithmeticError: [/] is told to fail", "Traceback …")
        said = evoexp("show", run.condition_id[:5].upper(), "--all")
        assert said.code == 0
        assert said.out.startswith(f"condition    {run.condition_id}\n")
        assert "population_size: 8" in said.out
        assert "  label: " in said.out
        assert "command: evoexp run experiment=rana_planar budget=smoke" in said.out
        lines = said.out.splitlines()
        begin = next(k for k, line in enumerate(lines) if line.startswith("replicates in"))
        table = lines[begin + 1 : lines.index("manifest:")]
        assert max(map(len, table)) <= width
        flat = re.sub(r"[\s│]+", "", "".join(table))
        assert "7failed–––" in flat and "ArithmeticError" in flat
        assert "…" not in "".join(table)


def test_digests_are_whole(evoexp: Evoexp, stored: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "140")
    run = find_runs(stored)[0]
    out = evoexp("show", run.hash12, "--all").out
    assert all(digest in out for digest in read_summaries(run)["digest"])


def test_a_pipe_gets_wide_tables(
    evoexp: Evoexp, stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    lines = [line for line in evoexp("list").out.splitlines() if "rana_planar, " in line]
    assert len(lines) == 3
    assert all("paper" in line for line in lines), "a row is a line, for grep"


@pytest.fixture
def one_shipped(monkeypatch: pytest.MonkeyPatch) -> Shipped:
    condition = (
        compose.expand(["experiment=rana_planar", "budget=smoke"])[0].conditions[1].condition
    )
    row = Shipped("rana_planar", "random search", "smoke", condition.id, "0" * 32)
    monkeypatch.setattr(shipped, "shipped", lambda: (row,))
    return row


@pytest.mark.usefixtures("wide_terminal")
def test_a_shipped_condition_that_never_ran_here(
    evoexp: Evoexp, outputs: Path, one_shipped: Shipped
) -> None:
    said = evoexp("show", one_shipped.condition_id[:6])
    assert said.code == 0
    assert said.out.startswith(
        f"condition    {one_shipped.condition_id}\nshipped as   rana_planar, random search, smoke\n"
    )
    assert (
        "not run here; run it: evoexp run experiment=rana_planar budget=smoke --only 'random "
        "search'\n" in said.out
    )
    assert "\ncontrol      random_search()\n" in said.out
    assert not outputs.exists()


def test_an_ambiguous_shipped_hash_lists_the_candidates(
    refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = tuple(Shipped("rana_planar", k, "smoke", f"abc{k}" * 16, "0" * 32) for k in "01")
    monkeypatch.setattr(shipped, "shipped", lambda: rows)
    for command in ("show", "reproduce"):
        assert refused(command, "abc") == "hash: 'abc' is ambiguous: abc0abc0abc0, abc1abc1abc1"


@pytest.mark.usefixtures("wide_terminal")
def test_show_says_what_the_chromosomes_length_violates(evoexp: Evoexp, outputs: Path) -> None:
    condition = (
        compose.expand(["experiment=curkovic_methods"], only=["V"])[0].conditions[0].condition
    )
    said = evoexp("show", condition.id[:12])
    assert said.code == 0
    assert not outputs.exists()
    assert "robot 1: Eq. 2 allows steps of 5.73 and 11.46 deg (printed: 11.5 and 23)" in said.out
    assert (
        "robot 2: Eq. 3 asks for L = 42 here (120 deg), for L = 64 over 180 deg (printed: 32)"
        in said.out
    )
    assert (
        "L = 8 (K = 4) takes steps of 24.00 deg at best, which violates it 4.19 times over"
        in said.out
    )
