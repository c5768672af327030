"""Links as strings of touching circles or spheres (Rana & Zalzala 1995, Fig. 3).

Any number of arms, in the plane or in space, among static obstacles. One kernel runs a block of configurations through
forward kinematics, sphere centres, all pairs of spheres of different arms and all obstacles; the configuration is
innermost. What limits it is the arithmetic of the pairs: per pair six operations in the plane and nine in space, on
values that stay in the first-level cache; square roots are taken once per pair of arms, of the least squared distance.
"""

from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.numerics import DEGREE, kernel
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly, sphere_geometry
from evoexp.robots.kinematics import BLOCK, block_frames, block_planar_frames
from evoexp.scenarios.obstacles import BOX, SPHERE, ObstacleTable, obstacle_table
from evoexp.validation import Component, Count, Positive


class TouchingSpheres(Component):
    """The collision model of Rana & Zalzala.

    Attributes:
        spheres_per_link: Centres at equal distances from joint to joint, both ends included.
        sphere_radius: Of every sphere [length unit]; two arms collide when centres are closer than the sum of radii.
        collision_substeps: Configurations tested per segment of a path; 1: the via-points only, as in the paper.
    """

    component: ClassVar[str] = "touching_spheres"

    spheres_per_link: Count
    sphere_radius: Positive
    collision_substeps: Count

    def bind(self, assembly: Assembly, obstacles: tuple[Any, ...]) -> "SphereCollision":
        """Return the model of a robot among obstacles, ready for batches."""
        spheres = [sphere for link in assembly.links for sphere in self._of_link(assembly, link)]
        kept = _without_repetitions(spheres)
        arms = np.array([sphere.arm for sphere in kept])
        ranges = np.array([[np.argmax(arms == a), np.sum(arms <= a)] for a in range(assembly.num_arms)], dtype=np.int64)
        return SphereCollision(
            assembly,
            np.array([sphere.joint - 1 for sphere in kept], dtype=np.int64),
            np.array([assembly.table.local(sphere.joint, sphere.center) for sphere in kept]),
            ranges,
            self.sphere_radius,
            obstacle_table(obstacles),
            sphere_geometry(
                assembly,
                np.array([sphere.center for sphere in kept]),
                np.array([sphere.joint for sphere in kept]),
                np.full(len(kept), self.sphere_radius),
            ),
        )

    def _of_link(self, assembly: Assembly, link: Any) -> list["_Sphere"]:
        fractions = np.linspace(0.0, 1.0, self.spheres_per_link) if self.spheres_per_link > 1 else np.array([0.5])
        centers = [link.start + f * (link.end - link.start) for f in fractions]
        return [_Sphere(link.arm, link.joint, center, assembly) for center in centers]


class _Sphere(NamedTuple):
    arm: int
    joint: int
    center: FloatArray
    assembly: Assembly

    def repeats(self, other: "_Sphere") -> bool:
        """Whether it is the end of the other's link, at the joint that both share: the same point for every q."""
        model = self.assembly.model
        if self.arm != other.arm or model.parents[self.joint] != other.joint or self.center.any():
            return False
        return bool(np.array_equal(model.jointPlacements[self.joint].translation, other.center))


def _without_repetitions(spheres: list[_Sphere]) -> list[_Sphere]:
    return [s for k, s in enumerate(spheres) if not any(s.repeats(other) for other in spheres[:k])]


class Clearance(NamedTuple):
    """Least clearances of a batch; negative where spheres overlap, +inf where there is nothing to meet.

    Attributes:
        between_arms: (configurations,) least centre distance of spheres of two arms, less both radii.
        to_obstacles: (configurations,) least distance of a centre to an obstacle's surface, less the radius.
    """

    between_arms: FloatArray
    to_obstacles: FloatArray

    @property
    def least(self) -> FloatArray:
        """Smaller of the two; a configuration collides where it is negative."""
        return np.minimum(self.between_arms, self.to_obstacles)


class SphereCollision(NamedTuple):
    """Touching spheres on one robot, and the obstacles around it.

    Attributes:
        assembly: The robot.
        sphere_joint: (spheres,) index into the kinematic table, arm by arm.
        sphere_local: (spheres, 3) centres in the table's frames.
        arm_spheres: (arms, 2) first and one-past-last sphere of each arm.
        radius: Of every sphere.
        obstacles: The obstacle table.
        geometry: The same spheres as a `pin.GeometryModel` of coal spheres.
    """

    assembly: Assembly
    sphere_joint: np.ndarray
    sphere_local: FloatArray
    arm_spheres: np.ndarray
    radius: float
    obstacles: ObstacleTable
    geometry: Any

    def clearance(self, q: FloatArray) -> Clearance:
        """Return the clearances of a batch of configurations.

        Args:
            q: (nq, configurations) [deg].

        Raises:
            ValueError: If q has another number of rows than the robot has joints.
        """
        table = self.assembly.table
        q = np.ascontiguousarray(q, dtype=np.float64)
        if q.ndim != 2 or q.shape[0] != len(table.parent):
            raise ValueError(f"q must have shape ({len(table.parent)}, configurations), was {q.shape}")
        out = np.empty((2, q.shape[1]))
        spheres = (self.sphere_joint, self.sphere_local, self.arm_spheres, self.radius)
        _clearances(table[:6], table.planar, spheres, tuple(self.obstacles), q, out)
        return Clearance(out[0], out[1])





@kernel
def _clearances(table, planar, spheres, obstacles, q, out):  # type: ignore[no-untyped-def]
    parent, index_q, prismatic, turned, rotation, translation = table
    sphere_joint, sphere_local, arm_spheres, radius = spheres
    num_joints, num_spheres, total = len(parent), len(sphere_joint), q.shape[1]
    block_q = np.zeros((q.shape[0], BLOCK))
    frames = np.empty((num_joints, 9, BLOCK))
    points = np.empty((num_joints, 3, BLOCK))
    sine, cosine = np.empty((num_joints, BLOCK)), np.empty((num_joints, BLOCK))
    scratch = np.empty((11, BLOCK))
    centers = np.empty((num_spheres, 3, BLOCK))
    between, outside = np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, total, BLOCK):
        count = min(BLOCK, total - first)
        for k in range(q.shape[0]):
            for lane in range(count):
                block_q[k, lane] = q[k, first + lane] * DEGREE
        if planar:
            block_planar_frames(parent, index_q, turned, rotation, translation, block_q, points, sine, cosine)
            _planar_centers(sphere_joint, sphere_local, sine, cosine, points, centers)
        else:
            block_frames(parent, index_q, prismatic, turned, rotation, translation, block_q, frames, points, scratch)
            _spatial_centers(sphere_joint, sphere_local, frames, points, centers)
        _between_arms(planar, arm_spheres, centers, scratch[0], between)
        _to_obstacles(obstacles, centers, scratch, outside)
        for lane in range(count):
            out[0, first + lane] = between[lane] - 2.0 * radius
            out[1, first + lane] = outside[lane] - radius


@kernel
def _planar_centers(joint, local, sine, cosine, points, centers):  # type: ignore[no-untyped-def]
    for k in range(len(joint)):
        j = joint[k]
        x, y, z = local[k]
        for lane in range(BLOCK):
            s, c = sine[j, lane], cosine[j, lane]
            centers[k, 0, lane] = points[j, 0, lane] + (c * x - s * y)
            centers[k, 1, lane] = points[j, 1, lane] + (s * x + c * y)
            centers[k, 2, lane] = points[j, 2, lane] + z


@kernel
def _spatial_centers(joint, local, frames, points, centers):  # type: ignore[no-untyped-def]
    for k in range(len(joint)):
        j = joint[k]
        x, y, z = local[k]
        for row in range(3):
            a, b, c = frames[j, 3 * row], frames[j, 3 * row + 1], frames[j, 3 * row + 2]
            for lane in range(BLOCK):
                centers[k, row, lane] = points[j, row, lane] + (a[lane] * x + b[lane] * y + c[lane] * z)


@kernel
def _between_arms(planar, arm_spheres, centers, least, out):  # type: ignore[no-untyped-def]
    """Least centre distance over all pairs of arms, (BLOCK,); +inf for a single arm."""
    out[:] = np.inf
    for a in range(len(arm_spheres)):
        for b in range(a + 1, len(arm_spheres)):
            least[:] = np.inf
            for i in range(arm_spheres[a, 0], arm_spheres[a, 1]):
                if planar:
                    _planar_pairs(centers, i, arm_spheres[b, 0], arm_spheres[b, 1], least)
                else:
                    _spatial_pairs(centers, i, arm_spheres[b, 0], arm_spheres[b, 1], least)
            for lane in range(BLOCK):
                distance = np.sqrt(least[lane])
                out[lane] = distance if distance < out[lane] else out[lane]


@kernel
def _planar_pairs(centers, i, first, stop, least):  # type: ignore[no-untyped-def]
    """Lower `least` to the squared distances of sphere i from a range of spheres; eight in registers at a time."""
    x, y = centers[i, 0], centers[i, 1]
    j = first
    while j + 8 <= stop:
        for lane in range(BLOCK):
            best = least[lane]
            for t in range(8):
                dx, dy = x[lane] - centers[j + t, 0, lane], y[lane] - centers[j + t, 1, lane]
                best = min(best, dx * dx + dy * dy)
            least[lane] = best
        j += 8
    while j < stop:
        for lane in range(BLOCK):
            dx, dy = x[lane] - centers[j, 0, lane], y[lane] - centers[j, 1, lane]
            least[lane] = min(least[lane], dx * dx + dy * dy)
        j += 1


@kernel
def _spatial_pairs(centers, i, first, stop, least):  # type: ignore[no-untyped-def]
    x, y, z = centers[i, 0], centers[i, 1], centers[i, 2]
    j = first
    while j + 4 <= stop:
        for lane in range(BLOCK):
            best = least[lane]
            for t in range(4):
                dx, dy = x[lane] - centers[j + t, 0, lane], y[lane] - centers[j + t, 1, lane]
                dz = z[lane] - centers[j + t, 2, lane]
                best = min(best, dx * dx + dy * dy + dz * dz)
            least[lane] = best
        j += 4
    while j < stop:
        for lane in range(BLOCK):
            dx, dy, dz = x[lane] - centers[j, 0, lane], y[lane] - centers[j, 1, lane], z[lane] - centers[j, 2, lane]
            least[lane] = min(least[lane], dx * dx + dy * dy + dz * dz)
        j += 1


@kernel
def _to_obstacles(obstacles, centers, scratch, out):  # type: ignore[no-untyped-def]
    """Least signed distance of any centre to any obstacle's surface, (BLOCK,); +inf without obstacles."""
    kind, center, rotation, size = obstacles
    out[:] = np.inf
    u, v, w = scratch[0], scratch[1], scratch[2]
    for o in range(len(kind)):
        cx, cy, cz = center[o]
        r = rotation[o]
        a, b, c = size[o]
        for k in range(len(centers)):
            for lane in range(BLOCK):
                x, y, z = centers[k, 0, lane] - cx, centers[k, 1, lane] - cy, centers[k, 2, lane] - cz
                u[lane] = r[0] * x + r[3] * y + r[6] * z
                v[lane] = r[1] * x + r[4] * y + r[7] * z
                w[lane] = r[2] * x + r[5] * y + r[8] * z
            if kind[o] == SPHERE:
                for lane in range(BLOCK):
                    out[lane] = min(out[lane], _length(u[lane], v[lane], w[lane]) - a)
            elif kind[o] == BOX:
                for lane in range(BLOCK):
                    x, y, z = abs(u[lane]) - a, abs(v[lane]) - b, abs(w[lane]) - c
                    inside = min(max(x, max(y, z)), 0.0)
                    out[lane] = min(out[lane], _length(max(x, 0.0), max(y, 0.0), max(z, 0.0)) + inside)
            else:
                for lane in range(BLOCK):
                    along = min(max(w[lane], -b), b)
                    out[lane] = min(out[lane], _length(u[lane], v[lane], w[lane] - along) - a)


@kernel
def _length(x, y, z):  # type: ignore[no-untyped-def]
    return np.sqrt(x * x + y * y + z * z)
