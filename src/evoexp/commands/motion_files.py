"""Files of motions: nested lists in a planner's documented shape, or joint trajectories."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from evoexp.commands.arguments import MOTION_ENDINGS
from evoexp.errors import MotionFileError, printable
from evoexp.input_files import MEGABYTE, TableError, read_bounded, read_npy
from evoexp.playback.trajectory_files import LARGEST, parse_message, read_columns, read_message
from evoexp.records import FloatArray

MAX_MOTION = 8 * MEGABYTE
MOST_VALUES = 200_000  # numbers of a motion; the longest of a shipped experiment has 4,000
MAX_DEPTH = 16  # nested lists; no planner's shape comes near
ENDINGS = f"{', '.join(MOTION_ENDINGS[:-1])} or {MOTION_ENDINGS[-1]}"


def read_motion(path: Path) -> Any:
    """Read a motion as nested lists (an array from `.npy`), or a joint trajectory."""
    try:
        if path.suffix not in MOTION_ENDINGS:
            raise MotionFileError(f"{path}: a motion file ends in {ENDINGS}")
        content = read_bounded(path, MAX_MOTION)
        if path.suffix == ".csv":
            return read_columns(content)
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
            return read_message(values)
        except ValueError as error:
            raise MotionFileError(f"{path}: {error}") from None
    if (count := _num_values(values)) > MOST_VALUES:
        must = f"{path}: must hold at most {MOST_VALUES:,} numbers"
        raise MotionFileError(f"{must}, was {count:,}")
    if wrong := _not_finite(values, ""):
        raise MotionFileError(f"{path}: must hold nested lists of finite numbers, {wrong}")
    return values


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
