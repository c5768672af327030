"""Meshes and cones of a planning scene, as convex hulls that contain them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.elementary import sincos
from evoexp.records import FloatArray, IntArray
from evoexp.scenarios.moveit_files import Document, Pose
from evoexp.scenarios.obstacles import HullObstacle

Mesh = tuple[FloatArray, IntArray]
"""Corners (corners, 3) [m] and triangles (triangles, 3) of corners' numbers."""

AROUND = 32  # corners of a cone's base; they stand out of it by half a hundredth of its radius


def resources(scene: Document) -> list[str]:
    """List the files that the meshes of a scene name, as robowflex writes them."""
    world = scene.mapping(scene.root.get("world"), "world")
    objects = scene.items(world.get("collision_objects"), "world.collision_objects")
    meshes = [mesh for thing in objects if isinstance(thing, dict) for mesh in _meshes(thing)]
    return list(dict.fromkeys(str(mesh["resource"]) for mesh in meshes if mesh.get("resource")))


def mesh_hulls(
    scene: Document,
    given: dict[str, Any],
    meshes: Mapping[str, Mesh],
    pose: Pose,
    where: str,
    name: str,
) -> list[HullObstacle]:
    """Return the convex hulls of the parts of a mesh (`shape_msgs/Mesh`) that hang together.

    Args:
        meshes: Of the files that meshes of the scene name.
        pose: Where it stands.
        where: Its place in the file, for errors.
        name: Of the object; the hulls are numbered if they are several.

    Raises:
        SettingError: If it is no mesh, or a part of it has no inside.
    """
    if resource := given.get("resource"):
        if given.get("vertices") or given.get("triangles"):
            raise SettingError(scene.field, f"a resource or triangles at {where}, not both", name)
        corners, triangles = meshes[str(resource)]
        scale = given.get("dimensions")
        if scale is not None:
            corners = corners * scene.numbers(scale, f"{where}.dimensions", 3)
    else:
        corners, triangles = _own_triangles(scene, given, where, name)
    found = []
    parts = _parts(corners, triangles)
    for k, part in enumerate(parts):
        hull = hull_of(part)
        if hull is None:
            must = f"meshes with an inside ('{name}')"
            raise SettingError(scene.field, must, f"a part of {len(part)} vertices in one plane")
        found.append(_hull(hull[0], pose, f"{name}_{k + 1}" if len(parts) > 1 else name))
    return found


def _meshes(thing: dict[str, Any]) -> list[dict[str, Any]]:
    meshes = thing.get("meshes")
    return [mesh for mesh in meshes if isinstance(mesh, dict)] if isinstance(meshes, list) else []


def _own_triangles(scene: Document, given: dict[str, Any], where: str, name: str) -> Mesh:
    """Read the corners and triangles that a message holds."""
    if given.get("dimensions"):
        must = f"a mesh whose dimensions scale a resource at {where}"
        raise SettingError(scene.field, must, name)
    corners = np.array(
        [scene.point(item, where) for item in scene.items(given.get("vertices"), where)]
    )
    faces = []
    for item in scene.items(given.get("triangles"), where):
        # robowflex writes the list alone
        face = item if isinstance(item, list) else scene.mapping(item, where).get("vertex_indices")
        faces.append(scene.numbers(face, where, 3))
    triangles = np.array(faces).reshape(-1, 3)
    whole = np.all(triangles == np.floor(triangles)) and np.all(triangles >= 0.0)
    if not whole or not len(triangles) or triangles.max() >= len(corners):
        must = f"triangles of three of the {len(corners)} vertices of '{name}', counted from 0"
        count = len(corners)
        wrong = [
            row
            for row in triangles
            if not 0.0 <= min(row) <= max(row) < count or any(row != np.floor(row))
        ]
        told = ", ".join(f"{value:g}" for value in wrong[0]) if wrong else "none"
        raise SettingError(scene.field, must, told)
    return corners, triangles.astype(np.int64)


def cone_hull(height: float, radius: float, pose: Pose, name: str) -> HullObstacle:
    """Return a pyramid around a cone that stands as in `shape_msgs/SolidPrimitive`.

    Its axis is z, its middle half way up.
    """
    turns = [sincos(2.0 * np.pi * k / AROUND) for k in range(AROUND)]
    wide = radius / sincos(np.pi / AROUND)[1]
    base = [[wide * cos, wide * sin, -0.5 * height] for sin, cos in turns]
    return _hull(np.array([*base, [0.0, 0.0, 0.5 * height]]), pose, name)


def _hull(points: FloatArray, pose: Pose, name: str) -> HullObstacle:
    x, y, z = (float(value) + 0.0 for value in pose.position)
    return HullObstacle(
        shape="hull",
        name=name,
        points=tuple((float(a), float(b), float(c)) for a, b, c in points),
        center=(x, y, z),
        rotation=pose.angles,
    )


def _parts(corners: FloatArray, triangles: IntArray) -> list[FloatArray]:
    """Return the corners of the parts of a mesh; corners at one place are one."""
    from scipy.sparse import coo_array, csgraph  # few scenes have meshes

    places, same = np.unique(corners, axis=0, return_inverse=True)
    linked = same.reshape(-1)[triangles]
    ends = np.repeat(linked[:, 0], 2), linked[:, 1:].ravel()
    graph = coo_array((np.ones(len(ends[0])), ends), shape=(len(places),) * 2)
    _, part = csgraph.connected_components(graph, directed=False)
    used = np.unique(linked)  # parts are numbered by their first corners
    return [places[used[part[used] == own]] for own in np.unique(part[used])]
