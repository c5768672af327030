"""Progress of a batch: a live table and bar on a terminal, plain lines in a pipe."""

import time
from collections.abc import Mapping
from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table

from evoexp.batch.jobs import Outcome
from evoexp.commands.console import add_columns

PLAIN_INTERVAL_S = 5.0  # [s] between plain lines
MOST_ROWS = 12  # conditions in the table: those that a replicate ended of last
MINUTES_FROM_S = 100.0  # [s] from which the rest is told in minutes
REFRESHED = 4  # [1/s] how often the table is drawn


class ConditionCount:
    """A condition while it runs: its counts and its best cost.

    Attributes:
        label: Its name.
        total: Replicates to run.
        done: Of these.
        failed: Of these.
        best: Least cost of those that are done.
    """

    def __init__(self, label: str, total: int) -> None:
        """Begin with nothing done."""
        self.label, self.total = label, total
        self.done = self.failed = 0
        self.best = np.inf

    def count(self, outcome: Outcome) -> None:
        """Count one replicate."""
        self.failed += outcome.failed
        self.done += not outcome.failed
        if outcome.summary is not None:
            self.best = min(self.best, outcome.summary.best_cost)


class BatchProgress:
    """Counts replicates done and failed, condition by condition, and says when the rest will be.

    The first replicate compiles or loads kernels, so that the time of the others is told by those
    that end after it.
    """

    def __init__(self, console: Console, wanted: Mapping[str, tuple[str, int]]) -> None:
        """Prepare; shown from `__enter__` to `__exit__`.

        Args:
            console: Where to show it.
            wanted: Condition's id → its label, and its replicates to run.
        """
        self._console = console
        self._counts = {key: ConditionCount(*each) for key, each in wanted.items()}
        self._total = sum(each.total for each in self._counts.values())
        self._last_line = time.monotonic()
        self._first: float | None = None  # when the first replicate had ended
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[failed]} failed"),
            TimeElapsedColumn(),
            TextColumn("ETA {task.fields[eta]}"),
            console=console,
        )
        self._task = self._bar.add_task("replicates", total=self._total, failed=0, eta="–")
        self._live = Live(console=console, get_renderable=self._shown, refresh_per_second=REFRESHED)

    def __enter__(self) -> Self:
        """Show it."""
        if self._console.is_terminal:
            try:
                self._live.start()
            except BaseException:  # interrupted: nobody else would give the terminal back
                self._live.stop()
                raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave its last state."""
        if self._console.is_terminal:
            self._live.stop()
        elif self._ended:
            self._plain()

    @property
    def _done(self) -> int:
        return sum(each.done for each in self._counts.values())

    @property
    def _failed(self) -> int:
        return sum(each.failed for each in self._counts.values())

    @property
    def _ended(self) -> int:
        return self._done + self._failed

    def advance(self, outcome: Outcome) -> None:
        """Count one replicate."""
        own = self._counts.pop(outcome.condition_id)
        self._counts[outcome.condition_id] = own  # the last one of all
        own.count(outcome)
        now = time.monotonic()
        if self._first is None:
            self._first = now
        self._bar.update(self._task, advance=1, failed=self._failed, eta=self._eta())
        if not self._console.is_terminal and now - self._last_line >= PLAIN_INTERVAL_S:
            self._last_line = now
            self._plain()

    def _shown(self) -> Group:
        table = Table(box=None, pad_edge=False)
        add_columns(table, "condition")
        add_columns(table, "done", "failed", "best cost", right=True)
        last = [each for each in self._counts.values() if each.done or each.failed]
        for each in last[-MOST_ROWS:]:
            best = f"{each.best:.4g}" if np.isfinite(each.best) else "–"
            table.add_row(each.label, f"{each.done} of {each.total}", str(each.failed), best)
        return Group(*([table] if last else []), self._bar.get_renderable())

    def _plain(self) -> None:
        text = (
            f"replicates: {self._done} of {self._total} done, {self._failed} failed, ETA "
            f"{self._eta()}"
        )
        self._console.print(text, soft_wrap=True)

    def _eta(self) -> str:
        left, after_first = self._total - self._ended, self._ended - 1
        if left == 0:
            return "0 s"
        if self._first is None or after_first < 1:
            return "–"
        seconds = (time.monotonic() - self._first) / after_first * left
        return f"{seconds / 60:.0f} min" if seconds >= MINUTES_FROM_S else f"{seconds:.0f} s"
