"""`evoexp evaluate`: judge a given motion by a configuration's criteria."""

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from evoexp.collision.certifier.certificate import PAIR
from evoexp.commands.arguments import add_experiment_arguments
from evoexp.commands.console import add_columns, new_table, plain_console
from evoexp.configuration import expansions
from evoexp.errors import MotionFileError
from evoexp.planners.planner import judge_motion
from evoexp.records import FloatArray

HEAD = (
    "label",
    "condition",
    "length_unit",
)  # what a row says of its condition; everything else is a term
LARGEST = float(np.finfo(np.float64).max)
MAX_DEPTH = 16  # nested lists; no planner's shape comes near


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_experiment_arguments(parser)
    for action in parser._actions:
        if action.dest == "overrides":
            action.metavar, action.nargs = "MOTION | KEY=VALUE", "+"
            action.help = (
                "a motion file (.json: nested lists, .npy: an array) in the planner's documented "
                "shape, start and goal included, and an experiment with overrides as for run"
            )
    parser.add_argument(
        "--json", action="store_true", help="print flat JSON: one object, or a list of them"
    )


def main(arguments: argparse.Namespace) -> int:
    """Print terms and exact verdict of the motion, one column per condition that it fits."""
    overrides, path = motion_file(arguments.overrides)
    values = read_motion(path)
    rows: list[dict[str, Any]] = []
    misfits = []
    listings: list[tuple[str, list[str], list[list[Any]]]] = []
    for experiment in expansions.expand(
        overrides, multirun=arguments.multirun, only=arguments.only
    ):
        for label, condition in experiment.conditions:
            planner, problem = condition.prepare()
            shape = planner.shape(problem)
            solution = flatten(values, shape)
            if solution is None:
                misfits.append(f"{label}: {shape_text(shape)}")
                continue
            verdict = judge_motion(planner, problem, planner.motion(problem, solution))._asdict()
            head = dict(zip(HEAD, (label, condition.id, condition.length_unit), strict=True))
            rows.append(head | planner.evaluate(problem, solution) | verdict)
            if listing := planner.listing(problem, solution):
                listings.append((label, *listing))
    if not rows:
        given = " and ".join(map(str, _shape_of(values)))
        included = (
            "" if all("numbers" in text for text in misfits) else " (start and goal included)"
        )
        raise MotionFileError(
            f"{path}: must be {'; '.join(dict.fromkeys(misfits))}{included}, was {given}"
        )
    if arguments.json:
        for row, (_, names, cells) in zip(rows, listings, strict=False):
            row["rows"] = [dict(zip(names, values, strict=True)) for values in cells]
        plain = [{name: _finite(value) for name, value in row.items()} for row in rows]
        print(
            json.dumps(
                plain if len(rows) > 1 else plain[0], indent=2, allow_nan=False, default=_plain
            )
        )
    else:
        console = plain_console()
        for label, names, cells in listings:
            console.print(_listing(label, names, cells))
        for table in _tables(rows, console.width):
            console.print(table)
    return 0


def read_motion(path: Path) -> Any:
    """Read a motion as nested lists, or as an array from `.npy`.

    Raises:
        MotionFileError: If the file is missing, of another kind, or holds anything but finite
            numbers.
    """
    try:
        if path.suffix == ".npy":
            with open(path, "rb") as file:
                values: Any = np.lib.format.read_array(file, allow_pickle=False).tolist()
        elif path.suffix == ".json":
            values = json.loads(path.read_text())
        else:
            raise MotionFileError(f"{path}: a motion file ends in .json or .npy")
    except OSError as error:
        raise MotionFileError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, EOFError, RecursionError, MemoryError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise MotionFileError(f"{path}: is no {path.suffix[1:]} of numbers: {reason}") from None
    if wrong := _not_finite(values, ""):
        raise MotionFileError(f"{path}: must hold nested lists of finite numbers, {wrong}")
    return values


def flatten(values: list[Any], shape: Any) -> FloatArray | None:
    """Return a motion as a flat solution of a planner's documented shape, None if it does not fit.

    A shape that begins with an ellipsis is that of any number of equal parts.
    """
    shape = _counted(shape, len(values) if isinstance(values, list) else 0)
    if len(values) != len(shape):
        return None
    parts = []
    for part, expected in zip(values, shape, strict=True):
        try:
            array = np.asarray(part, dtype=np.float64)
        except ValueError:  # ragged
            return None
        if array.shape != tuple(expected):
            return None
        parts.append(array.ravel())
    return np.concatenate(parts)


def motion_file(words: list[str]) -> tuple[list[str], Path]:
    """Tell the motion file from the overrides.

    Raises:
        MotionFileError: If there is not one.
    """
    files = [word for word in words if "=" not in word]
    if len(files) != 1:
        raise MotionFileError(
            f"motion file: one is needed (.json or .npy), got {len(files)}: "
            f"{' '.join(files) or 'none'}"
        )
    return [word for word in words if "=" in word], Path(files[0])


def _not_finite(values: Any, place: str) -> str:
    """Return the first thing that is no finite number, and where; nothing if there is none."""
    if isinstance(values, list) and place.count("[") <= MAX_DEPTH:
        return next(
            (
                wrong
                for k, value in enumerate(values)
                if (wrong := _not_finite(value, f"{place}[{k}]"))
            ),
            "",
        )
    if place and type(values) in (int, float) and abs(values) < math.inf and abs(values) <= LARGEST:
        return ""
    return f"was {str(values)[:40]} at {place or 'its top'}"


def _counted(shape: Any, count: int) -> Any:
    """Return a shape whose parts are counted."""
    return tuple(shape[1:]) * count if len(shape) and shape[0] is ... else shape


def shape_text(shape: Any) -> str:
    """Say a planner's documented shape."""
    if len(shape) and shape[0] is ...:
        return f"any number × {shape_text(shape[1:]).removeprefix('1 × ')}"
    if not any(shape):
        return f"{len(shape)} numbers"
    parts = [" × ".join(map(str, part)) for part in shape]
    return (
        f"{len(parts)} × {parts[0]}"
        if len(set(parts)) == 1
        else f"{len(parts)} lists: {', '.join(parts)}"
    )


def _shape_of(values: Any) -> list[str]:
    try:
        return [" × ".join(map(str, np.asarray(values, dtype=np.float64).shape))]
    except ValueError:
        return [f"a ragged list of {len(values)}"]


def _finite(value: Any) -> Any:
    """Return null for the clearance of what nothing is near, which JSON has no number for."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else str(value)


def _listing(label: str, names: list[str], rows: list[list[Any]]) -> Table:
    """Return a table with one row per configuration of the motion."""
    table = new_table(label)
    add_columns(table, *names, right=True)
    for row in rows:
        table.add_row(*(_cell(value) for value in row))
    return table


def _tables(rows: list[dict[str, Any]], width: int) -> list[Table]:
    """Return a table with one column per condition.

    Several where the terminal is too narrow for one.
    """
    names = list(dict.fromkeys(name for row in rows for name in row if name not in HEAD))
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
