"""Covers by spheres, kept on disk: those of a robot's hulls take seconds, and change with nothing.

They are kept under the body's shape and placement, the inflation, and the code and the libraries
that find them.
"""

import contextlib
import functools
import hashlib
import json
from importlib import metadata
from typing import Any

import numpy as np

from evoexp.collision.box_support import EXACT, coal
from evoexp.collision.covers.body_covers import Cover, sphere_cover
from evoexp.numeric.cache_folder import Damaged, cache_root, read_kept, write_kept
from evoexp.numeric.kernel_folders import sources_key

_LIBRARIES = ("numpy", "scipy", "coal")
_SIZES = ("radius", "halfLength", "halfSide", "radii")  # of coal's shapes


def kept_sphere_cover(item: Any, inflation: float) -> Cover:
    """Return the cover of `sphere_cover`, from where it is kept if it was found before.

    Args:
        item: As of `sphere_cover`.
        inflation: As of `sphere_cover`.

    Raises:
        UnsupportedShape: As `sphere_cover`.
    """
    if isinstance(item.geometry, coal.Sphere | coal.Capsule):
        return sphere_cover(item, inflation)
    digest = hashlib.sha256(_code())
    for part in (*_shape(item.geometry), item.placement.homogeneous, inflation):
        digest.update(np.ascontiguousarray(part, dtype=np.float64).tobytes())
    digest.update(type(item.geometry).__name__.encode())
    path = cache_root() / "covers" / digest.hexdigest()[:32]
    with contextlib.suppress(FileNotFoundError, Damaged):
        start, end, radius, reach = json.loads(read_kept(path))
        return Cover(np.array(start), np.array(end), np.array(radius), reach)
    found = sphere_cover(item, inflation)
    start, end, radius = (array.tolist() for array in found[:3])
    with contextlib.suppress(OSError):
        write_kept(path, json.dumps([start, end, radius, float(found.inflation)]).encode())
    return found


def _shape(shape: Any) -> list[Any]:
    """Return all numbers that a shape consists of."""
    if isinstance(shape, coal.ConvexBase):
        faces = range(shape.num_polygons if hasattr(shape, "polygons") else 0)
        points = [shape.point(k) for k in range(shape.num_points)]
        return [points, [_corners(shape.polygons(k)) for k in faces]]
    if isinstance(shape, coal.BVHModelBase):
        points = [shape.vertex(k) for k in range(shape.num_vertices)]
        return [points, [_corners(shape.tri_indices(k)) for k in range(shape.num_tris)]]
    return [getattr(shape, name) for name in _SIZES if hasattr(shape, name)]


def _corners(triangle: Any) -> list[int]:
    return [int(triangle[k]) for k in range(3)]


@functools.cache
def _code() -> bytes:
    versions = [*map(metadata.version, _LIBRARIES)]
    return hashlib.sha256(json.dumps([*versions, EXACT, sources_key()]).encode()).digest()
