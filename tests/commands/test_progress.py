"""Progress of a batch: condition by condition on a terminal, lines in a pipe."""

import io
from collections.abc import Callable, Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from evoexp.batch import live_curves
from evoexp.batch.jobs import Outcome
from evoexp.batch.live_curves import NUM_POINTS, CurveFile, read_curves
from evoexp.commands.progress import MOST_ROWS, BatchProgress, drawn
from evoexp.records import Block, Generation

WANTED = {"a": ("via-point GA", 3), "b": ("[bold]random search", 2)}


def outcome(key: str, cost: float | None) -> Outcome:
    if cost is None:
        return Outcome(key, 0, "broken", "", b"", 0.1)
    summary: Any = SimpleNamespace(best_cost=cost)
    return Outcome(key, 0, "", "", b"", 0.1, summary)


def console(is_terminal: bool) -> Console:
    settings = {"width": 120, "markup": False, "color_system": None}
    return Console(file=io.StringIO(), force_terminal=is_terminal, **settings)


def lines(of: Console) -> list[str]:
    assert isinstance(of.file, io.StringIO)
    return of.file.getvalue().splitlines()


def test_a_pipe_has_lines() -> None:
    out, clock = console(is_terminal=False), [0.0]
    progress = BatchProgress(out, WANTED, clock=lambda: clock[0])
    with progress.shown():
        for clock[0], key, cost in ((60.0, "a", 5.0), (70.0, "b", 5.0), (71.0, "a", None)):
            progress.count(outcome(key, cost))
    assert lines(out) == [
        "replicates: 1 of 5 done, 0 failed, ETA –",  # the first one compiles
        "replicates: 2 of 5 done, 0 failed, ETA 30 s",
        "replicates: 2 of 5 done, 1 failed, ETA 11 s",
    ]


def test_a_terminal_has_a_row_per_condition() -> None:
    out = console(is_terminal=True)
    progress = BatchProgress(out, WANTED)
    with progress.shown():
        for key, cost in (("a", 5.0), ("a", 3.0), ("b", None)):
            progress.count(outcome(key, cost))
    first, second, total = lines(out)[-4:-1]
    assert "via-point GA" in first and "2/3 0 failed best 3" in first
    assert "[bold]random search" in second and "1/2 1 failed" in second
    assert "replicates" in total and "3/5 1 failed" in total
    assert lines(out)[-1].endswith("\x1b[?25h"), "the cursor is given back"


def test_of_many_conditions_the_last_ones_are_shown() -> None:
    out = console(is_terminal=True)
    progress = BatchProgress(out, {str(k): (f"condition {k}", 1) for k in range(40)})
    with progress.shown():
        for k in range(40):
            progress.count(outcome(str(k), 1.0))
    shown = [line for line in lines(out)[-MOST_ROWS - 3 :] if "condition" in line]
    assert "condition 28 " in shown[0] and "condition 39 " in shown[-1]
    assert len(shown) == MOST_ROWS


# `--live`


@pytest.fixture
def heard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return what has a worker leave a curve of best costs."""
    monkeypatch.setattr(live_curves, "INTERVAL_S", 0.0)
    file, best = CurveFile(tmp_path, "b", 1), np.zeros(1)

    def hear(costs: Iterable[float]) -> None:
        for k, cost in enumerate(costs):
            numbers = (cost, cost, cost, 0.0, 1, k, k, cost < np.inf)
            file.hear(Block.of(Generation(k, best, *numbers, {}, np.array([cost]), best)))

    return hear


def test_workers_leave_curves_that_are_shown(tmp_path: Path, heard: Callable[..., None]) -> None:
    heard([np.inf, 8.0, 4.0])
    (tmp_path / "1.json").write_text("half a fi")
    (curve,) = read_curves(tmp_path)
    out = console(is_terminal=True)
    progress = BatchProgress(out, WANTED, tmp_path)
    with progress.shown():
        progress.count(outcome("a", 5.0))
    (row,) = [line for line in lines(out)[-4:] if "random search" in line]
    assert f"{curve.generation} {drawn(curve.costs)}" in row


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


@pytest.mark.parametrize("last", [0, 40, NUM_POINTS - 1, NUM_POINTS, 1000])
def test_curves_are_thinned_with_both_ends(
    tmp_path: Path, heard: Callable[..., None], last: int
) -> None:
    heard(map(float, range(last + 1)))
    (curve,) = read_curves(tmp_path)
    assert len(curve.costs) == min(last + 1, NUM_POINTS)
    assert (curve.costs[0], curve.costs[-1]) == (0.0, float(last))
    assert curve.costs == sorted(set(curve.costs))
