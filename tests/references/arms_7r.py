"""A 7R arm of a Panda's proportions as 59 spheres, among ten obstacle spheres."""

import itertools
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_collision import Shapes
from evoexp.records import FloatArray
from obstacle_samples import sphere
from references.arms_6r import add

SELF_PAIRS = tuple(
    pair
    for pair in itertools.combinations(range(8), 2)
    if pair[1] - pair[0] >= 3 and pair not in ((0, 3), (4, 7))
)  # joints, 0 the pedestal; neighbours and the links of the wrist touch

# joint, start, end, radius [m], spheres along it: 59 spheres
RODS = (
    (0, (0.0, 0.0, 0.05), (-0.1, 0.0, 0.05), 0.08, 3),
    (1, (0.0, -0.08, 0.0), (0.0, 0.03, 0.0), 0.065, 4),
    (1, (0.0, 0.0, -0.03), (0.0, 0.0, -0.19), 0.065, 5),
    (2, (0.0, 0.0, -0.03), (0.0, 0.0, 0.12), 0.06, 5),
    (2, (0.0, -0.06, 0.0), (0.0, -0.17, 0.0), 0.065, 5),
    (3, (0.0, 0.0, -0.06), (0.0, 0.0, -0.15), 0.06, 4),
    (3, (0.08, 0.0, 0.0), (0.08, 0.06, 0.0), 0.055, 3),
    (4, (0.0, 0.0, 0.02), (-0.08, 0.09, 0.0), 0.055, 5),
    (4, (-0.08, 0.1, 0.0), (-0.08, 0.12, 0.0), 0.055, 2),
    (5, (0.0, 0.05, 0.0), (0.0, 0.08, -0.23), 0.05, 9),
    (6, (0.0, 0.0, -0.01), (0.08, 0.03, 0.0), 0.05, 5),
    (7, (0.0, 0.0, 0.07), (0.0, 0.0, 0.1), 0.05, 3),
    (7, (0.0, -0.09, 0.16), (0.0, 0.09, 0.16), 0.028, 6),
)

OBSTACLES = tuple(
    sphere(center, 0.12)
    for center in (
        *((0.55, 0.0, 0.25), (0.35, 0.35, 0.25), (0.0, 0.55, 0.25), (-0.55, 0.0, 0.25)),
        *((-0.35, -0.35, 0.25), (0.0, -0.55, 0.25), (0.35, -0.35, 0.8), (0.35, 0.35, 0.9)),
        *((-0.35, 0.35, 0.8), (-0.2, -0.4, 0.95)),
    )
)


def model() -> Any:
    """Return the arm's `pin.Model`."""
    arm, quarter = pin.Model(), 0.5 * np.pi
    for joint, (roll, place) in enumerate(
        (
            (0.0, (0.0, 0.0, 0.333)),
            (-quarter, (0.0, 0.0, 0.0)),
            (quarter, (0.0, -0.316, 0.0)),
            (quarter, (0.0825, 0.0, 0.0)),
            (-quarter, (-0.0825, 0.384, 0.0)),
            (quarter, (0.0, 0.0, 0.0)),
            (quarter, (0.088, 0.0, 0.0)),
        )
    ):
        placement = pin.SE3(pin.utils.rotate("x", roll), np.array(place))
        arm.addJoint(joint, pin.JointModelRZ(), placement, f"joint_{joint + 1}")
    return arm


def shapes() -> Shapes:
    """Return the links as spheres."""
    rows = [
        (owner, (1.0 - f) * np.array(start) + f * np.array(end), size)
        for owner, start, end, size, count in RODS
        for f in np.linspace(0.0, 1.0, count)
    ]
    joints, centers, radii = (np.array(column) for column in zip(*rows, strict=True))
    return Shapes(joints, centers, centers, radii, joints)


def geometry(arm: Any) -> Any:
    """Return the same spheres as a `pin.GeometryModel`, with all pairs to be tested."""
    own, scene = shapes(), pin.GeometryModel()
    every = [*zip(own.joint, own.start, own.radius, strict=True)]
    every += [(-1, np.array(one.center), one.radius) for one in OBSTACLES]
    for joint, center, radius in every:
        add(scene, max(int(joint), 0), pin.SE3(np.eye(3), np.array(center)), coal.Sphere(radius))
    for a, (one, *_) in enumerate(every):
        for b, (two, *_) in enumerate(every[:a]):
            if (int(two), int(one)) in SELF_PAIRS or (one == -1 and two > 0):
                scene.addCollisionPair(pin.CollisionPair(b, a))
    return scene


def random_configurations(count: int) -> FloatArray:
    """Return configurations drawn uniformly within a Panda's limits, (7, count) [rad]."""
    limits = np.array([2.9, 1.76, 2.9, 1.5, 2.9, 1.9, 2.9])[:, None]
    middle = np.array([0.0, 0.0, 0.0, -1.57, 0.0, 1.87, 0.0])[:, None]
    return np.asarray(middle + limits * np.random.default_rng(0).uniform(-1.0, 1.0, (7, count)))


def population(count: int) -> FloatArray:
    """Return configurations of a converged population, (7, count) [rad], around a free one."""
    center = np.array([0.4, -0.6, 0.1, -2.0, 0.1, 1.6, 0.7])[:, None]
    return np.asarray(center + 0.1 * np.random.default_rng(0).normal(size=(7, count)))
