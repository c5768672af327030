"""Spheres that somebody else put in the place of a robot's bodies: a URDF with spheres per link."""

import copy
from typing import Any

import numpy as np

from evoexp.errors import SettingError, nearest
from evoexp.records import FloatArray


def with_spheres(root: Any, other: Any, field: str) -> Any:
    """Put the spheres of one URDF in the place of the collision bodies of another, link by link.

    Args:
        root: The robot, that `read_urdf` returned.
        other: The spheres, likewise.
        field: That names them, for errors.

    Returns:
        The robot with spheres.

    Raises:
        SettingError: If the other has no spheres, other bodies, or links that the robot has not.
    """
    root = copy.deepcopy(root)
    links = {link.get("name"): link for link in root.iterfind("link")}
    for link in links.values():
        link[:] = []
    for link in other.iterfind("link"):
        for collision in link.findall("collision"):
            name = link.get("name")
            if name not in links:
                must = "a URDF whose spheres belong to links of the robot"
                raise SettingError(field, must, name, nearest(name, list(links)))
            if collision.find("geometry/sphere") is None:
                raise SettingError(field, "a URDF of spheres", f"another body of '{name}'")
            links[name].append(collision)
    if not any(len(link) for link in links.values()):
        raise SettingError(field, "a URDF of spheres", "one without")
    return root


def spheres_of_bodies(bodies: list[Any], spheres: list[Any]) -> list[FloatArray]:
    """Give the spheres of each link to the bodies of that link.

    A sphere belongs to the body whose middle is nearest to its own.

    Args:
        bodies: `pin.GeometryObject`s, named by link and number.
        spheres: The same, of spheres.

    Returns:
        (spheres, 4) of each body: middles in the body's own frame, and radii.
    """
    links = [item.name.rpartition("_")[0] for item in bodies]
    for item in bodies:
        item.geometry.computeLocalAABB()
    found: list[list[list[float]]] = [[] for _ in bodies]
    for sphere in spheres:
        point, link = sphere.placement.translation, sphere.name.rpartition("_")[0]
        own = [k for k, name in enumerate(links) if name == link]
        if not own:
            continue  # a link that has no bodies here
        away = [
            float(np.sum((bodies[k].placement.act(bodies[k].geometry.aabb_center) - point) ** 2))
            for k in own
        ]
        body = own[int(np.argmin(away))]
        x, y, z = bodies[body].placement.actInv(point)
        found[body].append([x, y, z, float(sphere.geometry.radius)])
    return [np.array(each).reshape(-1, 4) for each in found]
