"""`evoexp run`: the missing replicates of an experiment, then its report."""

import argparse
import contextlib
import functools
import shlex
import sys
import tempfile
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from evoexp.batch.jobs import Outcome
from evoexp.batch.runner import Batch
from evoexp.commands.arguments import add_experiment_arguments, folder_words
from evoexp.commands.console import add_columns, add_hash_column, new_table, plain_console
from evoexp.commands.drawn_reports import name_reports
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.configuration.experiment import Experiment, Labelled
from evoexp.errors import SettingError, printable
from evoexp.extras import lacking
from evoexp.report.pages import page_registration
from evoexp.store.plans import num_planned
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.summaries import summary_table as stored_summaries

INDEX = "index.md"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_experiment_arguments(parser)
    parser.add_argument(
        "--retry-failed", action="store_true", help="run replicates again that failed before"
    )
    parser.add_argument(
        "--live",
        action="store_true",
        help="show how the replicates converge while they run (on a terminal)",
    )
    parser.add_argument("--no-report", action="store_true", help="run only; draw nothing")


def main(arguments: argparse.Namespace) -> int:
    """Run; exit code 1 if a replicate failed."""
    console = plain_console()
    experiments = expansions.expand(
        arguments.overrides, multirun=arguments.multirun, only=arguments.only
    )
    for experiment in experiments:
        page_registration(experiment.report)  # refuses an unknown page before anything is run
    command = _command(arguments)
    wanted = [
        (
            labelled.condition,
            labelled.condition.num_replicates(experiment.num_replicates),
            _notes(experiment, labelled.label, command),
        )
        for experiment in experiments
        for labelled in _that_can_run(experiment, console)
    ]
    runner = experiments[0].runner
    if arguments.live and runner.backend != "loky":
        raise SettingError("--live", "a run on this machine: runner.backend=loky", runner.backend)
    with _folder_for_curves(arguments.live) as curves:
        batch = Batch(
            wanted, runner, outputs_root(), retry_failed=arguments.retry_failed, curves=curves
        )
        batch.prepare()
        left = batch.num_left_failed
        failures = _run(batch, wanted, console, curves)
    if left:
        which = f"{left} replicates failed before" if left > 1 else "1 replicate failed before"
        console.print(
            f"{which}: evoexp list --failed; run again with --retry-failed", soft_wrap=True
        )
    try:
        code = _tell(experiments, arguments, console)
    finally:
        if failures:
            console.print(_failure_table(batch, failures))
    return code or (1 if failures or left else 0)


@contextlib.contextmanager
def _folder_for_curves(wanted: bool) -> Iterator[Path | None]:
    if not wanted:
        yield None
        return
    with tempfile.TemporaryDirectory(prefix="evoexp-", ignore_cleanup_errors=True) as folder:
        yield Path(folder)


def _tell(
    experiments: Sequence[Experiment], arguments: argparse.Namespace, console: Console
) -> int:
    """Print the table of every experiment and the place of its report; return the exit code."""
    if arguments.no_report:
        for experiment in experiments:
            console.print(summary_table(experiment))
        return 0

    def drawn(number: int) -> str:
        from evoexp.commands.report import of_experiment

        return str(of_experiment(experiments[number], *_asked(arguments)))

    return name_reports(
        [functools.partial(drawn, number) for number in range(len(experiments))],
        console,
        before=lambda number: console.print(summary_table(experiments[number])),
    )


def _asked(arguments: argparse.Namespace) -> tuple[Any, ...]:
    """Return the words that ask for a report."""
    return arguments.overrides, arguments.multirun, arguments.only, arguments.config_dir


def _that_can_run(experiment: Experiment, console: Console) -> list[Labelled]:
    """Return the conditions of an experiment, without those that need an extra that is not there.

    Raises:
        SettingError: If all of them do.
    """
    lacks = {c.label: lacking(c.condition.to_json()) for c in experiment.conditions}
    for label, what in lacks.items():
        if what:
            console.print(f"skipped: {label}: {what}", soft_wrap=True, markup=False)
    if all(lacks.values()):
        raise SettingError("planner", f"one that is installed: {next(iter(lacks.values()))}", "it")
    return [each for each in experiment.conditions if not lacks[each.label]]


def _command(arguments: argparse.Namespace) -> str:
    """Return the command as it can be typed again."""
    swept = ["-m"] if arguments.multirun else []
    only = ["--only", ",".join(arguments.only)] if arguments.only else []
    words = [*swept, *arguments.overrides, *only, *folder_words(arguments.config_dir)]
    return shlex.join(["evoexp", "run", *words])


def _run(
    batch: Batch,
    wanted: Sequence[tuple[Condition, int, dict[str, Any]]],
    console: Console,
    curves: Path | None,
) -> list[Outcome]:
    if not batch.jobs:
        if batch.is_damaged:
            deque(batch.run(), maxlen=0)  # mends what is no replicate
        if not batch.num_left_failed:
            console.print("nothing to run: every replicate is there")
        return []
    planned = sorted({count for _, count, _ in wanted})
    console.print(
        f"replicates of each condition, fixed before they run: {' or '.join(map(str, planned))}"
    )
    from evoexp.commands.progress import BatchProgress

    failures, counts = [], Counter(job.condition_id for job in batch.jobs)
    labels = {condition.id: notes["label"] for condition, _, notes in wanted}
    shown = {key: (labels[key], counts[key]) for key in counts}
    with (
        BatchProgress(console, shown, curves) as progress,
        contextlib.closing(batch.run()) as outcomes,
    ):
        for outcome in outcomes:
            progress.advance(outcome)
            if outcome.failed:
                failures.append(outcome)
                failed = f"failed: {outcome.condition_id[:12]} #{outcome.replicate}"
                print(f"{failed}: {printable(outcome.reason)}", file=sys.stderr)
    return failures


def _notes(experiment: Experiment, label: str, command: str) -> dict[str, Any]:
    """Return the notes that a new run's manifest keeps of its origin; no part of its identity."""
    return {
        "experiment": experiment.name,
        "budget": experiment.budget_of(label),
        "label": label,
        "options": experiment.option_names(label),
        "command": command,
    }


def summary_table(experiment: Experiment) -> Table:
    """Return a table of the conditions: replicates done, solved, cost and time.

    As the report, it has all stored replicates, also those beyond the number that is asked for.
    """
    table = new_table(experiment.report_name)
    add_columns(table, "condition")
    add_hash_column(table)
    add_columns(table, "replicates", "solved", "median\nbest cost", "CPU s\neach", right=True)
    for label, condition in experiment.conditions:
        run = RunDirectory(outputs_root(), condition.id)
        rows = stored_summaries(run)
        planned = run.num_planned(condition.num_replicates(experiment.num_replicates))
        columns = rows.select(["status", "solved", "best_cost", "cpu_s"]).to_pylist()
        done = [row for row in columns if row["status"] == "done"]
        table.add_row(
            label,
            condition.id[:12],
            f"{len(done)} of {planned}",
            f"{sum(row['solved'] for row in done)} of {len(done)}",
            _median([row["best_cost"] for row in done], ".4g"),
            _median([row["cpu_s"] for row in done], ".3f"),
        )
        if planned > condition.num_replicates(experiment.num_replicates):
            asked = experiment.num_replicates
            table.caption = f"of {asked} asked for: all that are stored, here and in the report"
    return table


def _median(values: list[float], form: str) -> str:
    return format(np.median(values), form) if values else "–"


def _failure_table(batch: Batch, failures: list[Outcome]) -> Table:
    table = new_table(f"{len(failures)} failed")
    add_hash_column(table)
    add_columns(table, "#", right=True)
    add_columns(table, "reason", "traceback in")
    for outcome in failures:
        path = batch.runs[outcome.condition_id].failure_path(outcome.replicate)
        table.add_row(outcome.condition_id[:12], str(outcome.replicate), outcome.reason, str(path))
    return table
