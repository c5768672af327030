"""`evoexp run`: the missing replicates of an experiment, their progress, then its report."""

import argparse
import contextlib
import functools
import hashlib
import importlib.util
import re
import shlex
import sys
import tempfile
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import progress
from rich.console import Console, RenderableType
from rich.table import Table

from evoexp.batch.jobs import Curve, Outcome, read_curves
from evoexp.batch.runner import Batch
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.commands.command_parser import option_words
from evoexp.commands.console import hash_column, new_table, plain_console, right, say, say_each
from evoexp.commands.list_ import run_row, run_table
from evoexp.configuration import compose
from evoexp.configuration.experiment import Built, Experiment, Labelled
from evoexp.configuration.overrides import SWEEP
from evoexp.configuration.search_path import folders, options
from evoexp.errors import SettingError, printable
from evoexp.registry import COMPONENTS, lacking, registrations
from evoexp.report.report_settings import page_registration
from evoexp.store.identity import environment
from evoexp.store.run_directory import RunDirectory, outputs_root

if TYPE_CHECKING:
    from evoexp.report.pages.searched import Trial

USAGE = """evoexp: experiment: must be chosen, as in
  evoexp run experiment=rana_planar budget=smoke    # two short runs of each condition, in seconds
  evoexp list                                       # all {number} experiments, and stored runs"""
DRAWN_FROM = ".drawn_from"  # in a report's folder: a hash of all that it was drawn from
PLAIN_INTERVAL_S = 5.0  # [s] between plain lines
MOST_ROWS = 12  # conditions on the screen: those that a replicate ended of last
MINUTES_FROM_S = 100.0  # [s] from which the rest is told in minutes
SPEED_OVER_S = 3600.0  # [s] of the past from which the rest is estimated
CURVE_WIDTH = 16  # characters of a curve
LEVELS, PLAIN_LEVELS = "▁▂▃▄▅▆▇█", "_.-=+*%#"  # from the least to the largest cost
UNSOLVED = "x"
LIVE_NOTE = (
    "convergence: best cost so far of the replicate heard last, from its first generation to the "
    f"one shown, each between its own extremes; {UNSOLVED}: nothing solved yet"
)


def main(arguments: argparse.Namespace) -> int:
    """Run; exit code 1 if a replicate failed."""
    if not arguments.overrides:
        print(USAGE.format(number=len(options("experiment"))), file=sys.stderr)
        return 2
    experiments = compose.expand(
        arguments.overrides, multirun=arguments.multirun, only=arguments.only
    )
    for experiment in experiments:
        page_registration(experiment.report)  # refuses an unknown page before anything is run
    runner = experiments[0].runner
    if arguments.live and runner.backend != "loky":
        raise SettingError("--live", "a run on this machine: runner.backend=loky", runner.backend)
    with contextlib.ExitStack() as stack:
        curves = None
        if arguments.live:
            folder = tempfile.TemporaryDirectory(prefix="evoexp-", ignore_cleanup_errors=True)
            curves = Path(stack.enter_context(folder))
        runs = Runs(arguments, runner, curves)
        searched = [each for each in experiments if each.search is not None]
        plain = [each for each in experiments if each.search is None]
        if plain:
            runs.complete([(each, arguments.overrides) for each in plain])
        for experiment in searched:
            run_trials(experiment, runs, arguments.overrides)
    if searched:  # the conditions are those of all trials now
        experiments = compose.expand(
            arguments.overrides, multirun=arguments.multirun, only=arguments.only
        )
    if runs.num_left:
        left = runs.num_left
        which = f"{left} replicates failed before" if left > 1 else "1 replicate failed before"
        say(f"{which}: evoexp list --failed; run again with --retry-failed")
    try:
        _show(experiments, arguments)
    finally:
        if runs.failures:
            say(_failure_table(runs.failures))
    return 1 if runs.failures or runs.num_left else 0


class Runs:
    """Runs what is missing of experiments; counts what failed."""

    def __init__(
        self, arguments: argparse.Namespace, runner: RunnerSettings, curves: Path | None
    ) -> None:
        self.failures: list[Outcome] = []
        self.num_left = 0  # replicates that failed before and are not run again
        self._arguments, self._runner, self._curves = arguments, runner, curves

    def complete(
        self, asked: Sequence[tuple[Experiment, Sequence[str]]], *, told: bool = True
    ) -> None:
        """Run the missing replicates of experiments, each asked for by its overrides.

        Not `told`, it leaves no line behind.
        """
        again = option_words(self._arguments)
        wanted = [
            (
                each,
                each.num_replicates(experiment.num_replicates),
                experiment.origin(label, command),
            )
            for experiment, overrides in asked
            for command in (shlex.join(["evoexp", "run", *overrides, *again]),)
            for label, each in _that_can_run(experiment)
        ]
        settings, retry = (self._runner, outputs_root()), self._arguments.retry_failed
        batch = Batch(wanted, *settings, retry_failed=retry, curves=self._curves)
        batch.prepare()
        self.num_left += batch.num_left_failed
        if not batch.jobs:
            if batch.is_damaged:
                deque(batch.run(), maxlen=0)  # mends what is no replicate
            if told and not batch.num_left_failed:
                say("nothing to run: every replicate is there")
            return
        planned = sorted({count for _, count, _ in wanted})
        if told:
            counts = " or ".join(map(str, planned))
            say(f"replicates of each condition, fixed before they run: {counts}")
        counted = Counter(job.condition_id for job in batch.jobs)
        labels = {condition.id: notes["label"] for condition, _, notes in wanted}
        missing = {key: (labels[key], counted[key]) for key in counted}
        bars = BatchProgress(plain_console(), missing, self._curves, told=told)
        with bars.shown(), contextlib.closing(batch.run()) as outcomes:
            for outcome in outcomes:
                bars.count(outcome)
                if outcome.reason:
                    self.failures.append(outcome)
                    failed = f"failed: {outcome.condition_id[:12]} #{outcome.replicate}"
                    print(f"{failed}: {printable(outcome.reason)}", file=sys.stderr)


def run_trials(experiment: Experiment, runs: Runs, overrides: Sequence[str]) -> None:
    """Run the missing trials of an experiment's search; say how each one did."""
    search = experiment.search
    if search is None:
        return
    fixed = [
        word
        for word in overrides
        if word.partition("=")[0] not in search.space and not re.match(rf"{SWEEP}[.=]", word)
    ]

    def asked_for(trial: "Trial", conditions: dict[str, Built]) -> tuple[Experiment, list[str]]:
        return experiment.of(conditions), [*fixed, *typed(trial)]

    with search.held():
        stored = (asked_for(*each) for each in search.stored)
        runs.complete([(experiment.of(search.base), fixed), *stored])
        best, total = search.best(), search.settings.num_trials
        while asked := search.ask():
            if taken := [each for each in asked if not each.refusal]:
                runs.complete(
                    [asked_for(each.trial, each.conditions) for each in taken], told=False
                )
            for each in asked:
                told = f"refused: {each.refusal}"
                if not each.refusal:
                    score = search.tell(each)
                    best = min(best, score)
                    told = f"score {score:.4g}, best {best:.4g}"
                say(f"trial {each.trial.number} of {total}: {told} · {' '.join(typed(each.trial))}")


def typed(trial: "Trial") -> list[str]:
    """Return the settings of a trial as one types them."""
    return [f"{key}={text}" for key, text in trial.settings.items()]


def _that_can_run(experiment: Experiment) -> list[Labelled]:
    lacks = {c.label: lacking(c.condition.to_json()) for c in experiment.conditions}
    for label, what in lacks.items():
        if what:
            say(f"skipped: {label}: {what}")
    if all(lacks.values()):
        raise SettingError("planner", f"one that is installed: {next(iter(lacks.values()))}", "it")
    return [each for each in experiment.conditions if not lacks[each.label]]


def _show(experiments: Sequence[Experiment], arguments: argparse.Namespace) -> None:
    """Print the table of every experiment and the place of its report, drawn where it must be."""
    if arguments.no_report:
        for experiment in experiments:
            say(summary_table(experiment))
        return
    packages = {each.module.partition(".")[0] for each in registrations(COMPONENTS)}
    specs = filter(None, map(importlib.util.find_spec, packages))
    code = [Path(place) for spec in specs for place in spec.submodule_search_locations or ()]
    sources = _stamps([*code, *(folder.path for folder in folders()), outputs_root() / "runs"])

    def drawn(experiment: Experiment) -> str:
        say(summary_table(experiment))
        asked = arguments.overrides, option_words(arguments)
        directory = outputs_root() / "reports" / experiment.report_name
        note = directory / DRAWN_FROM
        if note.exists() and note.read_text() == _drawn_from(experiment, asked, sources, directory):
            return f"{directory / 'index.html'} (as it was)"
        from evoexp.commands.report import request_of  # pandas, where there is no need

        page = request_of(experiment, *asked).write(outputs_root())
        note.write_text(_drawn_from(experiment, asked, sources, directory))
        return str(page)

    say_each(functools.partial(drawn, experiment) for experiment in experiments)


def _drawn_from(experiment: Experiment, asked: Any, sources: str, directory: Path) -> str:
    conditions = [(label, condition.id) for label, condition in experiment.conditions]
    settings = (experiment.num_replicates, experiment.report, environment()["versions"])
    text = repr((conditions, settings, asked, sources, _stamps([directory])))
    return hashlib.sha256(text.encode()).hexdigest()


def _stamps(roots: Iterable[Path]) -> str:
    """Return a hash of paths, sizes and times of the files in folders; hidden ones do not count."""
    digest = hashlib.sha256()
    for path in sorted({path for root in roots for path in root.rglob("[!.]*")}):
        if path.is_file() and path.suffix != ".pyc":
            status = path.stat()
            digest.update(repr((str(path), status.st_size, status.st_mtime_ns)).encode())
    return digest.hexdigest()


def summary_table(experiment: Experiment) -> Table:
    """Return a table of the conditions: replicates done, solved, certified, cost and time.

    As the report, it has all stored replicates, also those beyond the number that is asked for.
    """
    rows, caption = [], None
    for label, condition in experiment.conditions:
        run = RunDirectory(outputs_root(), condition.id)
        asked = condition.num_replicates(experiment.num_replicates)
        named = {"experiment": "", "label": label, "budget": "", "changed": False}
        rows.append(run_row(run.hash12, run) | named | {"planned": run.num_planned(asked)})
        if experiment.budget_of(label) == "smoke":
            caption = "budget=smoke shows that everything runs; its numbers decide nothing"
        if rows[-1]["planned"] > asked:
            all_of = "all that are stored, here and in the report"
            caption = f"of {experiment.num_replicates} asked for: {all_of}"
    table = run_table(experiment.report_name, rows)
    table.caption = caption
    return table


def _failure_table(failures: list[Outcome]) -> Table:
    title = f"{len(failures)} failed"
    table = new_table(title, hash_column(), *right("#"), "reason", "traceback in")
    for outcome in failures:
        run = RunDirectory(outputs_root(), outcome.condition_id)
        path = run.failure_path(outcome.replicate)
        table.add_row(outcome.condition_id[:12], str(outcome.replicate), outcome.reason, str(path))
    return table


# progress: bars by condition on a terminal, plain lines in a pipe


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
