"""`evoexp show`: one stored run."""

import argparse
import json
from typing import Any

import yaml
from rich.console import Console
from rich.table import Table

from evoexp import compose, shipped
from evoexp.errors import AmbiguousHash, UnknownHash
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve
from evoexp.store.tables import read_summaries


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("hash", metavar="HASH", help="any unique prefix of a run's hash")


def main(arguments: argparse.Namespace) -> int:
    """Print configuration, replicates and environment."""
    console = Console()
    try:
        run = resolve(outputs_root(), arguments.hash)
    except UnknownHash:
        return _show_shipped(console, arguments.hash)
    _print_head(console, run.condition_id)
    _print_config(console, json.loads(run.config_json()))
    console.print(_replicates(run))
    _print_config(console, {"manifest": {k: v for k, v in run.manifest().items() if k != "condition"}})
    return 0


def _show_shipped(console: Console, prefix: str) -> int:
    found = shipped.find(prefix)
    if len(found) > 1:
        raise AmbiguousHash(prefix, [row.condition_id[:12] for row in found])
    if not found:
        raise UnknownHash(f"hash: '{prefix}' is neither stored in {outputs_root()} nor shipped (see: evoexp list)")
    row = found[0]
    _print_head(console, row.condition_id)
    console.print(f"not run here; run it: {row.command}", highlight=False, soft_wrap=True)
    experiment = compose.expand([f"experiment={row.experiment}", f"budget={row.budget}"], only=[row.label])[0]
    _print_config(console, json.loads(experiment.conditions[0].condition.to_json()))
    return 0


def _print_head(console: Console, condition_id: str) -> None:
    console.print(f"condition {condition_id}", highlight=False, soft_wrap=True)
    for row in shipped.shipped():
        if row.condition_id == condition_id:
            console.print(f"shipped as {row.experiment}, {row.label}, budget {row.budget}", highlight=False)


def _print_config(console: Console, config: dict[str, Any]) -> None:
    text = yaml.safe_dump(config, sort_keys=False, default_flow_style=None, allow_unicode=True, width=110)
    console.print(text, highlight=False, markup=False, soft_wrap=True)


def _replicates(run: RunDirectory) -> Table:
    table = Table(title=f"replicates in {run.path}", title_justify="left")
    for column in ("replicate", "status", "best cost", "solved", "evaluations", "CPU s", "digest"):
        table.add_column(column, justify="left" if column in ("status", "digest") else "right")
    for row in read_summaries(run).to_dict("records"):
        if row["status"] == "done":
            cells = [f"{row['best_cost']:.6g}", str(row["solved"]), str(row["evaluations"]), f"{row['cpu_s']:.3f}"]
            table.add_row(str(row["replicate"]), "done", *cells, str(row["digest"]))
        else:
            table.add_row(str(row["replicate"]), "[red]failed[/]", "–", "–", "–", "–", str(row["stop_reason"]))
    return table
