"""Progress of a batch: a live table and bar on a terminal, plain lines in a pipe."""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)

from evoexp.batch.jobs import Outcome
from evoexp.batch.live_curves import Curve, read_curves
from evoexp.commands.console import add_columns, table_without_lines
from evoexp.commands.word_tables import WordTable

PLAIN_INTERVAL_S = 5.0  # [s] between plain lines
MOST_ROWS = 12  # conditions in the table: those that a replicate ended of last
MINUTES_FROM_S = 100.0  # [s] from which the rest is told in minutes
BURST_S = 0.1  # [s] replicates that end so soon after the first one came with it, in one task
SHOWN_CURSOR = "\x1b[?25h"
REFRESHED = 4  # [1/s] how often the table is drawn
CURVE_WIDTH, NARROW_CURVE_WIDTH = 16, 11  # characters of a curve; where a terminal is narrow
LEVELS, PLAIN_LEVELS = "▁▂▃▄▅▆▇█", "_.-=+*%#"  # from the least to the largest cost
UNSOLVED = "x"
LIVE_NOTE = (
    "convergence: best cost so far of the replicate heard last, from its first generation to the "
    f"one shown, each between its own extremes; {UNSOLVED}: nothing solved yet"
)


class ConditionCount:
    """A condition while it runs: its counts and its best cost.

    Attributes:
        place: Its row among those that are shown.
        label: Its name.
        total: Replicates to run.
        done: Of these.
        failed: Of these.
        best: Least cost of those that are done.
        curve: Of one that is running, or was; None: nothing is known.
        first_end: When the first of its replicates ended [s]; None: none has.
    """

    def __init__(self, place: int, label: str, total: int) -> None:
        """Begin with nothing done."""
        self.place, self.label, self.total = place, label, total
        self.done = self.failed = 0
        self.best = np.inf
        self.curve: Curve | None = None
        self.first_end: float | None = None

    def count(self, outcome: Outcome) -> None:
        """Count one replicate."""
        self.failed += outcome.failed
        self.done += not outcome.failed
        if outcome.summary is not None:
            self.best = min(self.best, outcome.summary.best_cost)


class BatchProgress:
    """Counts replicates done and failed, condition by condition, and says when the rest will be.

    The first replicate of a condition compiles or loads kernels, so that the time of the others is
    told by those that end after it.
    """

    def __init__(
        self,
        console: Console,
        wanted: Mapping[str, tuple[str, int]],
        curves: Path | None = None,
    ) -> None:
        """Prepare; shown from `__enter__` to `__exit__`.

        Args:
            console: Where to show it.
            wanted: Condition's id → its label, and its replicates to run.
            curves: Folder in which workers leave the convergence of what they run; None: it is not
                shown.
        """
        self._console, self._curves = console, curves
        self._counts = {
            key: ConditionCount(place, *each) for place, (key, each) in enumerate(wanted.items())
        }
        self._total = sum(each.total for each in self._counts.values())
        self._done = self._failed = 0
        self._last_line = time.monotonic()
        self._first: tuple[float, int] | None = None  # when the first had ended, and how many
        self._last_end = self._last_line  # of a replicate
        self._measured = (0.0, 0)  # [s] up to the ends of later ones of a condition, and how many
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
        """Leave its last state; where that is interrupted, too, at least the terminal."""
        if self._console.is_terminal:
            try:
                self._live.stop()
            except BaseException:
                self._live.stop()  # it may not have begun
                self._console.file.write(f"\n{SHOWN_CURSOR}")
                self._console.file.flush()
                raise
        elif self._ended:
            self._plain()

    @property
    def _ended(self) -> int:
        return self._done + self._failed

    def advance(self, outcome: Outcome) -> None:
        """Count one replicate."""
        own = self._counts.pop(outcome.condition_id)
        self._counts[outcome.condition_id] = own  # the last one of all
        own.count(outcome)
        self._failed += outcome.failed
        self._done += not outcome.failed
        now = time.monotonic()
        if own.first_end is None:
            own.first_end = now
        elif now - own.first_end >= BURST_S:
            seconds, count = self._measured
            self._measured = seconds + now - self._last_end, count + 1
        self._last_end = now
        if self._first is None or now - self._first[0] < BURST_S:
            self._first = now if self._first is None else self._first[0], self._ended
        self._bar.update(self._task, advance=1, failed=self._failed, eta=self._eta())
        if not self._console.is_terminal and now - self._last_line >= PLAIN_INTERVAL_S:
            self._last_line = now
            self._plain()

    def _shown(self) -> Group:
        self._hear()
        begun = [each for each in self._counts.values() if each.done or each.failed or each.curve]
        last = sorted(begun[-MOST_ROWS:], key=lambda one: one.place)
        table = self._table(last)
        if not table.fits(self._console):
            table = self._table(last, is_narrow=True)
        parts: list[RenderableType] = [table] if begun else []
        if begun and self._curves is not None:
            parts.append(LIVE_NOTE)
        return Group(*parts, self._bar.get_renderable())

    def _table(self, rows: Sequence[ConditionCount], *, is_narrow: bool = False) -> WordTable:
        """Return the conditions; where it is narrow, with shorter curves and fewer columns."""
        table = table_without_lines()
        add_columns(table, "condition")
        table.add_column("done", justify="right", no_wrap=not is_narrow)
        add_columns(table, "failed", "best\ncost" if is_narrow else "best cost", right=True)
        if self._curves is not None:
            if not is_narrow:
                add_columns(table, "generation", right=True)
            width = NARROW_CURVE_WIDTH if is_narrow else CURVE_WIDTH
            table.add_column("convergence", no_wrap=True, min_width=width)
        for each in rows:
            best = f"{each.best:.4g}" if np.isfinite(each.best) else "–"
            cells = [each.label, f"{each.done} of {each.total}", str(each.failed), best]
            if self._curves is not None:
                generation = str(each.curve.generation) if each.curve else "–"
                cells += [] if is_narrow else [generation]
                cells.append(self._drawn(each.curve, width) if each.curve else "")
            table.add_row(*cells)
        return table

    def _hear(self) -> None:
        """Take note of what the workers left; conditions that are running stand last."""
        for curve in [] if self._curves is None else read_curves(self._curves):
            own = self._counts.get(curve.condition_id)
            if own is not None and own.curve != curve:
                own.curve = curve
                self._counts[curve.condition_id] = self._counts.pop(curve.condition_id)

    def _drawn(self, curve: Curve, width: int) -> str:
        is_plain = not self._console.encoding.startswith("utf")
        return drawn(curve.costs, PLAIN_LEVELS if is_plain else LEVELS, width)

    def _plain(self) -> None:
        text = (
            f"replicates: {self._done} of {self._total} done, {self._failed} failed, ETA "
            f"{self._eta()}"
        )
        self._console.print(text, soft_wrap=True)

    def _eta(self) -> str:
        left = self._total - self._ended
        if left == 0:
            return "0 s"
        since, num_first = self._first or (0.0, self._ended)
        if self._ended == num_first:
            return "–"
        took, count = self._measured
        if not count:  # all were the first of a condition
            took, count = time.monotonic() - since, self._ended - num_first
        seconds = took / count * left
        return f"{seconds / 60:.0f} min" if seconds >= MINUTES_FROM_S else f"{seconds:.0f} s"


def drawn(costs: Sequence[float], levels: str = LEVELS, width: int = CURVE_WIDTH) -> str:
    """Draw costs as a line of characters.

    Args:
        costs: Of one replicate, in order.
        levels: Characters for the least to the largest of them.
        width: The most characters.

    Returns:
        The characters, with the first and the last cost.
    """
    places = np.linspace(0, len(costs) - 1, min(len(costs), width)).round().astype(int)
    shown = np.asarray(costs, dtype=np.float64)[places]
    finite = shown[np.isfinite(shown)]
    if not finite.size:
        return UNSOLVED * len(shown)
    least, extent = finite.min(), np.ptp(finite) or 1.0
    return "".join(
        levels[round((cost - least) / extent * (len(levels) - 1))]
        if np.isfinite(cost)
        else UNSOLVED
        for cost in shown
    )
