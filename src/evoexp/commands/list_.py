"""`evoexp list`: what can be run, and what has been."""

import argparse

import pandas as pd
from rich.table import Table
from rich.text import Text

from evoexp import shipped
from evoexp.commands.console import add_columns, add_hash_column, new_table, plain_console
from evoexp.commands.hashes import stored_runs
from evoexp.configuration.search_path import description, options
from evoexp.errors import EvoexpError
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.tables import read_summaries


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments: none."""


def main(arguments: argparse.Namespace) -> int:
    """Print both lists."""
    console = plain_console()
    console.print(_experiments())
    runs = stored_runs(outputs_root())
    if runs:
        console.print(_runs(runs))
    else:
        console.print(f"no runs stored in {outputs_root()}", soft_wrap=True)
    return 0


def _experiments() -> Table:
    table = new_table("experiments")
    add_columns(table, "run experiment=", "what it is")
    for name in options("experiment"):
        table.add_row(name, description(name))
    return table


def _runs(runs: list[tuple[str, RunDirectory | EvoexpError]]) -> Table:
    table = new_table(f"runs stored in {outputs_root()}")
    add_hash_column(table)
    add_columns(table, "condition")
    add_columns(table, "done", "failed", "solved", "median\nbest cost", right=True)
    for name, run in runs:
        try:
            if isinstance(run, EvoexpError):
                raise run
            rows = read_summaries(run)
        except EvoexpError as error:
            table.add_row(name, Text(str(error), "red"), "–", "–", "–", "–")
            continue
        done = rows[rows["status"] == "done"]
        cost = done["best_cost"].median() if len(done) else pd.NA
        table.add_row(
            name,
            _named(run),
            str(len(done)),
            str(len(rows) - len(done)),
            str(int(done["solved"].sum())),
            "–" if pd.isna(cost) else f"{cost:.4g}",
        )
    return table


def _named(run: RunDirectory) -> str:
    """Return a run's condition as it was asked for: experiments share conditions."""
    try:
        notes = run.manifest()
    except EvoexpError:
        notes = {}
    rows = [row for row in shipped.shipped() if row.condition_id == run.condition_id]
    asked = [
        row
        for row in rows
        if (row.experiment, row.label) == (notes.get("experiment"), notes.get("label"))
    ]
    if found := asked or rows:
        return f"{found[0].experiment}, {found[0].label}, {found[0].budget}"
    if not notes:
        return "(no manifest)"
    return (
        f"{notes.get('experiment', '?')}, {notes.get('label', '?')}, {notes.get('budget', '?')} "
        "(changed)"
    )
