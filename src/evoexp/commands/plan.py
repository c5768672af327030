"""`evoexp plan`: the replicates that a `run` would start, and an estimate of their time and memory.

Nothing is run or written.
"""

import argparse
import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
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
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.errors import StoreError
from evoexp.store.identity import CONFIG, read
from evoexp.store.run_directory import RunDirectory, outputs_root, run_names
from evoexp.store.summaries import damaged_logs, summary_table

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
        cpu_s_each: Median CPU time of a replicate [s]; None: unknown.
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
    cpu_s_from: str
    memory_gb_each: float


class _StoredRun(NamedTuple):
    """A stored run as far as estimates need it."""

    name: str
    settings: Any
    run: RunDirectory


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
    stored = list(_stored_runs(outputs_root()))
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


def _stored_runs(outputs: Path) -> Iterator[_StoredRun]:
    """Yield the stored runs whose configuration can be read."""
    for name in run_names(outputs):
        try:
            content = read(outputs / "runs" / name / CONFIG)
            config = json.loads(content)
        except (StoreError, ValueError):
            continue
        condition_id = hashlib.sha256(content).hexdigest()
        if condition_id.startswith(name) and isinstance(config, dict):
            yield _StoredRun(name, config, RunDirectory(outputs, condition_id))


def _planned(
    experiment: str, label: str, condition: Condition, count: int, stored: list[_StoredRun]
) -> PlannedCondition:
    run = RunDirectory(outputs_root(), condition.id)
    asked = set(range(count))
    damaged = {int(Path(name).stem) for name in damaged_logs(run)} if run.completed() else set()
    cached = (run.completed() - damaged) & asked
    failed = run.failed() & asked
    own = json.loads(condition.to_json())
    plain = without_revisions(own)
    others = tuple(
        each.name
        for each in stored
        if each.settings != own and without_revisions(each.settings) == plain
    )
    seconds, origin = _seconds(condition, run, own, stored)
    return PlannedCondition(
        experiment,
        label,
        condition.id,
        count,
        len(cached),
        count - len(cached) - len(failed),
        len(failed),
        len(damaged & asked),
        others,
        seconds,
        origin,
        round(replicate_memory(condition) / GIGABYTE, 4),
    )


def without_revisions(config: Any) -> Any:
    """Return plain data of a condition without the revisions of its components."""
    if isinstance(config, Mapping):
        return {key: without_revisions(v) for key, v in config.items() if key != "revision"}
    if isinstance(config, list):
        return [without_revisions(value) for value in config]
    return config


def _seconds(
    condition: Condition, run: RunDirectory, own: Any, stored: list[_StoredRun]
) -> tuple[float | None, str]:
    """Estimate the CPU time of a replicate: from its own ones, else from runs like it."""
    if times := _column(run, "cpu_s"):
        return float(np.median(times)), f"{len(times)} of its own"
    alike = [
        each
        for each in stored
        if _component(each.settings, "planner") == _component(own, "planner")
        and each.settings.get("robot") == own["robot"]
        and each.settings.get("scenario") == own["scenario"]
    ]
    rates = []
    for each in alike:
        spent, done = _column(each.run, "cpu_s"), _column(each.run, "evaluations")
        rates += [a / b for a, b in zip(spent, done, strict=True) if b]
    if not rates:
        return None, "nothing stored like it"
    planner = condition.planner
    most = sum(planner.num_evaluations(k) for k in range(min(planner.num_generations, 10_000) + 1))
    return float(np.median(rates)) * most, f"{len(alike)} other runs of the scene, at most"


def _component(config: Any, group: str) -> Any:
    return config.get(group, {}).get("_target_") if isinstance(config, Mapping) else None


def _column(run: RunDirectory, name: str) -> list[float]:
    """Return a column of the finished replicates of a run; empty if there are none."""
    if not run.completed():
        return []
    rows = summary_table(run).select(["status", name]).to_pylist()
    return [float(row[name]) for row in rows if row["status"] == "done" and row[name] is not None]


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
            "unknown" if row.cpu_s_each is None else f"{row.cpu_s_each:.3g}",
            f"{row.memory_gb_each:.3g}",
        )
    return table


def _total(rows: list[PlannedCondition], workers: int) -> str:
    """Say how many replicates would run, and how long it would take."""
    missing, failed = (
        sum(counts) for counts in zip(*((row.missing, row.failed) for row in rows), strict=True)
    )
    again = f"{failed} failed before, which start with --retry-failed" if failed else ""
    if not missing:
        return f"nothing to run{f': {again}' if failed else ': every replicate is there'}"
    todo = [row for row in rows if row.missing]
    known = [(row.cpu_s_each, row.missing) for row in todo if row.cpu_s_each is not None]
    seconds = sum(each * count for each, count in known)
    unknown = sum(row.missing for row in todo if row.cpu_s_each is None)
    time = f"{seconds:.3g} s of CPU time, {seconds / workers:.3g} s on {workers} workers"
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
