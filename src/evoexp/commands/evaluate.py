"""`evoexp evaluate`: judge a given motion by a configuration's criteria."""

import argparse
from typing import Any

from rich.table import Table

from evoexp.collision.certifier.certificate import PAIR
from evoexp.commands.arguments import add_experiment_arguments
from evoexp.commands.console import add_columns, new_table, plain_console, print_json
from evoexp.commands.given_motion import fitting_motions
from evoexp.planners.answers import Listing
from evoexp.planners.proofs import judge_motion

DEPARTURES = "departures"  # of a row: the ways in which the motion is none of the task
HEAD = ("label", "condition", "length_unit")  # of a row; its other entries are terms and verdict


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    words = add_experiment_arguments(parser)
    words.metavar, words.nargs = "MOTION | KEY=VALUE", "+"
    words.help = (
        "a motion file (.json: nested lists, .npy: an array) in the planner's documented shape, "
        "start and goal included, and an experiment with overrides as for run"
    )
    parser.add_argument(
        "--json", action="store_true", help="print flat JSON: one object, or a list of them"
    )


def main(arguments: argparse.Namespace) -> int:
    """Print terms and exact verdict of the motion, one column per condition that it fits."""
    _, fitting = fitting_motions(
        arguments.overrides, multirun=arguments.multirun, only=arguments.only
    )
    rows: list[dict[str, Any]] = []
    listings: list[Listing | None] = []
    for label, condition, planner, problem, solution in fitting:
        head = dict(zip(HEAD, (label, condition.id, condition.length_unit), strict=True))
        terms = planner.evaluate(problem, solution)
        verdict = judge_motion(planner, problem, planner.motion(problem, solution))._asdict()
        departures = list(planner.departures(problem, solution))
        of_task = {"solution_of_the_task": not departures}
        rows.append(head | terms | of_task | verdict | {DEPARTURES: departures})
        listings.append(planner.listing(problem, solution))
    if arguments.json:
        whole = [_with_rows(*pair) for pair in zip(rows, listings, strict=True)]
        print_json(whole if len(whole) > 1 else whole[0])
        return 0
    console = plain_console()
    for row, listing in zip(rows, listings, strict=True):
        if listing is not None:
            console.print(_listing(row["label"], listing))
    for table in _tables(rows, console.width):
        console.print(table)
    for row in rows:
        for departure in row[DEPARTURES]:
            console.print(f"{row['label']} – no solution of the task: {departure}")
    return 0


def _with_rows(row: dict[str, Any], listing: Listing | None) -> dict[str, Any]:
    """Return a row with one object per configuration, if the planner lists configurations."""
    if listing is None:
        return row
    return row | {"rows": [dict(zip(listing.names, cells, strict=True)) for cells in listing.rows]}


def _listing(label: str, listing: Listing) -> Table:
    """Return a table with one row per configuration of the motion."""
    table = new_table(label)
    add_columns(table, *listing.names, right=True)
    for row in listing.rows:
        table.add_row(*(_cell(value) for value in row))
    return table


def _tables(rows: list[dict[str, Any]], width: int) -> list[Table]:
    """Return a table with one column per condition; more in a narrow terminal."""
    apart = (*HEAD, DEPARTURES)
    names = list(dict.fromkeys(name for row in rows for name in row if name not in apart))
    longest_word = max(len(word) for row in rows for word in row["label"].split())
    column = min(max(12, longest_word), 40) + 3
    count = max(1, (width - max(map(len, names)) - 4) // column)
    return [_table(rows[k : k + count], names) for k in range(0, len(rows), count)]


def _table(rows: list[dict[str, Any]], names: list[str]) -> Table:
    table = new_table()
    table.add_column("", no_wrap=True)
    for row in rows:
        add_columns(table, f"{row['label']}\n{row['condition'][:12]}", right=True)
    for name in names:
        table.add_row(name, *(_cell(row.get(name)) for row in rows))
    return table


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or value == "":
        return "–"
    return value.replace(PAIR, PAIR + "\n") if isinstance(value, str) else f"{value:.6g}"
