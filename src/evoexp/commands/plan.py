"""`evoexp plan`: the replicates that a `run` would start, and an estimate of their time and memory.

Nothing is run or written.
"""

import argparse
import json
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

from rich.table import Table

from evoexp.batch.memory_limit import GIGABYTE, replicate_memory
from evoexp.batch.workers import num_cores
from evoexp.commands.arguments import add_experiment_arguments
from evoexp.commands.console import (
    add_columns,
    add_hash_column,
    new_table,
    plain_console,
    print_json,
)
from evoexp.commands.stored_times import StoredTimes
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.summaries import damaged_logs

START_S = 5.0  # [s] assumed: at most, to start workers and compile nothing
CONDITION_S = 0.05  # [s] assumed: at most, to prepare a condition and write its files
KEYS = (
    "experiment",
    "label",
    "hash",
    "planned",
    "cached",
    "missing",
    "failed",
    "damaged",
    "other_revision",
    "cpu_s_each",
    "cpu_s_least",
    "cpu_s_most",
    "cpu_s_from",
    "memory_gb_each",
)


class PlannedCondition(NamedTuple):
    """One condition of a batch, and how much of it is stored; fields as in `KEYS`.

    Attributes:
        experiment: Name of the experiment.
        label: Name of the condition in it.
        condition_id: 64 hex digits.
        planned: Replicates that are asked for.
        cached: Those that are stored.
        missing: Those that a run would start: `planned` without `cached` and `failed`.
        failed: Those that failed before, which start only if told so.
        damaged: Those of the missing ones whose log is damaged.
        other_revision: Hashes of stored runs of the same settings by components of another
            revision.
        cpu_s_each: CPU time of a replicate [s], as far as it is known; None: unknown.
        cpu_s_least: The least that it may take in the mean [s].
        cpu_s_most: The most that it may take in the mean [s].
        cpu_s_from: Origin of that time.
        memory_gb_each: Estimate of the memory of a replicate [GB].
    """

    experiment: str
    label: str
    condition_id: str
    planned: int
    cached: int
    missing: int
    failed: int
    damaged: int
    other_revision: tuple[str, ...]
    cpu_s_each: float | None
    cpu_s_least: float | None
    cpu_s_most: float | None
    cpu_s_from: str
    memory_gb_each: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_experiment_arguments(parser)
    parser.add_argument(
        "--json", action="store_true", help=f"print JSON: a list of conditions ({', '.join(KEYS)})"
    )


def main(arguments: argparse.Namespace) -> int:
    """Print the plan."""
    experiments = expansions.expand(
        arguments.overrides, multirun=arguments.multirun, only=arguments.only
    )
    stored = StoredTimes(outputs_root())
    rows, seen = [], set[str]()
    for experiment in experiments:
        for label, condition in experiment.conditions:
            if condition.id not in seen:
                seen.add(condition.id)
                count = condition.num_replicates(experiment.num_replicates)
                rows.append(_planned(experiment.name, label, condition, count, stored))
    if arguments.json:
        print_json([dict(zip(KEYS, row, strict=True)) for row in rows])
        return 0
    console = plain_console()
    console.print(_table(rows))
    workers = experiments[0].runner.num_workers or num_cores()
    console.print(_total(rows, workers), soft_wrap=True)
    return 0


def _planned(
    experiment: str, label: str, condition: Condition, count: int, stored: StoredTimes
) -> PlannedCondition:
    run = RunDirectory(outputs_root(), condition.id)
    asked = set(range(count))
    damaged = {int(Path(name).stem) for name in damaged_logs(run)} if run.completed() else set()
    cached = (run.completed() - damaged) & asked
    failed = run.failed() & asked
    settings = json.loads(condition.to_json())
    estimate = stored.estimate(condition, run, settings)
    return PlannedCondition(
        experiment,
        label,
        condition.id,
        count,
        len(cached),
        count - len(cached) - len(failed),
        len(failed),
        len(damaged & asked),
        stored.other_revisions(settings, condition.id),
        *estimate,
        round(replicate_memory(condition) / GIGABYTE, 4),
    )


def _table(rows: list[PlannedCondition]) -> Table:
    table = new_table()
    add_columns(table, "condition")
    add_hash_column(table)
    add_columns(table, "planned", "there", "to run", "failed\nbefore", "damaged", right=True)
    add_columns(table, "other revision")
    add_columns(table, "CPU s\neach", "GB\neach", right=True)
    for row in rows:
        table.add_row(
            row.label,
            row.condition_id[:12],
            str(row.planned),
            str(row.cached),
            str(row.missing),
            str(row.failed),
            str(row.damaged),
            ", ".join(row.other_revision) or "–",
            _seconds(row.cpu_s_each, row.cpu_s_least, row.cpu_s_most),
            f"{row.memory_gb_each:.3g}",
        )
    return table


def _seconds(mean: float | None, least: float | None, most: float | None) -> str:
    """Return a time, or a range if its ends differ by more than a factor of two."""
    if mean is None or least is None or most is None:
        return "unknown"
    return f"{mean:.3g}" if most <= 2 * least else f"{least:.2g} to {most:.2g}"


def _total(rows: list[PlannedCondition], workers: int) -> str:
    """Say how many replicates would run, and how long it would take."""
    missing, failed = (
        sum(counts) for counts in zip(*((row.missing, row.failed) for row in rows), strict=True)
    )
    again = f"{failed} failed before, which start with --retry-failed" if failed else ""
    if not missing:
        return f"nothing to run{f': {again}' if failed else ': every replicate is there'}"
    todo = [row for row in rows if row.missing]
    known = [row for row in todo if row.cpu_s_each is not None]
    bounds = attrgetter("cpu_s_each", "cpu_s_least", "cpu_s_most")
    cpu = [sum(row.missing * bounds(row)[k] for row in known) for k in range(3)]
    starting = START_S + CONDITION_S * len(todo)
    wall = cpu[0] / workers, cpu[1] / workers, cpu[2] / workers + starting
    unknown = sum(row.missing for row in todo if row.cpu_s_each is None)
    time = f"{_seconds(*cpu)} s of CPU time, {_seconds(*wall)} s on {workers} workers"
    open_ones = f"{unknown} of them of unknown length" if known else "of unknown length"
    largest = max(row.memory_gb_each for row in todo)
    parts = (
        f"{missing} replicates to run" if missing > 1 else "1 replicate to run",
        time if known else "",
        open_ones if unknown else "",
        f"at most {largest * min(workers, missing):.3g} GB at once",
        again,
    )
    return "; ".join(part for part in parts if part)
