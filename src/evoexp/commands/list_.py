"""`evoexp list`: the experiments that can be run, and the runs that are stored."""

import argparse
from collections.abc import Mapping
from typing import Any

import numpy as np
from rich.table import Table

from evoexp.commands.arguments import add_config_dir_argument
from evoexp.commands.console import (
    add_columns,
    add_hash_column,
    coloured,
    new_table,
    plain_console,
    print_json,
)
from evoexp.commands.hashes import stored_runs
from evoexp.commands.run_origins import origin_of
from evoexp.configuration.search_path import description, find, options
from evoexp.errors import EvoexpError, printable
from evoexp.store.files import listed
from evoexp.store.integrity import damaged_files
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.summaries import summary_rows

EXPERIMENT_KEYS = ("name", "description", "origin", "path")
FAILED_KEYS = ("hash", "label", "replicate", "reason", "path")
RUN_KEYS = (
    "hash",
    "experiment",
    "label",
    "budget",
    "changed",
    "done",
    "failed",
    "solved",
    "median_best_cost",
    "damage",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_config_dir_argument(parser)
    parser.add_argument(
        "--failed", action="store_true", help="list the failed replicates of stored runs instead"
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help=f"print JSON: experiments ({', '.join(EXPERIMENT_KEYS)}) and runs "
        f"({', '.join(RUN_KEYS)}); with --failed, failures ({', '.join(FAILED_KEYS)})",
    )


def main(arguments: argparse.Namespace) -> int:
    """Print both lists, or that of failures."""
    if arguments.failed:
        return _print_failed(as_json=arguments.json)
    experiments = [_experiment(name) for name in options("experiment")]
    runs = [_run(name, run) for name, run in stored_runs(outputs_root())]
    if arguments.json:
        print_json({"experiments": experiments, "runs": runs})
        return 0
    console = plain_console()
    console.print(_experiment_table(experiments))
    if runs:
        console.print(_run_table(runs))
    else:
        console.print(f"no runs stored in {outputs_root()}", soft_wrap=True)
    return 0


def _print_failed(*, as_json: bool) -> int:
    """List the failed replicates, run by run."""
    rows = []
    for name, run in stored_runs(outputs_root()):
        if isinstance(run, EvoexpError) or not run.failed():
            continue
        label = origin_of(run)["label"] or ""
        for replicate in sorted(run.failed()):
            try:
                reason = str(run.failure(replicate)["reason"])
            except EvoexpError as error:
                reason = str(error)
            rows.append((name, label, replicate, reason, str(run.failure_path(replicate))))
    if as_json:
        print_json([dict(zip(FAILED_KEYS, row, strict=True)) for row in rows])
        return 0
    console = plain_console()
    if not rows:
        console.print(f"no failed replicates in {outputs_root()}", soft_wrap=True)
        return 0
    table = new_table()
    add_hash_column(table)
    add_columns(table, "condition")
    add_columns(table, "#", right=True)
    add_columns(table, "reason")
    for name, label, replicate, reason, _ in rows:
        table.add_row(name, coloured(label), str(replicate), coloured(reason))
    console.print(table)
    return 0


def _experiment(name: str) -> dict[str, Any]:
    found = find("experiment", name)
    return dict(
        zip(EXPERIMENT_KEYS, (name, description(name), found.origin, found.path), strict=True)
    )


def _experiment_table(experiments: list[dict[str, Any]]) -> Table:
    table = new_table("experiments")
    add_columns(table, "run experiment=", "description", "from")
    for each in experiments:
        table.add_row(each["name"], each["description"], each["origin"])
    return table


def _run(name: str, run: RunDirectory | EvoexpError) -> dict[str, Any]:
    """Return the entry of a stored run; of a damaged run little but the damage."""
    row: dict[str, Any] = dict.fromkeys(RUN_KEYS) | {"hash": name, "changed": False}
    try:
        if isinstance(run, EvoexpError):
            raise run
        rows, damaged = summary_rows(run, ["status", "solved", "best_cost"])
    except EvoexpError as error:
        return row | {"damage": str(error)}
    except OSError as error:
        return row | {"damage": f"{error.filename}: {error.strerror}"}
    done = [each for each in rows if each["status"] == "done"]
    return (
        row
        | {"hash": run.condition_id, "done": len(done), "failed": len(rows) - len(done)}
        | {"solved": sum(bool(each["solved"]) for each in done)}
        | {"median_best_cost": np.median([each["best_cost"] for each in done]) if done else None}
        | origin_of(run)
        | {"damage": _damage(damaged_files(run) | damaged)}
    )


def _damage(damaged: Mapping[str, str]) -> str | None:
    """Return the names of damaged files in a run that can be read; None if there are none."""
    return f"damaged: {listed(damaged)}" if damaged else None


def _run_table(runs: list[dict[str, Any]]) -> Table:
    table = new_table(f"runs stored in {outputs_root()}")
    add_hash_column(table)
    add_columns(table, "condition")
    add_columns(table, "done", "failed", "solved", "median\nbest cost", right=True)
    for run in runs:
        if run["done"] is None:
            table.add_row(run["hash"][:12], coloured(run["damage"], "red"), "–", "–", "–", "–")
            continue
        names = [run[name] or "?" for name in ("experiment", "label", "budget")]
        known = any(run[name] for name in ("experiment", "label", "budget"))
        text = ", ".join(names) + (" (changed)" if run["changed"] else "")
        cost = run["median_best_cost"]
        named = coloured(text if known else "(no manifest)")
        if run["damage"]:
            named.append(printable(f" · {run['damage']}"), "red")
        table.add_row(
            run["hash"][:12],
            named,
            *(str(run[name]) for name in ("done", "failed", "solved")),
            "–" if cost is None else f"{cost:.4g}",
        )
    return table
