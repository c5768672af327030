"""Progress of a batch: condition by condition on a terminal, lines in a pipe."""

import io
from types import SimpleNamespace
from typing import Any

from rich.console import Console

from evoexp.batch.jobs import Outcome
from evoexp.commands.progress import MOST_ROWS, BatchProgress

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
            progress.advance(outcome(key, cost))
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
            progress.advance(outcome(key, cost))
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
            progress.advance(outcome(str(k), 1.0))
    shown = [line for line in lines(out)[-MOST_ROWS - 3 :] if "condition" in line]
    assert "condition 28 " in shown[0] and "condition 39 " in shown[-1]
    assert len(shown) == MOST_ROWS
