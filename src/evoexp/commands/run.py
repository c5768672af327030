"""`evoexp run`: the missing replicates of an experiment, then its report."""

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
from typing import Any

from rich.table import Table

from evoexp.batch.jobs import Outcome
from evoexp.batch.runner import Batch
from evoexp.commands.command_parser import option_words
from evoexp.commands.console import hash_column, new_table, plain_console, right, say, say_each
from evoexp.commands.list_ import run_row, run_table
from evoexp.commands.progress import BatchProgress
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment, Labelled
from evoexp.configuration.search_path import folders, options
from evoexp.errors import SettingError, printable
from evoexp.registry import COMPONENTS, lacking, registrations
from evoexp.report.pages import page_registration
from evoexp.store.manifest import environment
from evoexp.store.run_directory import RunDirectory, outputs_root

USAGE = """evoexp: experiment: must be chosen, as in
  evoexp run experiment=rana_planar budget=smoke    # two short runs of each condition, in seconds
  evoexp list                                       # all {number} experiments, and stored runs"""
DRAWN_FROM = ".drawn_from"  # in a report's folder: a hash of all that it was drawn from


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
    command = shlex.join(["evoexp", "run", *arguments.overrides, *option_words(arguments)])
    wanted = [
        (each, each.num_replicates(experiment.num_replicates), experiment.origin(label, command))
        for experiment in experiments
        for label, each in _that_can_run(experiment)
    ]
    runner = experiments[0].runner
    if arguments.live and runner.backend != "loky":
        raise SettingError("--live", "a run on this machine: runner.backend=loky", runner.backend)
    with contextlib.ExitStack() as stack:
        curves = None
        if arguments.live:
            folder = tempfile.TemporaryDirectory(prefix="evoexp-", ignore_cleanup_errors=True)
            curves = Path(stack.enter_context(folder))
        batch = Batch(
            wanted, runner, outputs_root(), retry_failed=arguments.retry_failed, curves=curves
        )
        batch.prepare()
        left = batch.num_left_failed
        failures = _run(batch, wanted, curves)
    if left:
        which = f"{left} replicates failed before" if left > 1 else "1 replicate failed before"
        say(f"{which}: evoexp list --failed; run again with --retry-failed")
    try:
        _show(experiments, arguments)
    finally:
        if failures:
            say(_failure_table(batch, failures))
    return 1 if failures or left else 0


def _that_can_run(experiment: Experiment) -> list[Labelled]:
    """Return the conditions of an experiment that need no extra that is not there."""
    lacks = {c.label: lacking(c.condition.to_json()) for c in experiment.conditions}
    for label, what in lacks.items():
        if what:
            say(f"skipped: {label}: {what}")
    if all(lacks.values()):
        raise SettingError("planner", f"one that is installed: {next(iter(lacks.values()))}", "it")
    return [each for each in experiment.conditions if not lacks[each.label]]


def _run(
    batch: Batch, wanted: Sequence[tuple[Condition, int, dict[str, Any]]], curves: Path | None
) -> list[Outcome]:
    if not batch.jobs:
        if batch.is_damaged:
            deque(batch.run(), maxlen=0)  # mends what is no replicate
        if not batch.num_left_failed:
            say("nothing to run: every replicate is there")
        return []
    planned = sorted({count for _, count, _ in wanted})
    say(f"replicates of each condition, fixed before they run: {' or '.join(map(str, planned))}")
    failures, counts = [], Counter(job.condition_id for job in batch.jobs)
    labels = {condition.id: notes["label"] for condition, _, notes in wanted}
    progress = BatchProgress(
        plain_console(), {key: (labels[key], counts[key]) for key in counts}, curves
    )
    with progress.shown(), contextlib.closing(batch.run()) as outcomes:
        for outcome in outcomes:
            progress.count(outcome)
            if outcome.reason:
                failures.append(outcome)
                failed = f"failed: {outcome.condition_id[:12]} #{outcome.replicate}"
                print(f"{failed}: {printable(outcome.reason)}", file=sys.stderr)
    return failures


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

        page = request_of(experiment, *asked).write()
        note.write_text(_drawn_from(experiment, asked, sources, directory))
        return str(page)

    say_each(functools.partial(drawn, experiment) for experiment in experiments)


def _drawn_from(experiment: Experiment, asked: Any, sources: str, directory: Path) -> str:
    """Return a hash of all that a report follows from, and of its files."""
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


def _failure_table(batch: Batch, failures: list[Outcome]) -> Table:
    title = f"{len(failures)} failed"
    table = new_table(title, hash_column(), *right("#"), "reason", "traceback in")
    for outcome in failures:
        path = batch.runs[outcome.condition_id].failure_path(outcome.replicate)
        table.add_row(outcome.condition_id[:12], str(outcome.replicate), outcome.reason, str(path))
    return table
