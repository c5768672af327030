"""`evoexp run`: the missing replicates of an experiment, then its report."""

import argparse
import contextlib
import sys
from typing import Any

from rich.console import Console
from rich.table import Table

from evoexp import compose
from evoexp.batch.runner import Batch, Outcome
from evoexp.commands.arguments import add_experiment_arguments
from evoexp.commands.progress import BatchProgress
from evoexp.report import build
from evoexp.store.run_directory import outputs_root
from evoexp.store.tables import read_summaries


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_experiment_arguments(parser)
    parser.add_argument("--no-report", action="store_true", help="run only; draw nothing")


def main(arguments: argparse.Namespace) -> int:
    """Run; exit code 1 if a replicate failed."""
    console = Console()
    experiments = compose.expand(arguments.overrides, multirun=arguments.multirun, only=arguments.only)
    command = "evoexp run " + " ".join([*arguments.overrides, *(["-m"] if arguments.multirun else [])])
    wanted = [
        (labelled.condition, experiment.num_replicates, _notes(experiment, labelled.label, command))
        for experiment in experiments
        for labelled in experiment.conditions
    ]
    batch = Batch(wanted, experiments[0].runner, outputs_root())
    batch.prepare()
    failures = _run(batch, console)
    for experiment in experiments:
        console.print(summary_table(experiment))
        if not arguments.no_report:
            with contextlib.suppress(BrokenPipeError):
                page = build.report(
                    build.Request(experiment.report_name, experiment.name, experiment.budget, experiment.conditions),
                    experiment.report,
                    outputs_root(),
                    experiment.num_replicates,
                )
                console.print(f"report: {page}", highlight=False, soft_wrap=True)
    if failures:
        console.print(_failure_table(batch, failures))
    return 1 if failures else 0


def _run(batch: Batch, console: Console) -> list[Outcome]:
    if not batch.jobs:
        console.print("nothing to run: every replicate is there", highlight=False)
        return []
    failures = []
    with BatchProgress(console, len(batch.jobs)) as progress, contextlib.closing(batch.run()) as outcomes:
        for outcome in outcomes:
            progress.advance(outcome.failed)
            if outcome.failed:
                failures.append(outcome)
                print(f"failed: {outcome.condition_id[:12]} #{outcome.replicate}: {outcome.reason}", file=sys.stderr)
    return failures


def _notes(experiment: compose.Experiment, label: str, command: str) -> dict[str, Any]:
    """What a new run's manifest says of why it was made; no part of its identity."""
    return {"experiment": experiment.name, "budget": experiment.budget, "label": label, "command": command}


def summary_table(experiment: compose.Experiment) -> Table:
    """Return one row per condition: what is there, and how good."""
    table = Table(title=experiment.report_name, title_justify="left")
    table.add_column("condition")
    table.add_column("hash")
    for column in ("replicates", "solved", "median best cost", "CPU s each"):
        table.add_column(column, justify="right")
    for label, condition in experiment.conditions:
        run = Batch([(condition, 0, {})], experiment.runner, outputs_root()).runs[condition.id]
        rows = read_summaries(run)
        done = rows[(rows["status"] == "done") & (rows["replicate"] < experiment.num_replicates)]
        table.add_row(
            label,
            condition.id[:12],
            f"{len(done)} of {experiment.num_replicates}",
            f"{int(done['solved'].sum())} of {len(done)}",
            f"{done['best_cost'].median():.4g}" if len(done) else "–",
            f"{done['cpu_s'].median():.3f}" if len(done) else "–",
        )
    return table


def _failure_table(batch: Batch, failures: list[Outcome]) -> Table:
    table = Table(title=f"{len(failures)} failed", title_justify="left")
    table.add_column("hash")
    table.add_column("replicate", justify="right")
    table.add_column("reason")
    table.add_column("traceback in")
    for outcome in failures:
        path = batch.runs[outcome.condition_id].failure_path(outcome.replicate)
        table.add_row(outcome.condition_id[:12], str(outcome.replicate), outcome.reason, str(path))
    return table
