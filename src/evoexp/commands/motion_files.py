"""The motions that a command shows or writes: of stored replicates, of logs, or out of a file."""

import argparse
import math
from pathlib import Path

from evoexp import shipped
from evoexp.commands.arguments import add_config_dir_argument, is_override
from evoexp.commands.given_motion import fitting_motions, is_motion
from evoexp.commands.hashes import with_candidates
from evoexp.commands.list_ import origin_of
from evoexp.errors import (
    EvoexpError,
    MotionFileError,
    NothingStored,
    RevisionMismatch,
    SettingError,
    UnknownHash,
    printable,
)
from evoexp.playback.recording import Heading, Recording, record
from evoexp.playback.stored import CHOICES, chosen_log, stored_recording
from evoexp.playback.timing import SpeedLimits
from evoexp.store.files import write_file
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve

FOLDER = "motions"  # of the outputs
MANY = 4  # motions on one page


def add_motion_arguments(parser: argparse.ArgumentParser, ending: str) -> None:
    """Declare the arguments that choose motions, their speed, and the file to write."""
    add_config_dir_argument(parser)
    parser.add_argument(
        "what",
        nargs="+",
        metavar="HASH | LOG.mcap | MOTION KEY=VALUE",
        help="any unique prefix of a run's hash, or a replicate's log; or a motion file (.json, "
        ".npy) in the planner's documented shape, as for evaluate, with an experiment",
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


def recordings(arguments: argparse.Namespace) -> list[Recording]:
    """Return the motions that the arguments choose, in the order of the words.

    Raises:
        EvoexpError: One line says what is wrong.
    """
    words: list[str] = arguments.what
    limits = speed_limits(arguments)
    if any(is_override(word) or is_motion(word) for word in words):
        return _own(words, arguments.only, limits)
    if len(words) > MANY:
        raise MotionFileError(f"motions: at most {MANY} go together, got {len(words)}")
    runs = [run_or_log(word) for word in words]
    return [
        stored_recording(run, run.name, limits)
        if isinstance(run, Path)
        else _stored(run, arguments, limits)
        for run in runs
    ]


def single(arguments: argparse.Namespace) -> Recording:
    """Return the single motion that the arguments choose.

    Raises:
        MotionFileError: If it is not one.
    """
    found = recordings(arguments)
    if len(found) != 1:
        raise MotionFileError(f"motion: one at a time, got {len(found)}; choose with --only LABEL")
    return found[0]


def output_path(arguments: argparse.Namespace, found: list[Recording], ending: str) -> Path:
    """Return the path of the file to write."""
    if arguments.output is not None:
        return Path(arguments.output)
    given = [Path(word).stem for word in arguments.what if is_motion(word)]
    names = given or [f"{r.condition_id[:12]}-{r.heading.replicate:04d}" for r in found]
    return outputs_root() / FOLDER / ("+".join(names) + ending)


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


def speed_limits(arguments: argparse.Namespace) -> SpeedLimits:
    """Return the joints' limits.

    Raises:
        SettingError: If one is not above 0.
    """
    for name in ("turn_speed", "slide_speed"):
        value = getattr(arguments, name)
        if value is not None and not 0.0 < value < math.inf:
            raise SettingError(f"--{name.replace('_', '-')}", "greater than 0", value)
    return SpeedLimits(math.radians(arguments.turn_speed), arguments.slide_speed)


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


def _stored(run: RunDirectory, arguments: argparse.Namespace, limits: SpeedLimits) -> Recording:
    choice = (
        arguments.replicate if arguments.replicate is not None else arguments.choice or CHOICES[0]
    )
    try:
        return stored_recording(chosen_log(run, choice), _title(run), limits)
    except RevisionMismatch as error:
        raise RevisionMismatch(
            f"run {run.hash12}: {error}; run it anew with what is installed: {run.command}"
        ) from None


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


def _own(words: list[str], only: str, limits: SpeedLimits) -> list[Recording]:
    """Return the motion of a file in every condition that it fits, in the first `MANY` of them."""
    path, fitting = fitting_motions(words, only=(only,) if only else ())
    return [
        record(each.condition, each.solution, Heading(f"{path.name} · {each.label}"), limits)
        for each in fitting[:MANY]
    ]
