"""`evoexp run`: the missing replicates of an experiment, their progress, then its report."""

import argparse
import contextlib
import functools
import hashlib
import importlib.util
import shlex
import sys
import tempfile
from collections import Counter, deque
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from evoexp.batch.jobs import Outcome
from evoexp.batch.runner import Batch
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.commands.batch_progress import BatchProgress
from evoexp.commands.command_parser import option_words
from evoexp.commands.console import hash_column, new_table, plain_console, right, say, say_each
from evoexp.commands.list_ import run_row, run_table
from evoexp.configuration import compose
from evoexp.configuration.experiment import Built, Experiment, Labelled
from evoexp.configuration.overrides import SWEEP
from evoexp.configuration.search_path import folders, options
from evoexp.errors import SettingError, demand, printable
from evoexp.numeric.cache_folder import cache_root
from evoexp.registry import COMPONENTS, lacking, registrations
from evoexp.report.report_settings import page_registration
from evoexp.store.identity import environment
from evoexp.store.run_directory import RunDirectory, outputs_root

if TYPE_CHECKING:
    from evoexp.report.pages.sweeps import Trial

USAGE = """evoexp: experiment: must be chosen, as in
  evoexp run experiment=rana_planar budget=smoke    # two short runs of each condition, in seconds
  evoexp list                                       # all {number} experiments, and stored runs"""
ADDRESS = "runner.address="  # of a machine: no stored command tells it
DRAWN_FROM = ".drawn_from"  # in a report's folder: a hash of all that it was drawn from


def main(arguments: argparse.Namespace) -> int:
    """Run; exit code 1 if a replicate failed."""
    if not arguments.overrides:
        print(USAGE.format(number=len(options("experiment"))), file=sys.stderr)
        return 2
    asked: Any = {"multirun": arguments.multirun, "only": arguments.only}
    experiments = compose.expand(arguments.overrides, **asked)
    for experiment in experiments:
        page_registration(experiment.report)  # refuses an unknown page before anything is run
    runner = experiments[0].runner
    is_local = runner.backend == "loky" or not arguments.live
    demand(is_local, "--live", "a run on this machine: runner.backend=loky", runner.backend)
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
        experiments = compose.expand(arguments.overrides, **asked)
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

        Not `told`, it leaves no line on replicates behind.
        """
        again, wanted = option_words(self._arguments), []
        for experiment, overrides in asked:
            words = [word for word in overrides if not word.startswith(ADDRESS)]
            command = shlex.join(["evoexp", "run", *words, *again])
            for label, each in _that_can_run(experiment):
                count = each.num_replicates(experiment.num_replicates)
                wanted.append((each, count, experiment.origin(label, command)))
        settings, retry = (self._runner, outputs_root()), self._arguments.retry_failed
        batch = Batch(wanted, *settings, retry_failed=retry, curves=self._curves)
        if batch.jobs and not any((cache_root() / "kernels").glob("*/*/*")):
            say("kernels are compiled first: some minutes, once on this machine")
        batch.prepare()
        self.num_left += batch.num_left_failed
        if not batch.jobs:
            if batch.is_damaged:
                deque(batch.run(), maxlen=0)  # mends what is no replicate
            if told and not batch.num_left_failed:
                say("nothing to run: every replicate is stored")
            return
        planned = sorted({count for _, count, _ in wanted})
        if told:
            counts = " or ".join(map(str, planned))
            say(f"replicates of each condition, fixed before they run: {counts}")
        counted = Counter(job.condition_id for job in batch.jobs)
        missing = {
            c.id: (notes["label"], counted[c.id]) for c, _, notes in wanted if c.id in counted
        }
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
    kept = [each for each in map(compose.parse, overrides) if each.key not in search.space]
    fixed = [override.text for override in kept if override.root != SWEEP]
    fixed += ["-m"] * any(override.is_swept for override in kept)

    def typed(trial: "Trial") -> list[str]:
        settings = trial.settings.items()
        return [f"{search.space[key].prefix}{key}={text}" for key, text in settings]

    def asked_for(trial: "Trial", conditions: dict[str, Built]) -> tuple[Experiment, list[str]]:
        return experiment.of(conditions), [*fixed, *typed(trial)]

    with search.held():
        stored = (asked_for(*each) for each in search.stored)
        runs.complete([(experiment.of(search.base), fixed), *stored], told=False)
        best, total = search.score(), search.settings.num_trials
        say(f"trial 0 of {total}: score {best:.4g} · the experiment as it is")
        best = min([best, *search.scores])
        while asked := search.ask():
            told = f"refused: {asked.refusal}"
            if not asked.refusal:
                runs.complete([asked_for(asked.trial, asked.conditions)], told=False)
                score = search.score(asked)
                best = min(best, score)
                told = f"score {score:.4g}, best {best:.4g}"
            say(f"trial {asked.trial.number} of {total}: {told} · {' '.join(typed(asked.trial))}")
        if (count := len(search.finished)) < total:
            say(f"trial {count} of {total} is the last: no other combination of values is left")


def _that_can_run(experiment: Experiment) -> list[Labelled]:
    lacks = {c.label: lacking(c.condition.to_json()) for c in experiment.conditions}
    for label, what in lacks.items():
        if what:
            say(f"skipped: {label}: {what}")
    if all(lacks.values()):
        raise SettingError("planner", f"one that is installed: {what}", label)
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
            return f"{directory / 'index.html'} (unchanged)"
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

    As the report, it has all stored replicates, also those beyond the number that is asked for. Of
    a search it has the experiment as it is and the best trial.
    """
    rows, caption = [], None
    if experiment.search is not None:
        experiment = experiment.of(experiment.search.best_conditions)
    for label, condition in experiment.conditions:
        run = RunDirectory(outputs_root(), condition.id)
        asked = condition.num_replicates(experiment.num_replicates)
        named = {"experiment": "", "label": label, "budget": "", "changed": False}
        rows.append(run_row(run.hash12, run) | named | {"planned": run.num_planned(asked)})
        if experiment.budget_of(label) == "smoke":
            caption = "budget=smoke checks that everything runs; nothing can be concluded from it"
        if rows[-1]["planned"] > asked:
            count_all = "more are stored, and all count, here and in the report"
            caption = f"asked for: {experiment.num_replicates} of each; {count_all}"
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
