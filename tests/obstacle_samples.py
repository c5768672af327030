"""Obstacles by their numbers alone."""

from evoexp.scenarios.obstacles import (
    BoxObstacle,
    EllipseObstacle,
    HalfSpaceObstacle,
    RodObstacle,
    SphereObstacle,
)

Point = tuple[float, ...]  # (x, y) or (x, y, z) [m]


def sphere(center: Point, radius: float) -> SphereObstacle:
    return SphereObstacle(shape="sphere", center=center, radius=radius)


def box(center: Point, size: Point, rotation: Point = (0.0, 0.0, 0.0)) -> BoxObstacle:
    return BoxObstacle(shape="box", center=center, size=size, rotation=rotation)


def capsule(start: Point, end: Point, radius: float) -> RodObstacle:
    return RodObstacle(shape="capsule", start=start, end=end, radius=radius)


def cylinder(start: Point, end: Point, radius: float) -> RodObstacle:
    return RodObstacle(shape="cylinder", start=start, end=end, radius=radius)


def half_space(point: Point, normal: Point) -> HalfSpaceObstacle:
    return HalfSpaceObstacle(shape="half_space", point=point, normal=normal)


def ellipse(center: Point, semi_axes: Point, angle: float = 0.0) -> EllipseObstacle:
    return EllipseObstacle(shape="ellipse", center=center, semi_axes=semi_axes, angle=angle)
