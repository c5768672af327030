"""`evoexp show`: one stored run."""

import argparse
import json
from typing import Any

import pandas as pd
import yaml
from rich.console import Console
from rich.table import Table
from rich.text import Text

from evoexp import shipped
from evoexp.commands.console import add_columns, new_table, plain_console
from evoexp.commands.hashes import with_candidates
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.errors import AmbiguousHash, EvoexpError, UnknownHash
from evoexp.store.log_reader import array_names, read_array
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve
from evoexp.store.tables import read_summaries


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("hash", metavar="HASH", help="any unique prefix of a run's hash")


def main(arguments: argparse.Namespace) -> int:
    """Print configuration, replicates and environment."""
    console = plain_console()
    try:
        run = resolve(outputs_root(), arguments.hash)
    except UnknownHash as error:
        return _show_shipped(console, arguments.hash, error)
    config, replicates, manifest = json.loads(run.config_json()), _replicates(run), run.manifest()
    _print_head(console, run.condition_id)
    _print_config(console, config)
    _print_notes(console, run.config_json())
    console.print(replicates)
    _print_arrays(console, run)
    _print_config(console, {"manifest": {k: v for k, v in manifest.items() if k != "condition"}})
    return 0


def _show_shipped(console: Console, prefix: str, error: UnknownHash) -> int:
    found = shipped.find(prefix)
    if len(found) > 1:
        raise AmbiguousHash(prefix, [row.condition_id[:12] for row in found])
    if not found:
        raise with_candidates(error, outputs_root())
    row = found[0]
    _print_head(console, row.condition_id)
    console.print(f"not run here; run it: {row.command}", soft_wrap=True)
    experiment = expansions.expand(
        [f"experiment={row.experiment}", f"budget={row.budget}"], only=[row.label]
    )[0]
    text = experiment.conditions[0].condition.to_json()
    _print_config(console, json.loads(text))
    _print_notes(console, text)
    return 0


def _print_head(console: Console, condition_id: str) -> None:
    console.print(f"condition {condition_id}", soft_wrap=True)
    for row in shipped.shipped():
        if row.condition_id == condition_id:
            console.print(
                f"shipped as {row.experiment}, {row.label}, budget {row.budget}", soft_wrap=True
            )


def _print_config(console: Console, config: dict[str, Any]) -> None:
    text = yaml.safe_dump(
        config, sort_keys=False, default_flow_style=None, allow_unicode=True, width=110
    )
    console.print(text, soft_wrap=True)


def _print_notes(console: Console, config_json: bytes) -> None:
    """Print what a planner has to say of its own settings, if it has."""
    try:
        planner, problem = Condition.from_json(config_json).prepare()
    except (
        EvoexpError
    ) as error:  # stored by another revision of the code: the run can be shown all the same
        console.print(f"notes: {error}", soft_wrap=True)
        return
    for note in planner.notes(problem):
        console.print(f"note: {note}", soft_wrap=True)


def _print_arrays(console: Console, run: RunDirectory) -> None:
    """Print the arrays that references attach to their logs."""
    for path in (run.log_path(k) for k in sorted(run.completed())[:1]):
        for name in array_names(path):
            shape = " × ".join(map(str, read_array(path, name).shape))
            console.print(f"array: {name} ({shape}), attached to {path.name}", soft_wrap=True)


def _replicates(run: RunDirectory) -> Table:
    table = new_table(f"replicates in {run.path}")
    add_columns(table, "#", right=True)
    add_columns(table, "status")
    add_columns(
        table, "best cost", "solved", "certified", "clearance", "evaluations", "CPU s", right=True
    )
    add_columns(table, "digest, or why it failed")
    for row in read_summaries(run).to_dict("records"):
        if row["status"] == "done":
            verdict = [
                "–" if pd.isna(row[name]) else str(row[name]) for name in ("solved", "certified")
            ]
            numbers = [f"{row['clearance']:.4g}", str(row["evaluations"]), f"{row['cpu_s']:.3f}"]
            cells = [f"{row['best_cost']:.6g}", *verdict, *numbers]
            table.add_row(str(row["replicate"]), "done", *cells, str(row["digest"]))
        else:
            table.add_row(
                str(row["replicate"]), Text("failed", "red"), *6 * ["–"], str(row["stop_reason"])
            )
    return table
