"""Progress of a batch: condition by condition on a terminal, lines in a pipe, an honest ETA."""

import io
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from evoexp.batch import live_curves
from evoexp.batch.jobs import Outcome
from evoexp.batch.live_curves import Curve, CurveFile, read_curves, thinned
from evoexp.commands import progress
from evoexp.commands.progress import BatchProgress, drawn

WANTED = {"a": ("via-point GA", 3), "b": ("[bold]random search", 2)}


def outcome(key: str, cost: float | None = None) -> Outcome:
    summary: Any = None if cost is None else SimpleNamespace(best_cost=cost)
    return Outcome(key, 0, "" if cost is not None else "broken", "", b"", 0.1, summary)


def console(is_terminal: bool, width: int = 60) -> Console:
    found = Console(
        file=io.StringIO(), force_terminal=is_terminal, width=width, markup=False, color_system=None
    )
    assert isinstance(found.file, io.StringIO)
    return found


def text(of: Console) -> str:
    assert isinstance(of.file, io.StringIO)
    return of.file.getvalue()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_a_pipe_has_lines(clock: list[float]) -> None:
    out = console(is_terminal=False)
    with BatchProgress(out, WANTED) as shown:
        for second, key in enumerate("ab"):
            clock[0] = 10.0 * (second + 1)
            shown.advance(outcome(key, 5.0))
        clock[0] = 21.0
        shown.advance(outcome("a"))
    assert text(out).splitlines() == [
        "replicates: 1 of 5 done, 0 failed, ETA –",
        "replicates: 2 of 5 done, 0 failed, ETA 30 s",
        "replicates: 2 of 5 done, 1 failed, ETA 2 s",
    ]


def test_the_first_replicate_does_not_count_for_the_rest(clock: list[float]) -> None:
    shown = BatchProgress(console(is_terminal=False), {"a": ("GA", 60)})
    clock[0] = 60.0  # kernels were compiled
    shown.advance(outcome("a", 1.0))
    shown.advance(outcome("a", 1.0))  # of the same task
    assert shown._eta() == "–"
    clock[0] = 61.0
    shown.advance(outcome("a", 1.0))
    assert shown._eta() == "57 s"


def test_nor_does_the_first_one_of_another_condition(clock: list[float]) -> None:
    shown = BatchProgress(console(is_terminal=False), {"a": ("GA", 20), "b": ("RRT", 20)})
    for clock[0], key in [(60.0, "a"), (61.0, "a"), (62.0, "a"), (100.0, "b"), (101.0, "b")]:
        shown.advance(outcome(key, 1.0))
    assert shown._eta() == "35 s"


def test_a_terminal_has_a_row_per_condition() -> None:
    out = console(is_terminal=True)
    with BatchProgress(out, WANTED) as shown:
        shown.advance(outcome("a", 5.0))
        shown.advance(outcome("a", 3.0))
        shown.advance(outcome("b"))
    last = [line.split() for line in text(out).splitlines() if "random" in line or "GA" in line]
    assert ["via-point", "GA", "2", "of", "3", "0", "3"] in last
    assert ["[bold]random", "search", "0", "of", "2", "1", "–"] in last


def test_of_many_conditions_the_last_ones_are_shown() -> None:
    out = console(is_terminal=True)
    with BatchProgress(out, {str(k): (f"condition {k}", 1) for k in range(40)}) as shown:
        for k in range(40):
            shown.advance(outcome(str(k), 1.0))
        table = shown._shown().renderables[0]
    assert table.row_count == progress.MOST_ROWS  # type: ignore[union-attr]
    assert "condition 39" in text(out)


@pytest.mark.parametrize("moment", ["clear_live", "line"])
def test_a_terminal_is_given_back_by_an_end_that_is_interrupted(
    moment: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before the last state is drawn, and between its parts."""

    def interrupted(*_: object) -> None:
        monkeypatch.undo()
        raise KeyboardInterrupt

    out = console(is_terminal=True)
    shown = BatchProgress(out, WANTED)
    with pytest.raises(KeyboardInterrupt), shown:
        monkeypatch.setattr(out, moment, interrupted)
    assert text(out).endswith(f"\n{progress.SHOWN_CURSOR}")
    assert not shown._live.is_started


# `--live`


def test_workers_leave_curves_that_are_shown(tmp_path: Path) -> None:
    file = CurveFile(tmp_path, "b", 1)
    for index, cost in enumerate([np.inf, 8.0, 4.0]):
        live_curves._written[str(tmp_path)] = 0.0  # long ago
        generation: Any = SimpleNamespace(index=index, best_cost=cost)
        file.hear(generation)
    assert read_curves(tmp_path) == [Curve("b", 1, 2, [np.inf, 8.0, 4.0])]
    (tmp_path / "1.json").write_text("half a fi")
    out = console(is_terminal=True, width=90)
    with BatchProgress(out, WANTED, tmp_path) as shown:
        shown.advance(outcome("a", 5.0))
    last = [line.split() for line in text(out).splitlines() if "random" in line or "GA" in line]
    assert last[-1] == ["[bold]random", "search", "0", "of", "2", "0", "–", "2", "x█▁"]


@pytest.mark.parametrize("width", [100, 80, 60, 48])
def test_no_word_is_broken_however_narrow_the_terminal(tmp_path: Path, width: int) -> None:
    wanted = {"a": ("no redistribution", 60), "b": ("no new trajectories", 60)}
    for key in wanted:
        file = CurveFile(tmp_path, key, 0)
        for index in range(40):
            live_curves._written[str(tmp_path)] = 0.0  # long ago
            generation: Any = SimpleNamespace(index=index, best_cost=40.0 - index)
            file.hear(generation)
        (tmp_path / f"{os.getpid()}.json").rename(tmp_path / f"{key}.json")
    out = console(is_terminal=False, width=width)
    shown = BatchProgress(out, wanted, tmp_path)
    shown.advance(outcome("a", 162.25))
    out.print(shown._shown())
    words = text(out).split()
    headers = ("condition", "done", "failed", "best", "cost", "convergence")
    for word in (*headers, "redistribution", "trajectories", "162.2", "60"):
        assert word in words
    assert max(map(len, text(out).splitlines())) <= width


@pytest.mark.parametrize(
    ("costs", "expected"),
    [
        ([3.0], "▁"),
        ([3.0, 3.0], "▁▁"),
        ([np.inf], "x"),
        ([8.0, 4.5, 1.0], "█▅▁"),
        (list(np.arange(100.0)[::-1]), "██▇▇▆▆▅▅▄▄▃▃▂▂▁▁"),
    ],
)
def test_a_curve_is_drawn_between_its_extremes(costs: list[float], expected: str) -> None:
    assert drawn(costs) == expected


def test_curves_are_thinned_with_both_ends() -> None:
    values = list(map(float, range(1001)))
    kept = thinned(values)
    assert len(kept) == live_curves.NUM_POINTS
    assert (kept[0], kept[-1], kept == sorted(set(kept))) == (0.0, 1000.0, True)
    assert thinned(values[:40]) == values[:40]
