"""The words that choose motions: hashes of stored runs, logs, a file; and the file to write.

A page that is kept is found by them without loading what draws one.
"""

import argparse
import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from evoexp import shipped
from evoexp.commands.arguments import add_config_dir_argument, is_motion, is_override
from evoexp.commands.hashes import with_candidates
from evoexp.commands.run_origins import origin_of
from evoexp.errors import (
    EvoexpError,
    MotionFileError,
    NothingStored,
    SettingError,
    UnknownHash,
    printable,
)
from evoexp.store.chosen_logs import CHOICES, chosen_log
from evoexp.store.files import write_file
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve

FOLDER = "motions"  # of the outputs
MANY = 4  # motions on one page


class ChosenLog(NamedTuple):
    """The log whose motion is meant.

    Attributes:
        path: Of the log.
        title: Of the motion.
        run: The run that the log is of, if a hash chose it.
    """

    path: Path
    title: str
    run: RunDirectory | None


def add_motion_arguments(parser: argparse.ArgumentParser, ending: str) -> None:
    """Declare the arguments that choose motions, their speed, and the file to write."""
    add_config_dir_argument(parser)
    parser.add_argument(
        "what",
        nargs="+",
        metavar="HASH | LOG.mcap | MOTION KEY=VALUE",
        help="any unique prefix of a run's hash, or a replicate's log; or a motion file, as for "
        "evaluate, with an experiment",
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--replicate", type=int, metavar="K", help="this replicate of the run")
    for name, text in zip(
        CHOICES,
        ("of least cost (the default)", "of greatest cost", "first refuted one"),
        strict=True,
    ):
        which.add_argument(
            f"--{name}",
            dest="choice",
            action="store_const",
            const=name,
            help=f"the replicate: {text}",
        )
    parser.add_argument(
        "--only", default="", metavar="LABEL", help="of an experiment's conditions, this one"
    )
    parser.add_argument(
        "--turn-speed", type=float, default=45.0, metavar="DEG/S", help="limit of joints that turn"
    )
    parser.add_argument(
        "--slide-speed", type=float, metavar="UNIT/S", help="limit of joints that slide"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar=f"FILE{ending}", help="by default in outputs/motions/"
    )


def chosen_logs(arguments: argparse.Namespace) -> list[ChosenLog]:
    """Return the logs that the words choose; none where they name a motion file.

    Raises:
        EvoexpError: One line says what is wrong.
    """
    words: list[str] = arguments.what
    if any(is_override(word) or is_motion(word) for word in words):
        return []
    if len(words) > MANY:
        raise MotionFileError(f"motions: at most {MANY} go together, got {len(words)}")
    chosen = arguments.replicate if arguments.replicate is not None else arguments.choice
    runs = [run_or_log(word) for word in words]
    return [
        ChosenLog(run, run.name, None)
        if isinstance(run, Path)
        else ChosenLog(chosen_log(run, CHOICES[0] if chosen is None else chosen), _title(run), run)
        for run in runs
    ]


def check_speeds(arguments: argparse.Namespace) -> None:
    """Refuse speed limits of joints that are not above 0.

    Raises:
        SettingError: If one is not.
    """
    for name in ("turn_speed", "slide_speed"):
        value = getattr(arguments, name)
        if value is not None and not 0.0 < value < math.inf:
            raise SettingError(f"--{name.replace('_', '-')}", "greater than 0", value)


def output_path(arguments: argparse.Namespace, names: Iterable[str], ending: str) -> Path:
    """Return the path of the file to write.

    Args:
        arguments: Of the command.
        names: Of the motions, for a file that takes its name from them.
        ending: Of the file.
    """
    if arguments.output is not None:
        return Path(arguments.output)
    given = [Path(word).stem for word in arguments.what if is_motion(word)]
    return outputs_root() / FOLDER / ("+".join(given or names) + ending)


def write(path: Path, content: bytes, *, is_said: bool = True) -> None:
    """Write a file whole or not at all, and say where it is and how large."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, content)
    if not is_said:
        return
    size = len(content) / 1000
    print(
        f"{printable(str(path))}  ({f'{size / 1000:.2f} MB' if size >= 1000 else f'{size:.0f} kB'})"
    )


def run_or_log(word: str) -> RunDirectory | Path:
    """Return the run that a hash names, or the path of a log.

    Raises:
        EvoexpError: If the hash names none.
    """
    path = Path(word)
    if path.suffix == ".mcap" or path.is_file():
        return path
    try:
        return resolve(outputs_root(), word)
    except UnknownHash as error:
        raise _not_here(word, error) from None


def _not_here(word: str, error: UnknownHash) -> EvoexpError:
    found = shipped.find(word)
    if len(found) == 1:
        return NothingStored(
            f"condition {found[0].condition_id[:12]}: not run here; run it: {found[0].command}"
        )
    return with_candidates(error, outputs_root())


def _title(run: RunDirectory) -> str:
    """Name a run's experiment and condition as `list` does; by its hash if these are not known."""
    origin = origin_of(run)
    words = [str(origin[name]) for name in ("experiment", "label") if origin.get(name)]
    return " · ".join(dict.fromkeys(words)) or run.hash12
