"""`evoexp list`: what can be run, and what has been."""

import argparse

import pandas as pd
from rich.console import Console
from rich.table import Table

from evoexp import compose, shipped
from evoexp.errors import EvoexpError
from evoexp.store.run_directory import RunDirectory, find_runs, outputs_root
from evoexp.store.tables import read_summaries


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments: none."""


def main(arguments: argparse.Namespace) -> int:
    """Print both lists."""
    console = Console()
    console.print(_experiments())
    runs = find_runs(outputs_root())
    if runs:
        console.print(_runs(runs))
    else:
        console.print(f"no runs stored in {outputs_root()}", highlight=False)
    return 0


def _experiments() -> Table:
    table = Table(title="experiments", title_justify="left")
    table.add_column("run experiment=")
    table.add_column("what it is")
    for name in compose.options("experiment"):
        table.add_row(name, compose.description(name))
    return table


def _runs(runs: list[RunDirectory]) -> Table:
    names = {row.condition_id: f"{row.experiment}, {row.label}, {row.budget}" for row in shipped.shipped()}
    table = Table(title=f"runs stored in {outputs_root()}", title_justify="left")
    table.add_column("hash")
    table.add_column("condition")
    for column in ("done", "failed", "solved", "median best cost"):
        table.add_column(column, justify="right")
    for run in runs:
        try:
            rows = read_summaries(run)
        except EvoexpError as error:
            table.add_row(run.hash12, f"[red]{error}[/]", "–", "–", "–", "–")
            continue
        done = rows[rows["status"] == "done"]
        cost = done["best_cost"].median() if len(done) else pd.NA
        table.add_row(
            run.hash12,
            names.get(run.condition_id) or _noted(run),
            str(len(done)),
            str(len(rows) - len(done)),
            str(int(done["solved"].sum())),
            "–" if pd.isna(cost) else f"{cost:.4g}",
        )
    return table


def _noted(run: RunDirectory) -> str:
    """Return what the manifest notes of a run that is no shipped condition."""
    try:
        notes = run.manifest()
    except EvoexpError:
        return "(no manifest)"
    return f"{notes.get('experiment', '?')}, {notes.get('label', '?')}, {notes.get('budget', '?')} (changed)"
