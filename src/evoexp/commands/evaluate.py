"""`evoexp evaluate`: judge a given motion by a configuration's criteria."""

import argparse
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.table import Column, Table

from evoexp.collision.certifier.certificate import PAIR
from evoexp.commands import motion_files
from evoexp.commands.chosen_motions import named_log, write
from evoexp.commands.command_parser import is_motion
from evoexp.commands.console import new_table, plain_console, print_json, right, say
from evoexp.commands.motion_files import FittingMotion, fitting_motions, nested, stored_motion
from evoexp.errors import MotionFileError
from evoexp.planners.answers import Listing
from evoexp.planners.proofs import judge_motion

DEPARTURES = "departures"  # of a row: the ways in which the motion is none of the task
REMARKS = "remarks"  # of a row: how a trajectory was read
HEX = re.compile("[0-9a-fA-F]{1,64}")  # a prefix of a hash
_Judged = tuple[dict[str, Any], Listing | None]  # a row, and its table of configurations
HEAD = ("label", "condition", "length_unit")  # of a row; its other entries are terms and verdict


def main(arguments: argparse.Namespace) -> int:
    """Print terms and exact verdict of the motion; conditions that say the same share a column."""
    fitting = _motions(arguments)
    if arguments.write is not None:
        if not fitting[0].solution.size:
            raise MotionFileError("--write: must go with a solution, was given with a trajectory")
        planner, problem = fitting[0].condition.prepare()
        lists = nested(fitting[0].solution, planner.shape(problem))
        write(arguments.write, json.dumps(lists).encode(), is_said=not arguments.json)
    judged: list[_Judged] = []
    for label, condition, solution, motion, remarks in fitting:
        planner, problem = condition.prepare()
        head = dict(zip(HEAD, (label, condition.id, condition.length_unit), strict=True))
        verdict = judge_motion(planner, problem, motion)._asdict()
        if remarks:  # of a trajectory a planner knows neither terms nor departures
            judged.append((head | verdict | {DEPARTURES: [], REMARKS: list(remarks)}, None))
            continue
        terms = planner.evaluate(problem, solution)
        departures = list(planner.departures(problem, solution))
        of_task = {"solution_of_the_task": not departures}
        row = head | terms | of_task | verdict | {DEPARTURES: departures}
        judged.append((row, planner.listing(problem, solution)))
    rows = [row for row, _ in judged]
    if arguments.json:
        for row, listing in judged:
            if listing is not None:
                names, cells = listing
                row["rows"] = [dict(zip(names, values, strict=True)) for values in cells]
        print_json(rows if len(rows) > 1 else rows[0])
        return 0
    # conditions of one group say the same of the motion
    alike: dict[str, list[_Judged]] = {}
    for row, listing in judged:
        said = {name: value for name, value in row.items() if name not in HEAD[:2]}
        alike.setdefault(repr((said, listing)), []).append((row, listing))
    groups = list(alike.values())
    for group in groups:
        if (listing := group[0][1]) is not None:  # a row per configuration of the motion
            texts = (map(_cell, cells) for cells in listing.rows)
            say(new_table(_labels(group), *right(*listing.names), rows=texts))
    for table in _tables([[row for row, _ in group] for group in groups], plain_console().width):
        say(table)
    for group in groups:
        for departure in group[0][0][DEPARTURES]:
            say(f"{_labels(group)} – no solution of the task: {departure}")
    for remark in dict.fromkeys(remark for row in rows for remark in row.get(REMARKS, ())):
        say(remark)
    return 0


def _labels(group: Sequence[_Judged]) -> str:
    return ", ".join(row["label"] for row, _ in group)


def _motions(arguments: argparse.Namespace) -> Sequence[FittingMotion]:
    words: list[str] = arguments.overrides
    if arguments.write is not None and arguments.write.suffix != ".json":
        raise MotionFileError(f"--write: must be a file that ends in .json, was {arguments.write}")
    hashes = [word for word in words if HEX.fullmatch(word) and not Path(word).exists()]
    if all(word.endswith(".mcap") or word in hashes for word in words):
        return [stored_motion(named_log(word, arguments.replicate)[0]) for word in words]
    if arguments.replicate is not None:
        raise MotionFileError("--replicate: must go with a hash, was given with an experiment")
    asked: Any = {"multirun": arguments.multirun, "only": arguments.only}
    if arguments.write is not None and not any(is_motion(word) for word in words):
        return [motion_files.initial_motion(words, **asked)]
    return fitting_motions(words, **asked)[1]


def _tables(columns: list[list[dict[str, Any]]], width: int) -> list[Table]:
    """Return a table with one column per group of conditions; more in a narrow terminal."""
    apart, rows = (*HEAD, DEPARTURES, REMARKS), [row for group in columns for row in group]
    names = list(dict.fromkeys(name for row in rows for name in row if name not in apart))
    longest_word = max(len(word) for row in rows for word in row["label"].split())
    column = min(max(12, longest_word), 40) + 3
    count = max(1, (width - max(map(len, names)) - 4) // column)
    tables = []
    for k in range(0, len(columns), count):
        shown = columns[k : k + count]
        heads = [[f"{row['label']}\n{row['condition'][:12]}" for row in group] for group in shown]
        cells = ((name, *(_cell(group[0].get(name)) for group in shown)) for name in names)
        first, others = Column(no_wrap=True), right(*map("\n".join, heads))
        tables.append(new_table("", first, *others, rows=cells))
    return tables


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or value == "":
        return "–"
    return value.replace(PAIR, PAIR + "\n") if isinstance(value, str) else f"{value:.6g}"
