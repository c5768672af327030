"""Distances of shapes by coal, and shapes made of corners."""

from typing import Any

import coal
import numpy as np
import pinocchio as pin


def placed(shape: Any, place: Any = None) -> Any:
    """Return a shape at an SE3 or a point (3,), or at the origin, as coal's object."""
    if not isinstance(place, pin.SE3):
        place = pin.SE3(np.eye(3), np.zeros(3) if place is None else np.asarray(place, float))
    return coal.CollisionObject(shape, place.rotation, place.translation)


def distance(one: Any, two: Any) -> float:
    """Return the distance of two placed shapes."""
    return float(coal.distance(one, two, coal.DistanceRequest(), coal.DistanceResult()))


def distance_of_point(point: Any, other: Any) -> float:
    """Return the distance of a point (3,) from a placed shape."""
    return distance(placed(coal.Sphere(1e-9), point), other)


def geometry_of(*bodies: tuple[str, int, Any, Any], pairs: Any = ()) -> pin.GeometryModel:
    """Return bodies (name, joint, place or point or None, shape) and their pairs."""
    geometry = pin.GeometryModel()
    for name, joint, place, shape in bodies:
        if not isinstance(place, pin.SE3):
            place = pin.SE3(np.eye(3), np.zeros(3) if place is None else np.asarray(place, float))
        geometry.addGeometryObject(pin.GeometryObject(name, joint, 0, place, shape))
    for pair in pairs:
        geometry.addCollisionPair(pin.CollisionPair(*pair))
    return geometry


def mesh(triangles: Any) -> coal.BVHModelOBBRSS:
    """Return a mesh of triangles (m, 3, 3), which has no inside."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(triangles), 3 * len(triangles))
    for corners in triangles:
        model.addTriangle(*corners)
    model.endModel()
    return model
