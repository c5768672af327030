"""Hashes by which covers and distances of bodies are kept."""

import functools
import hashlib
import json
from collections.abc import Iterable
from importlib import metadata
from typing import Any

import numpy as np

from evoexp.collision.box_support import EXACT, coal, corners_of
from evoexp.numeric.kernel_folders import sources_key

_LIBRARIES = ("numpy", "scipy", "coal")
_SIZES = ("radius", "halfLength", "halfSide", "radii")  # of coal's shapes


def geometry_key(items: Iterable[Any], *numbers: Any) -> str:
    """Return a hash of bodies and numbers, and of the code and the libraries that work on them.

    Of a `pin.GeometryObject` its shape, placement and joint count.
    """
    digest = hashlib.sha256(_code())
    for item in items:
        digest.update(f"{type(item.geometry).__name__} {item.parentJoint}".encode())
        numbers = (*numbers, *_numbers_of(item.geometry), item.placement.homogeneous)
    for part in numbers:
        digest.update(np.ascontiguousarray(part, dtype=np.float64).tobytes())
    return digest.hexdigest()[:32]


def _numbers_of(shape: Any) -> list[Any]:
    """Return all numbers that a shape consists of."""
    if isinstance(shape, coal.ConvexBase):
        faces = range(shape.num_polygons if hasattr(shape, "polygons") else 0)
        return [corners_of(shape), [_corners(shape.polygons(k)) for k in faces]]
    if isinstance(shape, coal.BVHModelBase):
        faces = range(shape.num_tris)
        return [corners_of(shape), [_corners(shape.tri_indices(k)) for k in faces]]
    return [getattr(shape, name) for name in _SIZES if hasattr(shape, name)]


def _corners(triangle: Any) -> list[int]:
    return [int(triangle[k]) for k in range(3)]


@functools.cache
def _code() -> bytes:
    versions = [*map(metadata.version, _LIBRARIES)]
    return hashlib.sha256(json.dumps([*versions, EXACT, sources_key()]).encode()).digest()
