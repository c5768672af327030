"""A scene: a robot's exact bodies and the obstacles as coal shapes, with the pairs to be watched.

`Scene` holds coal's shapes, which decide, and the same bodies as plain arrays, from
which the kernels of the certifier bound their distances. It is read-only: one scene serves many
motions and threads.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.body_table import BodyTable, body_table
from evoexp.collision.box_support import coal
from evoexp.collision.derived_pairs import are_neighbours, unjudged_pairs
from evoexp.collision.distance_maps import DistanceMap
from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import KinematicTable, kinematic_table
from evoexp.robots.meshes import convex_shape
from evoexp.scenarios import obstacles as solids


class AllowedContact(NamedTuple):
    """Two bodies that may touch."""

    one: int  # index of a body
    two: int  # index of the other
    depth: float  # how deep they may overlap [length unit]


class Scene(NamedTuple):
    """Bodies on a Pinocchio model, and the pairs of them that are watched."""

    model: Any  # the `pin.Model`
    # the `pin.GeometryModel` with one object per body and one collision pair per pair
    geometry: Any
    table: KinematicTable  # the kinematic table of the model
    names: tuple[str, ...]  # (bodies) of the geometry objects
    # (bodies) coal's shape, index of its Pinocchio joint, placement in it
    shapes: tuple[tuple[Any, int, Any], ...]
    pairs: np.ndarray  # (pairs, 2) indices of bodies
    bodies: BodyTable  # the bodies as arrays
    # greatest distance of a body's points from the world's origin at the neutral configuration
    # [length unit]
    size: float
    # (pairs,) at or below which a distance counts as contact [length unit]: above coal's own error
    tolerances: FloatArray
    # pairs that are none of `pairs`, since they may touch
    contacts: tuple[AllowedContact, ...] = ()
    maps: tuple[DistanceMap, ...] = ()  # of some pairs of its bodies

    def pair_names(self, pair: int) -> tuple[str, str]:
        """Return the names of a pair's bodies."""
        one, two = self.pairs[pair]
        return self.names[one], self.names[two]

    def of_pairs(self, kept: np.ndarray) -> "Scene":
        """Return the scene with the kept pairs only, (pairs,)."""
        return self._replace(pairs=self.pairs[kept], tolerances=self.tolerances[kept])

    def distances(self, q: FloatArray) -> FloatArray:
        """Return coal's distances of all pairs of the geometry at q (nq,), negative: overlaps."""
        data, placements = self.model.createData(), self.geometry.createData()
        pin.computeDistances(self.model, data, self.geometry, placements, q)
        return np.array([result.min_distance for result in placements.distanceResults])


class Part(NamedTuple):
    """A piece of a motion with its own bodies, such as a phase in which something is held."""

    scene: Scene  # the bodies
    first: int  # instant at which it begins
    last: int  # at which it ends
    # (pairs,) clearance that the task requires of each pair [length unit]; None: the planner's
    # security margin of all
    margins: FloatArray | None = None


def scene(
    assembly: Assembly,
    obstacles: solids.ObstacleTable | tuple[Any, ...] = (),
    self_pairs: bool = False,
) -> Scene:
    """Return a robot among obstacles: links of different arms, and every link with every obstacle.

    Args:
        assembly: The robot; links without names of their own are named `arm_1_link_1` and so on.
        obstacles: Settings of obstacles, or their table; named `obstacle_1` and so on.
        self_pairs: Whether links of one arm are watched, too, unless one joint carries both or they
            meet at a joint, or the robot's own data says that they need not be.
    """
    if isinstance(obstacles, solids.ObstacleTable):
        table, hulls = obstacles, {}
    else:
        table, hulls = solids.obstacle_table(obstacles), solids.obstacle_hulls(obstacles)
    geometry, counts = pin.GeometryModel(), [0] * assembly.num_arms
    bodies = list(assembly.geometry.geometryObjects)
    arms = assembly.body_arms
    for k, (arm, item) in enumerate(zip(arms, bodies, strict=True)):
        # bodies that have names of their own keep them, and are not counted
        own = item.name != f"link_{k}"
        counts[arm] += not own
        name = item.name if own else f"arm_{arm + 1}_link_{counts[arm]}"
        geometry.addGeometryObject(
            pin.GeometryObject(name, item.parentJoint, 0, item.placement, item.geometry)
        )
    for k, (shape, placement) in enumerate(obstacle_shapes(table, hulls)):
        geometry.addGeometryObject(pin.GeometryObject(f"obstacle_{k + 1}", 0, 0, placement, shape))
    unjudged = unjudged_pairs(assembly)
    for a in range(len(bodies)):
        for b in range(a + 1, len(bodies)):
            if frozenset((bodies[a].name, bodies[b].name)) in unjudged:
                continue
            if arms[a] != arms[b] or (self_pairs and not are_neighbours(assembly, a, b)):
                geometry.addCollisionPair(pin.CollisionPair(a, b))
        for k in range(len(table.kind)):
            geometry.addCollisionPair(pin.CollisionPair(a, len(bodies) + k))
    return geometry_scene(assembly.model, geometry, assembly.table)


def obstacle_pairs(assembly: Assembly, found: Scene) -> np.ndarray:
    """Return which pairs of a robot's `scene` are a link and an obstacle, (pairs,)."""
    return np.asarray(np.any(found.pairs >= len(assembly.geometry.geometryObjects), axis=1))


def geometry_scene(model: Any, geometry: Any, table: KinematicTable | None = None) -> Scene:
    """Return the scene of a geometry model: any convex coal shapes or meshes, and its pairs.

    Args:
        model: A `pin.Model` whose joints have one coordinate each.
        geometry: A `pin.GeometryModel`; its objects' names are the bodies' names.
        table: The kinematic table of the model, if there is one.

    Raises:
        UnsupportedShape: If the certifier cannot bound a body.
        UnsupportedJoint: If the model has a joint of several coordinates.
    """
    table = kinematic_table(model) if table is None else table
    items = list(geometry.geometryObjects)
    bodies = body_table(table, items)
    pairs = np.array(
        [(pair.first, pair.second) for pair in geometry.collisionPairs], dtype=np.int64
    ).reshape(-1, 2)
    size = _size(model, bodies)
    tolerances = np.array([bodies.tolerance(one, two) for one, two in pairs]) * size
    names = tuple(item.name for item in items)
    shapes = tuple((item.geometry, int(item.parentJoint), item.placement) for item in items)
    return Scene(
        model, geometry, table, names, shapes, pairs, bodies, size, tolerances.reshape(len(pairs))
    )


def obstacle_shapes(
    table: solids.ObstacleTable, hulls: Mapping[int, FloatArray] | None = None
) -> list[tuple[Any, Any]]:
    """Return every obstacle as a coal shape and its placement, a `pin.SE3`.

    Hulls are in the place of boxes: row → points (points, 3) in its frame.
    """
    shapes: list[tuple[Any, Any]] = []
    for k, (kind, center, rotation, (a, b, c)) in enumerate(zip(*table, strict=True)):
        if hulls and k in hulls:
            found = hull_of(hulls[k])
            if found is None:
                must = "points that lie in no plane"
                raise SettingError(f"scenario.obstacles[{k}].points", must, hulls[k].tolist()[:4])
            shape = convex_shape(*found)
        elif kind == solids.SPHERE:
            shape = coal.Sphere(a)
        elif kind == solids.BOX:
            shape = coal.Box(2.0 * a, 2.0 * b, 2.0 * c)
        elif kind == solids.CAPSULE:
            shape = coal.Capsule(a, 2.0 * b)
        elif kind == solids.CYLINDER:
            shape = coal.Cylinder(a, 2.0 * b)
        elif kind == solids.ELLIPSE:
            shape = coal.Ellipsoid(a, b, c)
        else:
            shape = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        shapes.append((shape, pin.SE3(rotation.reshape(3, 3), center)))
    return shapes


def _size(model: Any, bodies: BodyTable) -> float:
    """Return the bodies' greatest reach from the world's origin at the neutral configuration."""
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    far = [0.0]
    for joint, reach in zip(bodies.joint, bodies.from_origin, strict=True):
        x, y, z = data.oMi[int(joint) + 1].translation
        if np.isfinite(reach):
            far.append(float(np.sqrt(x * x + y * y + z * z) + reach))
    return max(far) or 1.0
