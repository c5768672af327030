"""A motion out of a file or a log: recognised among the words, read, fitted to a condition."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.attachments import PREFIX, keep_all
from evoexp.commands.arguments import MOTION_ENDINGS, is_motion
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.errors import MotionFileError, printable
from evoexp.input_files import MEGABYTE, TableError, read_bounded, read_npy
from evoexp.paths.motion import Motion
from evoexp.playback.recording import joints_of
from evoexp.playback.trajectory_files import (
    LARGEST,
    Columns,
    JointTrajectory,
    fitted,
    parse_message,
    read_columns,
    read_message,
)
from evoexp.records import FloatArray, generations
from evoexp.robots.assembly import Robot
from evoexp.store.log_reader import read_log

MAX_MOTION = 8 * MEGABYTE
MOST_VALUES = 200_000  # numbers of a motion; the longest of a shipped experiment has 4,000
ENDINGS = f"{', '.join(MOTION_ENDINGS[:-1])} or {MOTION_ENDINGS[-1]}"
JUDGED = "a joint trajectory: judged by its bodies, not by where it begins and ends"
MAX_DEPTH = 16  # nested lists; no planner's shape comes near


class FittingMotion(NamedTuple):
    """A motion file in a condition whose shape of solutions it has.

    Attributes:
        label: Of the condition.
        condition: The condition.
        planner: Its planner.
        problem: Its problem.
        solution: The motion as a flat solution; empty: the file holds a joint trajectory.
        motion: The motion; None: the solution has none.
        remarks: On how a trajectory was read.
    """

    label: str
    condition: Condition
    planner: Any
    problem: Any
    solution: FloatArray
    motion: Motion | None
    remarks: tuple[str, ...] = ()

    @property
    def is_trajectory(self) -> bool:
        """Whether the file holds a joint trajectory, of which a planner knows no terms."""
        return not self.solution.size


def fitting_motions(
    words: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> tuple[Path, list[FittingMotion]]:
    """Read the motion file among some words, and fit it into the conditions that the others choose.

    Args:
        words: One motion file, and overrides as `run` takes them.
        multirun: Whether values with commas are swept over.
        only: Labels of the conditions to keep.

    Returns:
        The file, and the conditions whose shape the motion has.

    Raises:
        MotionFileError: If there is not one file, if it cannot be read, or if it fits no condition.
    """
    files = [word for word in words if is_motion(word) or Path(word).exists()]
    overrides = [word for word in words if word not in files]
    if len(files) != 1:
        found = " ".join(files) or "none"
        raise MotionFileError(f"motion file: one is needed ({ENDINGS}), got {len(files)}: {found}")
    path = Path(files[0])
    values = read_motion(path)
    fitting, misfits = [], []
    for experiment in expansions.expand(overrides, multirun=multirun, only=only):
        for label, condition in experiment.conditions:
            planner, problem = condition.prepare()
            if isinstance(values, Columns | JointTrajectory):
                try:
                    fitting.append(_trajectory(label, condition, values))
                except ValueError as error:
                    misfits.append(str(error))
                continue
            shape = planner.shape(problem)
            solution = flatten(values, shape)
            if solution is None:
                misfits.append(f"{label}: {shape_text(shape)}")
            else:
                fitting.append(_solved(label, condition, planner, problem, solution))
    if not fitting and isinstance(values, Columns | JointTrajectory):
        raise MotionFileError(f"{path}: {'; '.join(dict.fromkeys(misfits))}")
    if not fitting:
        plain = all("numbers" in text for text in misfits)
        included = "" if plain else " (start and goal included)"
        raise MotionFileError(
            f"{path}: must be {'; '.join(dict.fromkeys(misfits))}{included}, "
            f"was {_shape_of(values)}"
        )
    return path, fitting


def _trajectory(
    label: str, condition: Condition, given: Columns | JointTrajectory
) -> FittingMotion:
    """Return a trajectory as a motion of a condition's robot.

    Raises:
        ValueError: If it does not fit.
    """
    planner, problem = condition.prepare()
    if not isinstance(condition.robot, Robot):
        raise ValueError(f"{label}: its robot has no joints for a trajectory")
    joints = joints_of(condition.robot.build())
    motion, remarks = fitted(given, joints, condition.length_unit)
    if len(planner.parts(problem, motion)) > 1:
        raise ValueError(
            f"{label}: bodies are picked up or put down on the way, which a trajectory does not "
            "tell; give the solution (evaluate HASH --write FILE.json)"
        )
    remarks = (JUDGED, *remarks)
    return FittingMotion(label, condition, planner, problem, np.empty(0), motion, remarks)


def stored_motion(log: Path) -> FittingMotion:
    """Return the best solution of a log, in the condition that is attached to it.

    Raises:
        CorruptLog: If the log cannot be trusted.
        RevisionMismatch: If it was made by another revision of a component.
    """
    contents = read_log(log)
    keep_all(data for name, data in contents.attachments.items() if name.startswith(PREFIX))
    condition = Condition.from_json(contents.config_json)
    label = f"{contents.condition_id[:12]} #{contents.replicate}"
    return _solved(label, condition, *condition.prepare(), contents.solutions[-1].values)


def initial_motion(
    words: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> FittingMotion:
    """Return the best of an initial population, in the first of the conditions that words choose.

    Raises:
        MotionFileError: If their solutions have different shapes.
    """
    chosen = [
        each
        for experiment in expansions.expand(words, multirun=multirun, only=only)
        for each in experiment.conditions
    ]
    prepared = [each.condition.prepare() for each in chosen]
    shapes = dict.fromkeys(shape_text(planner.shape(problem)) for planner, problem in prepared)
    if len(shapes) > 1:
        raise MotionFileError(
            f"--write: solutions differ in shape ({'; '.join(shapes)}); choose with --only "
            + " | ".join(repr(each.label) for each in chosen)
        )
    (label, condition), (planner, problem) = chosen[0], prepared[0]
    first = next(generations(planner.evolve(problem, condition.rng(0))))
    return _solved(label, condition, planner, problem, first.best)


def _solved(
    label: str, condition: Condition, planner: Any, problem: Any, solution: FloatArray
) -> FittingMotion:
    motion = planner.motion(problem, solution)
    return FittingMotion(label, condition, planner, problem, solution, motion)


def nested(solution: FloatArray, shape: Any) -> list[Any]:
    """Return a flat solution as nested lists of a planner's documented shape, for `flatten`."""
    if len(shape) and shape[0] is ...:
        count = solution.size // sum(math.prod(part) for part in shape[1:])
        shape = tuple(shape[1:]) * count
    ends = np.cumsum([math.prod(part) for part in shape])
    parts = zip(np.split(solution, ends[:-1]), shape, strict=True)
    return [values.reshape(part).tolist() for values, part in parts]


def read_motion(path: Path) -> Any:
    """Read a motion as nested lists (an array from `.npy`), or a joint trajectory.

    Raises:
        MotionFileError: If the file is missing, of another kind, or holds anything but finite
            numbers.
    """
    try:
        if path.suffix not in MOTION_ENDINGS:
            raise MotionFileError(f"{path}: a motion file ends in {ENDINGS}")
        content = read_bounded(path, MAX_MOTION)
        if path.suffix == ".csv":
            return read_columns(content)
        is_array, is_yaml = path.suffix == ".npy", path.suffix != ".json"
        values: Any = (
            read_npy(content).tolist()
            if is_array
            else parse_message(content.decode("utf-8-sig"), is_yaml)
        )
    except TableError as error:
        raise MotionFileError(f"{path}, {error}") from None
    except OSError as error:
        raise MotionFileError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, EOFError, RecursionError, MemoryError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise MotionFileError(f"{path}: is no {path.suffix[1:]} of numbers: {reason}") from None
    if isinstance(values, dict):
        try:
            return read_message(values)
        except ValueError as error:
            raise MotionFileError(f"{path}: {error}") from None
    if (count := _num_values(values)) > MOST_VALUES:
        must = f"{path}: must hold at most {MOST_VALUES:,} numbers"
        raise MotionFileError(f"{must}, was {count:,}")
    if wrong := _not_finite(values, ""):
        raise MotionFileError(f"{path}: must hold nested lists of finite numbers, {wrong}")
    return values


def flatten(values: list[Any], shape: Any) -> FloatArray | None:
    """Return a motion as a flat solution of a planner's documented shape, None if it does not fit.

    A shape that begins with an ellipsis is that of any number of equal parts.
    """
    if len(shape) and shape[0] is ...:
        shape = tuple(shape[1:]) * (len(values) if isinstance(values, list) else 0)
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
    return np.concatenate(parts) if parts else None


def shape_text(shape: Any) -> str:
    """Say a planner's documented shape."""
    if len(shape) and shape[0] is ...:
        return f"any number × {shape_text(shape[1:]).removeprefix('1 × ')}"
    if not any(shape):
        return f"{len(shape)} numbers"
    parts = [" × ".join(map(str, part)) for part in shape]
    if len(set(parts)) == 1:
        return f"{len(parts)} × {parts[0]}"
    return f"{len(parts)} lists: {', '.join(parts)}"


def _shape_of(values: Any) -> str:
    try:
        return " × ".join(map(str, np.asarray(values, dtype=np.float64).shape))
    except ValueError:
        return f"a ragged list of {len(values)}"


def _num_values(values: Any) -> int:
    """Return how many numbers and lists there are in nested lists, however deep."""
    count, lists = 0, [values] if isinstance(values, list) else []
    while lists:
        inner = lists.pop()
        count += len(inner)
        lists += [value for value in inner if isinstance(value, list)]
    return count


def _not_finite(values: Any, place: str) -> str:
    """Return the first entry that is no finite number, and its place; nothing if there is none."""
    if isinstance(values, list) and place.count("[") <= MAX_DEPTH:
        found = (_not_finite(value, f"{place}[{k}]") for k, value in enumerate(values))
        return next(filter(None, found), "")
    if place and type(values) in (int, float) and abs(values) < math.inf:
        return "" if abs(values) <= LARGEST else f"of at most {LARGEST:g}, {_was(values, place)}"
    return _was(values, place)


def _was(values: Any, place: str) -> str:
    return f"was {printable(str(values)[:40])} at {place or 'its top'}"
