"""Files of motions: nested lists in a planner's shape, or joint trajectories; what they fit."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.batch.reproduction import stored_condition
from evoexp.commands.command_parser import MOTION_ENDINGS, is_motion
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import MotionFileError, printable
from evoexp.input_files import MEGABYTE, TableError, read_bounded, read_npy
from evoexp.paths.motion import Motion
from evoexp.playback import trajectory_files
from evoexp.playback.recording import joints_of
from evoexp.playback.trajectory_files import LARGEST, JointTrajectory, fitted, parse_message
from evoexp.records import FloatArray
from evoexp.robots.assembly import Robot
from evoexp.store.log_reader import read_log

MAX_MOTION = 8 * MEGABYTE
MOST_VALUES = 200_000  # numbers of a motion; the longest of a shipped experiment has 4,000
MAX_DEPTH = 16  # nested lists; no planner's shape comes near
ENDINGS = f"{', '.join(MOTION_ENDINGS[:-1])} or {MOTION_ENDINGS[-1]}"
JUDGED = "a joint trajectory: judged by its bodies, not by where it begins and ends"


class FittingMotion(NamedTuple):
    """A motion file in a condition whose shape of solutions it has."""

    label: str  # of the condition
    condition: Condition
    solution: FloatArray  # flat; empty: the file holds a joint trajectory
    motion: Motion | None  # None: the solution has none
    remarks: tuple[str, ...] = ()  # on how a trajectory was read


def fitting_motions(
    words: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> tuple[Path, list[FittingMotion]]:
    """Return the motion file among words, and the conditions of the others whose shape it has."""
    files = [word for word in words if is_motion(word) or Path(word).exists()]
    overrides = [word for word in words if word not in files]
    if len(files) != 1:
        found = " ".join(files) or "none"
        raise MotionFileError(f"motion file: one is needed ({ENDINGS}), got {len(files)}: {found}")
    path = Path(files[0])
    values = read_motion(path)
    fitting, misfits = [], dict[str, None]()
    for experiment in compose.expand(overrides, multirun=multirun, only=only):
        for label, condition in experiment.conditions:
            try:
                fitting.append(_fitting(label, condition, values))
            except ValueError as misfit:
                misfits[str(misfit)] = None
    if not fitting and isinstance(values, JointTrajectory):
        raise MotionFileError(f"{path}: {'; '.join(misfits)}")
    if not fitting:
        plain = all("numbers" in text for text in misfits)
        included = "" if plain else " (start and goal included)"
        raise MotionFileError(
            f"{path}: must be {'; '.join(misfits)}{included}, was {shape_of(values)}"
        )
    return path, fitting


def stored_motion(log: Path) -> FittingMotion:
    """Return the best solution of a log, in the condition that is attached to it."""
    contents = read_log(log)
    label = f"{contents.condition_id[:12]} #{contents.replicate}"
    return _solved(label, stored_condition(log, contents), contents.solutions[-1].values)


def initial_motion(
    words: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> FittingMotion:
    """Return the best of an initial population, in the first of conditions of one shape."""
    experiments = compose.expand(words, multirun=multirun, only=only)
    conditions = [each for experiment in experiments for each in experiment.conditions]
    prepared = [each.condition.prepare() for each in conditions]
    shapes = dict.fromkeys(shape_text(planner.shape(problem)) for planner, problem in prepared)
    if len(shapes) > 1:
        raise MotionFileError(
            f"--write: solutions differ in shape ({'; '.join(shapes)}); choose with --only "
            + " | ".join(repr(each.label) for each in conditions)
        )
    (label, condition), (planner, problem) = conditions[0], prepared[0]
    first = next(planner.evolve(problem, condition.rng(0)))
    return _solved(label, condition, first.best)


def _solved(label: str, condition: Condition, solution: FloatArray) -> FittingMotion:
    planner, problem = condition.prepare()
    return FittingMotion(label, condition, solution, planner.motion(problem, solution))


def _fitting(label: str, condition: Condition, values: Any) -> FittingMotion:
    """Return the content of a motion file in a condition; ValueError: it does not fit."""
    planner, problem = condition.prepare()
    if not isinstance(values, JointTrajectory):
        shape = planner.shape(problem)
        if (solution := flatten(values, shape)) is None:
            raise ValueError(f"{label}: {shape_text(shape)}")
        return _solved(label, condition, solution)
    if not isinstance(condition.robot, Robot):
        raise ValueError(f"{label}: its robot has no joints for a trajectory")
    joints = joints_of(condition.robot.build())
    motion, remarks = fitted(values, joints, condition.length_unit)
    if len(planner.parts(problem, motion)) > 1:
        raise ValueError(
            f"{label}: bodies are picked up or put down on the way, which a trajectory cannot "
            "hold; give the solution (evaluate HASH --write FILE.json)"
        )
    return FittingMotion(label, condition, np.empty(0), motion, (JUDGED, *remarks))


# what is in a file


def read_motion(path: Path) -> Any:
    """Read a motion as nested lists (an array from `.npy`), or a joint trajectory."""
    try:
        if path.suffix not in MOTION_ENDINGS:
            raise MotionFileError(f"{path}: a motion file ends in {ENDINGS}")
        content = read_bounded(path, MAX_MOTION)
        if path.suffix == ".csv":
            return trajectory_files.read_columns(content)
        if path.suffix == ".npy":
            values = read_npy(content).tolist()
        else:
            values = parse_message(content.decode("utf-8-sig"), path.suffix != ".json")
    except TableError as error:
        raise MotionFileError(f"{path}, {error}") from None
    except OSError as error:
        raise MotionFileError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, EOFError, RecursionError, MemoryError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise MotionFileError(f"{path}: is no {path.suffix[1:]} of numbers: {reason}") from None
    if isinstance(values, dict):
        try:
            return trajectory_files.read_message(values)
        except ValueError as error:
            raise MotionFileError(f"{path}: {error}") from None
    if (count := _num_values(values)) > MOST_VALUES:
        must = f"{path}: must hold at most {MOST_VALUES:,} numbers"
        raise MotionFileError(f"{must}, was {count:,}")
    if wrong := _not_finite(values, ""):
        raise MotionFileError(f"{path}: must hold nested lists of finite numbers, {wrong}")
    return values


def _num_values(values: Any) -> int:
    count, lists = 0, [values] if isinstance(values, list) else []
    while lists:
        inner = lists.pop()
        count += len(inner)
        lists += [value for value in inner if isinstance(value, list)]
    return count


def _not_finite(values: Any, place: str) -> str:
    """Return the first entry that is no finite number, and its place; nothing if there is none."""
    if isinstance(values, list) and place.count("[") <= MAX_DEPTH:
        wrong = (_not_finite(value, f"{place}[{k}]") for k, value in enumerate(values))
        return next(filter(None, wrong), "")
    was = f"was {printable(str(values)[:40])} at {place or 'its top'}"
    if place and type(values) in (int, float) and abs(values) < math.inf:
        return "" if abs(values) <= LARGEST else f"of at most {LARGEST:g}, {was}"
    return was


def nested(solution: FloatArray, shape: Any) -> list[Any]:
    """Return a flat solution as nested lists of a planner's documented shape, for `flatten`."""
    if len(shape) and shape[0] is ...:
        count = solution.size // sum(math.prod(part) for part in shape[1:])
        shape = tuple(shape[1:]) * count
    ends = np.cumsum([math.prod(part) for part in shape])
    parts = zip(np.split(solution, ends[:-1]), shape, strict=True)
    return [values.reshape(part).tolist() for values, part in parts]


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


def shape_of(values: Any) -> str:
    """Say the shape of nested lists."""
    try:
        return " × ".join(map(str, np.asarray(values, dtype=np.float64).shape))
    except ValueError:
        return f"a ragged list of {len(values)}"
