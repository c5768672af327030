"""Meshes and cones of a planning scene, as convex hulls that contain them."""

from collections.abc import Mapping

import numpy as np

from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.elementary import sincos
from evoexp.records import FloatArray, IntArray
from evoexp.scenarios.moveit_files import MessagePart, Pose
from evoexp.scenarios.obstacles import HullObstacle

Mesh = tuple[FloatArray, IntArray]
"""Corners (corners, 3) [m] and triangles (triangles, 3) of corners' numbers."""

AROUND = 32  # corners of a cone's base; they stand out of it by half a hundredth of its radius


def resources(scene: MessagePart) -> list[str]:
    """List the files that the meshes of a scene name, as robowflex writes them."""
    things = scene["world"]["collision_objects"]
    names = (mesh["resource"].text for thing in things for mesh in thing["meshes"])
    return list(dict.fromkeys(filter(None, names)))


def mesh_hulls(
    mesh: MessagePart, loaded: Mapping[str, Mesh], pose: Pose, name: str
) -> list[HullObstacle]:
    """Return the convex hulls of the parts of a mesh (`shape_msgs/Mesh`) that hang together.

    Args:
        mesh: The message.
        loaded: Of the files that meshes of the scene name.
        pose: Where it stands.
        name: Of the object; the hulls are numbered if they are several.

    Raises:
        SettingError: If it is no mesh, or a part of it has no inside.
    """
    if resource := mesh["resource"].text:
        has_own = mesh["vertices"].value or mesh["triangles"].value
        mesh.require(not has_own, f"a resource or triangles at {mesh.where}, not both", name)
        corners, triangles = loaded[resource]
        if mesh["dimensions"]:
            corners = corners * mesh["dimensions"].numbers(3)
    else:
        corners, triangles = _own_triangles(mesh, name)
    found = []
    parts = _parts(corners, triangles)
    for k, part in enumerate(parts):
        hull = hull_of(part)
        if hull is None:
            must = f"meshes with an inside ('{name}')"
            raise mesh.refusal(must, f"a part of {len(part)} vertices in one plane")
        found.append(_hull(hull[0], pose, f"{name}_{k + 1}" if len(parts) > 1 else name))
    return found


def _own_triangles(mesh: MessagePart, name: str) -> Mesh:
    """Read the corners and triangles that a message holds."""
    must = f"a mesh whose dimensions scale a resource at {mesh.where}"
    mesh.require(not mesh["dimensions"].value, must, name)
    corners = np.array([vertex.point for vertex in mesh["vertices"]])
    faces = [
        # robowflex writes the list alone
        (face if isinstance(face.value, list) else face["vertex_indices"]).numbers(3)
        for face in mesh["triangles"]
    ]
    triangles, count = np.array(faces).reshape(-1, 3), len(corners)
    is_corner = (triangles == np.floor(triangles)) & (triangles >= 0.0) & (triangles < count)
    wrong = triangles[~is_corner.all(axis=1)]
    must = f"triangles of three of the {count} vertices of '{name}', counted from 0"
    was = ", ".join(f"{k:g}" for k in wrong[0]) if len(wrong) else "none"
    mesh.require(len(triangles) and not len(wrong), must, was)
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
