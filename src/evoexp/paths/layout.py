"""The layout of strings of via-points in memory, and checks that protect the memory beside them.

`via_points  # (nq, N + 1, lanes)` is float64, C-contiguous, individuals (lanes) innermost and
padded to a multiple of eight; point 0 is the start, point N the goal. The joints of arm a are the
rows `arm_slices[a, 0] : arm_slices[a, 1]` of the first axis. Kernels may also work on the padding
up to the next multiple of eight; what stands there is never read by another lane.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

LANE_MULTIPLE = 8


def check_array(name: str, array: Any, dtype: type, ndim: int) -> None:
    """Raise ValueError unless `array` is writeable, C-contiguous, of `dtype`, with `ndim` axes."""
    if not isinstance(array, np.ndarray):
        raise ValueError(f"{name}: must be a numpy array, was {type(array).__name__}")
    if array.dtype != dtype or array.ndim != ndim:
        raise ValueError(
            f"{name}: must be {np.dtype(dtype).name} with {ndim} axes, was {array.dtype.name} "
            f"with {array.ndim}"
        )
    if not (array.flags.c_contiguous and array.flags.writeable):
        raise ValueError(f"{name}: must be C-contiguous and writeable")


def check_shape(name: str, array: NDArray[Any], shape: tuple[int, ...]) -> None:
    """Raise ValueError unless `array` has exactly `shape`."""
    if array.shape != shape:
        raise ValueError(f"{name}: must have shape {shape}, was {array.shape}")


def check_via_points(via_points: NDArray[np.float64]) -> None:
    """Raise ValueError unless `via_points` (nq, N + 1, lanes) has the layout that kernels need."""
    check_array("via_points", via_points, np.float64, 3)
    nq, num_points, lanes = via_points.shape
    if nq < 1 or num_points < 2:
        raise ValueError(
            "via_points: must have at least one joint and two points, was of shape "
            f"{via_points.shape}"
        )
    if lanes < LANE_MULTIPLE or lanes % LANE_MULTIPLE:
        raise ValueError(
            f"via_points: lanes must be a positive multiple of {LANE_MULTIPLE}, was {lanes}"
        )


def check_arm_slices(arm_slices: NDArray[np.int64], nq: int, max_joints: int | None = None) -> None:
    """Raise ValueError unless the rows of `arm_slices` (arms, 2) are slices of 0..nq.

    Each must hold 1..max_joints joints.
    """
    check_array("arm_slices", arm_slices, np.int64, 2)
    if arm_slices.shape[1] != 2:
        raise ValueError(f"arm_slices: must have shape (arms, 2), was {arm_slices.shape}")
    most = nq if max_joints is None else max_joints
    for first, stop in arm_slices.tolist():
        if not 0 <= first < stop <= nq or stop - first > most:
            raise ValueError(
                f"arm_slices: must be slices of 0..{nq} with 1..{most} joints, was [{first}, "
                f"{stop})"
            )


def padded(num_lanes: int, lanes: int) -> int:
    """Return `num_lanes` rounded up to a multiple of eight.

    Raises:
        ValueError: Unless 1 <= num_lanes <= lanes.
    """
    if not 1 <= num_lanes <= lanes:
        raise ValueError(f"num_lanes: must be 1..{lanes}, was {num_lanes}")
    return -(-num_lanes // LANE_MULTIPLE) * LANE_MULTIPLE
