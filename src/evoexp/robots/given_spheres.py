"""Spheres that somebody else put in the place of a robot's bodies: a URDF with spheres per link."""

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from evoexp.errors import SettingError, nearest
from evoexp.records import FloatArray
from evoexp.robots.urdf_text import check_urdf, parsed_xml

FIELD = "robot.spheres"


def with_spheres(urdf: bytes, spheres: bytes) -> bytes:
    """Return a URDF whose collision bodies are the spheres of another one, link by link.

    Args:
        urdf: The robot's.
        spheres: The other.

    Raises:
        SettingError: If the other has no spheres, other bodies, or links that the robot has not.
    """
    root = parsed_xml(urdf, "robot.urdf", "robot")
    other = parsed_xml(spheres, FIELD, "robot")
    check_urdf(other, FIELD)
    links = {str(link.get("name")): link for link in root.iterfind("link")}
    for link in links.values():
        for collision in link.findall("collision"):
            link.remove(collision)
    count = 0
    for link in other.iterfind("link"):
        for collision in link.findall("collision"):
            name = str(link.get("name"))
            if name not in links:
                must = "a URDF whose spheres belong to links of the robot"
                raise SettingError(FIELD, must, name, nearest(name, list(links)))
            if collision.find("geometry/sphere") is None:
                raise SettingError(FIELD, "a URDF of spheres", f"another body of '{name}'")
            collision.attrib.pop("name", None)
            links[name].append(collision)
            count += 1
    if count == 0:
        raise SettingError(FIELD, "a URDF of spheres", "one without")
    return ET.tostring(root)


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
