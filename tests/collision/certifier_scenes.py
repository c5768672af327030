"""Random scenes for the certifier: arms of all joints, bodies of every shape; brute force."""

from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from coal_shapes import mesh
from evoexp.collision.scene import Scene, geometry_scene
from evoexp.numeric.convex_hull import hull_of
from evoexp.paths.motion import Motion, cubic_motion
from evoexp.robots.meshes import convex_shape

SAMPLES = 10_000  # per segment

# two tetrahedra with a common base: corners and faces of a convex hull
HULL_CORNERS = np.array(
    [[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0], [0.0, 0.1, 0.9], [0.1, 0.0, -0.7]]
)
HULL_FACES = [(0, 1, 3), (1, 2, 3), (2, 0, 3), (1, 0, 4), (2, 1, 4), (0, 2, 4)]


def hull(scale: float) -> Any:
    return convex_shape(HULL_CORNERS * scale, HULL_FACES)


def random_rotation(rng: np.random.Generator, planar: bool) -> np.ndarray:
    if planar:
        return pin.exp3(np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)]))
    return pin.Quaternion(rng.normal(size=4)).normalized().toRotationMatrix()


def random_shape(rng: np.random.Generator) -> Any:
    """A sphere, capsule, box, cylinder, cone, ellipsoid or hull of about size 1."""
    a, b, c = rng.uniform(0.05, 0.6, size=3)
    return [
        lambda: coal.Sphere(a),
        lambda: coal.Capsule(rng.choice([0.0, a]), 3.0 * b),
        lambda: coal.Box(2.0 * a, 2.0 * b, 2.0 * c),
        lambda: coal.Cylinder(a, 3.0 * b),
        lambda: coal.Cone(a, 2.0 * b),
        lambda: coal.Ellipsoid(a, 2.0 * b, c),
        lambda: hull(a),
        lambda: convex_shape(*(hull_of(0.4 * a * rng.normal(size=(100, 3))) or ())),
    ][rng.integers(8)]()


def random_scene(rng: np.random.Generator) -> Scene:
    """One or two arms, a body on every joint; one to three obstacles."""
    model, geometry = pin.Model(), pin.GeometryModel()
    planar, owners = bool(rng.random() < 0.3), []
    for arm in range(rng.integers(1, 3)):
        parent, place = 0, rng.uniform(-1.5, 1.5, size=3)
        for k in range(rng.integers(1, 4)):
            joint = pin.JointModelRZ()
            if not planar:
                axis = rng.normal(size=3)
                axis /= np.sqrt((axis**2).sum())
                kind = "Prismatic" if rng.random() < 0.3 else "Revolute"
                joint = getattr(pin, f"JointModel{kind}Unaligned")(axis)
            frame = pin.SE3(random_rotation(rng, planar), place)
            parent = model.addJoint(parent, joint, frame, f"{arm}_{k}")
            place = rng.uniform(-1.0, 1.0, size=3)
            if planar:
                place[2] = 0.0
            placement = pin.SE3(random_rotation(rng, planar), 0.5 * place)
            geometry.addGeometryObject(
                pin.GeometryObject(f"{arm}_{k}", parent, 0, placement, random_shape(rng))
            )
            owners.append(arm)
    if model.njoints > 2 and rng.random() < 0.3:  # a joint follows another
        model = pin.transformJointIntoMimic(model, 1, 2, *rng.uniform(-1.5, 1.5, size=2))
    for k in range(rng.integers(1, 4)):
        shape, place = random_shape(rng), rng.uniform(-2.0, 2.0, size=3)
        if rng.random() < 0.15:
            normal = rng.normal(size=3)
            shape = coal.Halfspace(normal / np.sqrt((normal**2).sum()), -2.5)
        elif rng.random() < 0.1:
            shape = mesh(HULL_CORNERS[np.array(HULL_FACES[:2])])  # an open fan, not convex
        placement = pin.SE3(random_rotation(rng, planar), place)
        geometry.addGeometryObject(pin.GeometryObject(f"obstacle_{k}", 0, 0, placement, shape))
        owners.append(-1)
    for a, one in enumerate(owners):
        for b, two in enumerate(owners[a + 1 :], start=a + 1):
            if one != two:
                geometry.addCollisionPair(pin.CollisionPair(a, b))
    return geometry_scene(model, geometry)


def random_motion(rng: np.random.Generator, nq: int) -> Motion:
    """One or two segments, straight or cubic."""
    segments = 1 if rng.random() < 0.8 else 2
    first = rng.uniform(-1.5, 1.5, size=nq)
    q = first + np.cumsum(rng.normal(size=(segments + 1, nq)) * 0.5, axis=0)
    if rng.random() < 0.5:
        return Motion(q)
    speed = rng.normal(size=(segments + 1, nq)) * 0.7
    step, m0, m1 = q[1:] - q[:-1], speed[:-1], speed[1:]
    powers = [q[:-1], m0, 3.0 * step - 2.0 * m0 - m1, m0 + m1 - 2.0 * step]
    return cubic_motion(np.stack(powers, axis=1))


class Brute(NamedTuple):
    t: np.ndarray
    least: np.ndarray
    pair: np.ndarray


def brute_force(scene: Scene, motion: Motion, samples: int = SAMPLES) -> Brute:
    """Least distance over all pairs, by coal, and its pair, at many instants."""
    data, geometry_data = scene.model.createData(), scene.geometry.createData()
    for request in geometry_data.distanceRequests:
        request.gjk_tolerance, request.gjk_max_iterations = 1e-9, 1000
    t = np.linspace(0.0, motion.num_segments, motion.num_segments * samples + 1)
    least, pair = np.empty(len(t)), np.empty(len(t), dtype=np.int64)
    for k, instant in enumerate(t):
        pair[k] = pin.computeDistances(
            scene.model, data, scene.geometry, geometry_data, motion.at(instant)
        )
        least[k] = geometry_data.distanceResults[int(pair[k])].min_distance
    return Brute(t, least, pair)
