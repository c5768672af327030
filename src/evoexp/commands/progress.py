"""Progress of a batch: a live bar on a terminal, plain lines in a pipe."""

import time
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)

PLAIN_INTERVAL_S = 5.0  # [s] between plain lines


class BatchProgress:
    """Counts replicates done and failed, and says when the rest will be."""

    def __init__(self, console: Console, total: int) -> None:
        """Prepare; shown from `__enter__` to `__exit__`.

        Args:
            console: Where to show it.
            total: Replicates to run.
        """
        self._console, self._total = console, total
        self._done = self._failed = 0
        self._start = self._last_line = time.monotonic()
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[failed]} failed"),
            TimeElapsedColumn(),
            TextColumn("ETA {task.fields[eta]}"),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("replicates", total=total, failed=0, eta="–")

    def __enter__(self) -> Self:
        """Show it."""
        try:
            self._bar.start()
        except BaseException:  # interrupted: nobody else would give the terminal back
            self._bar.stop()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave its last state."""
        self._bar.stop()
        if not self._console.is_terminal and self._done + self._failed:
            self._plain()

    def advance(self, failed: bool) -> None:
        """Count one replicate."""
        self._failed += failed
        self._done += not failed
        self._bar.update(self._task, advance=1, failed=self._failed, eta=self._eta())
        now = time.monotonic()
        if not self._console.is_terminal and now - self._last_line >= PLAIN_INTERVAL_S:
            self._last_line = now
            self._plain()

    def _plain(self) -> None:
        text = (
            f"replicates: {self._done} of {self._total} done, {self._failed} failed, ETA "
            f"{self._eta()}"
        )
        self._console.print(text, soft_wrap=True)

    def _eta(self) -> str:
        ended = self._done + self._failed
        seconds = (time.monotonic() - self._start) / ended * (self._total - ended)
        return f"{seconds / 60:.0f} min" if seconds >= 100 else f"{seconds:.0f} s"
