"""Progress of a batch: bars by condition on a terminal, plain lines in a pipe."""

import contextlib
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from rich import progress
from rich.console import Console, RenderableType

from evoexp.batch.jobs import Curve, Outcome, read_curves

PLAIN_INTERVAL_S = 5.0  # [s] between plain lines
MOST_ROWS = 12  # conditions on the screen: those that a replicate ended of last
MINUTES_FROM_S = 100.0  # [s] from which the rest is told in minutes
SPEED_OVER_S = 3600.0  # [s] of the past from which the rest is estimated
CURVE_WIDTH = 16  # characters of a curve
LEVELS, PLAIN_LEVELS = "▁▂▃▄▅▆▇█", "_.-=+*%#"  # from the least to the largest cost
UNSOLVED = "x"
LIVE_NOTE = (
    "convergence: best cost so far of the replicate that reported last, from its first generation "
    f"to the one shown, scaled to its own range; {UNSOLVED}: nothing solved yet"
)


class BatchProgress(progress.Progress):
    """Counts replicates done and failed, condition by condition, and says when the rest will be."""

    _curves: Path | None = None

    def __init__(
        self,
        console: Console,
        wanted: Mapping[str, tuple[str, int]],
        curves: Path | None = None,
        clock: Callable[[], float] = time.monotonic,
        *,
        told: bool = True,
    ) -> None:
        """Prepare; shown inside `shown`.

        Args:
            wanted: Condition's id → its label, and its replicates to run.
            curves: Folder in which workers leave the convergence of what they run; None: not shown.
            clock: Returns the time [s].
            told: Whether the last state stays.
        """
        texts = ["{task.fields[failed]} failed", "{task.fields[best]}"]
        texts += ["{task.fields[curve]}"] if curves is not None else []
        super().__init__(
            progress.TextColumn("{task.description}", markup=False),
            progress.BarColumn(bar_width=10),
            progress.MofNCompleteColumn(),
            *(progress.TextColumn(text, markup=False) for text in texts),
            progress.TimeRemainingColumn(),
            console=console,
            get_time=clock,
            speed_estimate_period=SPEED_OVER_S,
            transient=not told,
        )
        self._curves, self._last_line, self._told = curves, clock(), told
        self._rows = {
            key: self.add_task(label, total=total, visible=False, failed=0, best="", curve="")
            for key, (label, total) in wanted.items()
        }
        total = sum(total for _, total in wanted.values())
        self._all = self.add_task("replicates", total=total, failed=0, best="", curve="")
        self._best = dict.fromkeys(wanted, np.inf)
        self._failed = dict.fromkeys(wanted, 0)
        self._known: dict[str, Curve] = {}
        self._last_shown: dict[str, None] = {}  # conditions on the screen, the newest last

    @contextlib.contextmanager
    def shown(self) -> Iterator[None]:
        """Show it while the body runs."""
        if not self.console.is_terminal:
            try:
                yield
            finally:
                if self._told and self.tasks[-1].completed:
                    self._say()
            return
        if self._curves is not None:
            self.console.print(LIVE_NOTE)
        try:
            with self:
                yield
        finally:
            self.console.show_cursor(True)  # also where the end was interrupted

    def count(self, outcome: Outcome) -> None:
        """Count one replicate."""
        key = outcome.condition_id
        self._failed[key] += bool(outcome.reason)
        if outcome.summary is not None:
            self._best[key] = min(self._best[key], outcome.summary.best_cost)
        best = f"best {self._best[key]:.4g}" if np.isfinite(self._best[key]) else ""
        self._show_row(key)
        self.update(self._rows[key], advance=1, failed=self._failed[key], best=best)
        self.update(self._all, advance=1, failed=sum(self._failed.values()))
        now = self.get_time()
        is_told = self._told and not self.console.is_terminal
        if is_told and now - self._last_line >= PLAIN_INTERVAL_S:
            self._last_line = now
            self._say()

    def _show_row(self, key: str) -> None:
        """Show a condition; the one that nothing was heard of for the longest time makes room."""
        self._last_shown.pop(key, None)
        self._last_shown[key] = None
        self.update(self._rows[key], visible=True)
        if len(self._last_shown) > MOST_ROWS:
            oldest = next(iter(self._last_shown))
            del self._last_shown[oldest]
            self.update(self._rows[oldest], visible=False)

    def get_renderables(self) -> Iterable[RenderableType]:
        """Return the bars, with the curves that the workers left."""
        for curve in [] if self._curves is None else read_curves(self._curves):
            levels = LEVELS if self.console.encoding.startswith("utf") else PLAIN_LEVELS
            key = curve.condition_id
            if key in self._rows and self._known.get(key) != curve:
                self._known[key] = curve
                self._show_row(key)
                text = f"{curve.generation} {drawn(curve.costs, levels)}"
                self.update(self._rows[key], curve=text)
        return super().get_renderables()

    def _say(self) -> None:
        total, failed = self.tasks[-1], sum(self._failed.values())
        done, seconds = int(total.completed) - failed, total.time_remaining
        rest = "–" if seconds is None else f"{seconds:.0f} s"
        if seconds is not None and seconds >= MINUTES_FROM_S:
            rest = f"{seconds / 60:.0f} min"
        text = f"replicates: {done} of {total.total:.0f} done, {failed} failed, ETA {rest}"
        self.console.print(text, soft_wrap=True)


def drawn(costs: Sequence[float], levels: str = LEVELS, width: int = CURVE_WIDTH) -> str:
    """Draw costs of a replicate, the first and the last included, by levels from least to most."""
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
