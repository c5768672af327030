"""`evoexp list`: the experiments that can be run, and the runs that are stored."""

import argparse
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from evoexp.commands.console import coloured, hash_column, new_table, print_json, right, say
from evoexp.commands.stored_runs import in_archive, looked_into, stored_runs
from evoexp.configuration.search_path import find, options
from evoexp.errors import EvoexpError, SettingError, printable
from evoexp.shipped import described
from evoexp.store.files import listed
from evoexp.store.identity import ORIGIN
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.summaries import damaged_logs, summary_table

EXPERIMENT_KEYS = ("name", "description", "origin", "path")
NamedRun = tuple[str, RunDirectory | EvoexpError]  # a damaged one: its error
FAILED_KEYS = ("hash", "label", "replicate", "reason", "path")
RUN_KEYS = (
    *("hash", *ORIGIN, "changed", "planned", "done", "failed", "solved", "certified"),
    *("median_best_cost", "median_cpu_s", "damage"),
)


def main(arguments: argparse.Namespace) -> int:
    """Print both lists, or that of failures; of an archive its runs alone."""
    if arguments.archive is None:
        return _print(arguments, f"stored in {outputs_root()}", stored_runs(outputs_root()))
    packed = in_archive(arguments.archive)
    if packed is None:
        raise SettingError("list", "given an archive of runs, RUNS.tar", arguments.archive)
    with looked_into(*packed) as runs:
        place = f"in {printable(str(packed[0]))}"
        return _print(arguments, place, ((run.hash12, run) for run in runs))


def _print(arguments: argparse.Namespace, place: str, stored: Iterable[NamedRun]) -> int:
    if arguments.failed:
        failures = _failures(stored)
        if arguments.json:
            print_json(failures)
        elif failures:
            keys = ("hash", "label", "replicate", "reason")
            rows = ([coloured(str(each[key])) for key in keys] for each in failures)
            say(new_table("", hash_column(), "condition", *right("#"), "reason", rows=rows))
        else:
            say(f"no failed replicates {place}")
        return 0
    names = options("experiment") if arguments.archive is None else ()
    files = [find("experiment", name) for name in names]
    told = ((each.name, described(Path(each.path)), each.origin, each.path) for each in files)
    experiments = [dict(zip(EXPERIMENT_KEYS, row, strict=True)) for row in told]
    runs = [run_row(name, run) for name, run in stored]
    if arguments.json:
        print_json({"experiments": experiments, "runs": runs})
        return 0
    if experiments:
        cells = ([each[key] for key in EXPERIMENT_KEYS[:3]] for each in experiments)
        say(new_table("experiments", "run experiment=", "description", "from", rows=cells))
    say(run_table(f"runs {place}", runs) if runs else f"no runs {place}")
    return 0


def _failures(stored: Iterable[NamedRun]) -> list[dict[str, Any]]:
    rows = []
    for name, run in stored:
        if isinstance(run, RunDirectory) and run.failed():
            label = run.origin()["label"] or ""
            for row in summary_table(run).to_pylist():
                if row["status"] == "failed":
                    path = str(run.failure_path(row["replicate"]))
                    values = (name, label, row["replicate"], row["stop_reason"], path)
                    rows.append(dict(zip(FAILED_KEYS, values, strict=True)))
    return rows


def run_row(name: str, run: RunDirectory | EvoexpError) -> dict[str, Any]:
    """Return the entry of a stored run; of a damaged run little but the damage."""
    row: dict[str, Any] = dict.fromkeys(RUN_KEYS) | {"hash": name, "changed": False}
    try:
        if isinstance(run, EvoexpError):
            raise run
        names = ["status", "solved", "certified", "clearance", "best_cost", "cpu_s"]
        rows, damaged = summary_table(run).select(names).to_pylist(), damaged_logs(run)
    except EvoexpError as error:
        return row | {"damage": str(error)}
    except OSError as error:
        return row | {"damage": f"{error.filename}: {error.strerror}"}
    done = [each for each in rows if each["status"] == "done"]
    moved = any(not math.isnan(each["clearance"]) for each in done)
    damaged = run.damaged_files() | damaged
    return row | {
        "hash": run.condition_id,
        "planned": run.num_planned(),
        "done": len(done),
        "failed": len(rows) - len(done),
        "solved": sum(bool(each["solved"]) for each in done),
        "certified": sum(each["certified"] is True for each in done) if moved else None,
        "median_best_cost": np.median([each["best_cost"] for each in done]) if done else None,
        "median_cpu_s": np.median([each["cpu_s"] for each in done]) if done else None,
        **run.origin(),
        "damage": f"damaged: {listed(damaged)}" if damaged else None,
    }


def run_table(title: str, runs: list[dict[str, Any]]) -> Table:
    """Return a table of the entries of stored runs."""
    numbers = right("done", "failed", "solved /\ncertified", "median\ncost", "CPU s\neach")
    table = new_table(title, hash_column(), "condition", *numbers)
    for run in runs:
        if run["done"] is None:
            table.add_row(run["hash"][:12], coloured(run["damage"], "red"), *5 * ["–"])
            continue
        named = ", ".join(filter(None, (run[name] for name in ORIGIN))) or "(no manifest)"
        condition = coloured(named + " (changed)" * run["changed"])
        if run["damage"]:
            condition.append(printable(f" · {run['damage']}"), "red")
        table.add_row(
            run["hash"][:12],
            condition,
            f"{run['done']} of {run['planned']}",
            str(run["failed"]),
            f"{run['solved']} / {'–' if run['certified'] is None else run['certified']}",
            f"{run['median_best_cost']:.4g}" if run["done"] else "–",
            f"{run['median_cpu_s']:.3f}" if run["done"] else "–",
        )
    return table
