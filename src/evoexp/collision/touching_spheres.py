"""Links as strings of touching circles or spheres (Rana & Zalzala 1995, Fig. 3).

Any number of arms, in the plane or in space, among static obstacles. One kernel runs a block of configurations through
forward kinematics, sphere centres, all pairs of spheres of different arms and all obstacles; the configuration is
innermost. What limits it is the arithmetic of the pairs: per pair six operations in the plane and nine in space, on
values that stay in the first-level cache; square roots are taken once per pair of arms, of the least squared distance.
Who only asks for collisions (`limit` 0) is spared the pairs of links that are far apart in a whole block.
"""

from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.numerics import DEGREE, kernel
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly, sphere_geometry
from evoexp.robots.kinematics import BLOCK, PLANAR_ROWS, SPATIAL_ROWS, U, block_frames, block_planar_frames, load_block
from evoexp.scenarios.obstacles import BOX, SPHERE, ObstacleTable, obstacle_table
from evoexp.validation import Component, Count, Positive

ROWS = 3 * BLOCK  # x, y, z of a point in a block
MARGIN = 1.0 + 1e-9  # bounds are widened by it, so that rounding cannot skip what touches


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
        joint = np.array([sphere.joint - 1 for sphere in kept], dtype=np.int64)
        local = np.array([assembly.table.local(sphere.joint, sphere.center) for sphere in kept])
        arms = np.array([sphere.arm for sphere in kept])
        links = np.cumsum(np.diff(joint, prepend=joint[0]) != 0)
        link_arms = np.array([arms[np.argmax(links == k)] for k in range(links[-1] + 1)])
        return SphereCollision(
            assembly,
            joint,
            local,
            _ranges(arms, assembly.num_arms),
            _bounds(joint, local, _ranges(links, links[-1] + 1), _ranges(link_arms, assembly.num_arms)),
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


class _Bounds(NamedTuple):
    """A ball around the centres of every link's spheres.

    Attributes:
        joint: (links,) index into the kinematic table.
        local: (links, 3) in the table's frames.
        radius: (links,) greatest distance of a centre.
        spheres: (links, 2) first and one-past-last sphere of each link.
        arm_links: (arms, 2) first and one-past-last link of each arm.
    """

    joint: np.ndarray
    local: FloatArray
    radius: FloatArray
    spheres: np.ndarray
    arm_links: np.ndarray


def _bounds(joint: np.ndarray, local: FloatArray, spheres: np.ndarray, arm_links: np.ndarray) -> _Bounds:
    middle = np.array([0.5 * (local[a:b].min(axis=0) + local[a:b].max(axis=0)) for a, b in spheres])
    squares = [((local[a:b] - center) ** 2).sum(axis=1).max() for (a, b), center in zip(spheres, middle, strict=True)]
    return _Bounds(joint[spheres[:, 0]], middle, np.sqrt(squares), spheres, arm_links)


def _ranges(owners: np.ndarray, count: int) -> np.ndarray:
    """Return (count, 2): where each owner's run begins and ends in a sorted list of owners."""
    return np.array([[np.searchsorted(owners, k), np.searchsorted(owners, k, side="right")] for k in range(count)])


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
        bounds: Balls around the spheres of each link.
        radius: Of every sphere.
        obstacles: The obstacle table.
        geometry: The same spheres as a `pin.GeometryModel` of coal spheres.
    """

    assembly: Assembly
    sphere_joint: np.ndarray
    sphere_local: FloatArray
    arm_spheres: np.ndarray
    bounds: _Bounds
    radius: float
    obstacles: ObstacleTable
    geometry: Any

    def clearance(self, q: FloatArray, limit: float = np.inf) -> Clearance:
        """Return the clearances of a batch of configurations.

        Args:
            q: (nq, configurations) [deg].
            limit: Above it nothing is asked: a clearance is exact where it is less, elsewhere some value not below it.
                With 0 the signs are right, and what is far apart is skipped.

        Raises:
            ValueError: If q has another number of rows than the robot has joints.
        """
        table = self.assembly.table
        q = np.ascontiguousarray(q, dtype=np.float64)
        if q.ndim != 2 or q.shape[0] != len(table.parent):
            raise ValueError(f"q must have shape ({len(table.parent)}, configurations), was {q.shape}")
        out = np.empty((2, q.shape[1]))
        clearances(self.tables, limit, q, out)
        return Clearance(out[0], out[1])

    @property
    def tables(self) -> tuple[Any, ...]:
        """What the kernel `clearances` reads, as plain tuples of arrays."""
        table = self.assembly.table
        spheres = (self.sphere_joint, self.sphere_local, self.radius)
        return table[:6], table.planar, spheres, tuple(self.bounds), tuple(self.obstacles)


@kernel
def clearances(tables, limit, q, out):  # type: ignore[no-untyped-def]
    """The kernel of `SphereCollision.clearance`, for other kernels; writes (2, configurations), q in degrees."""
    table, planar, spheres, bounds, obstacles = tables
    parent, index_q, prismatic, turned, rotation, translation = table
    joint, local, radius = spheres
    bound_joint, bound_local = bounds[0], bounds[1]
    block_q = np.zeros(q.shape[0] * BLOCK)
    frames = np.empty(len(parent) * SPATIAL_ROWS * BLOCK)
    centers, middles = np.empty(len(joint) * ROWS), np.empty(len(bound_joint) * ROWS)
    scratch, between, outside = np.empty(SPATIAL_ROWS * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    if planar:
        _heights(parent, translation, joint, local, centers)
        _heights(parent, translation, bound_joint, bound_local, middles)
    for first in range(0, q.shape[1], BLOCK):
        count = min(BLOCK, q.shape[1] - first)
        load_block(q, first, count, DEGREE, block_q)
        if planar:
            block_planar_frames(parent, index_q, rotation, translation, block_q, frames)
            _planar_centers(joint, local, frames, centers)
            _planar_centers(bound_joint, bound_local, frames, middles)
        else:
            block_frames(parent, index_q, prismatic, turned, rotation, translation, block_q, frames, scratch)
            _spatial_centers(joint, local, frames, centers)
            _spatial_centers(bound_joint, bound_local, frames, middles)
        _between_arms(planar, bounds, max(limit + 2.0 * radius, 0.0), centers, middles, scratch, between)
        outside[:] = limit + radius
        if len(obstacles[0]) > 0:
            _to_obstacles(obstacles, bounds, limit + radius, centers, middles, scratch, outside)
        for lane in range(count):
            out[0, first + lane] = between[lane] - 2.0 * radius
            out[1, first + lane] = outside[lane] - radius


@kernel
def _heights(parent, translation, joint, local, centers):  # type: ignore[no-untyped-def]
    """In the plane no joint changes a height: z of all centres, once."""
    for k in range(len(joint)):
        height, j = local[k, 2], joint[k]
        while j >= 0:
            height += translation[j, 2]
            j = parent[j]
        centers[k * ROWS + 2 * BLOCK : (k + 1) * ROWS] = height


@kernel
def _planar_centers(joint, local, frames, centers):  # type: ignore[no-untyped-def]
    for k in range(len(joint)):
        own, j = U(k) * U(ROWS), U(joint[k]) * U(PLANAR_ROWS * BLOCK)
        x, y = local[k, 0], local[k, 1]
        for n in range(BLOCK):
            lane = U(n)
            s, c = frames[j + lane], frames[j + U(BLOCK) + lane]
            centers[own + lane] = frames[j + U(2 * BLOCK) + lane] + (c * x - s * y)
            centers[own + U(BLOCK) + lane] = frames[j + U(3 * BLOCK) + lane] + (s * x + c * y)


@kernel
def _spatial_centers(joint, local, frames, centers):  # type: ignore[no-untyped-def]
    for k in range(len(joint)):
        own, j = U(k) * U(ROWS), U(joint[k]) * U(SPATIAL_ROWS * BLOCK)
        x, y, z = local[k, 0], local[k, 1], local[k, 2]
        for n in range(BLOCK):
            lane = U(n)
            for row in range(3):
                a, o = j + U(3 * row * BLOCK) + lane, j + U((9 + row) * BLOCK) + lane
                centers[own + U(row * BLOCK) + lane] = frames[o] + (
                    frames[a] * x + frames[a + U(BLOCK)] * y + frames[a + U(2 * BLOCK)] * z
                )


@kernel
def _between_arms(planar, bounds, limit, centers, middles, least, out):  # type: ignore[no-untyped-def]
    """Least centre distance over all pairs of arms, (BLOCK,), as far as it is below the limit."""
    _, _, reach, spheres, arm_links = bounds
    out[:] = limit
    for a in range(len(arm_links)):
        for b in range(a + 1, len(arm_links)):
            least[:BLOCK] = limit * limit
            for one in range(arm_links[a, 0], arm_links[a, 1]):
                for two in range(arm_links[b, 0], arm_links[b, 1]):
                    within = (limit + reach[one] + reach[two]) * MARGIN
                    if not _meet(middles, U(one) * U(ROWS), middles, U(two) * U(ROWS), within):
                        continue
                    first, stop = U(spheres[two, 0]), U(spheres[two, 1])
                    for i in range(spheres[one, 0], spheres[one, 1]):
                        if planar:
                            _planar_pairs(centers, U(i) * U(ROWS), first, stop, least)
                        else:
                            _spatial_pairs(centers, U(i) * U(ROWS), first, stop, least)
            for n in range(BLOCK):
                distance, best = np.sqrt(least[U(n)]), out[U(n)]
                out[U(n)] = distance if distance < best else best


@kernel
def _meet(one, i, two, j, within):  # type: ignore[no-untyped-def]
    """Whether the points at offsets i and j are closer than `within` in any lane."""
    squared = within * within
    count = 0
    for n in range(BLOCK):
        a, b = i + U(n), j + U(n)
        dx, dy = one[a] - two[b], one[a + U(BLOCK)] - two[b + U(BLOCK)]
        dz = one[a + U(2 * BLOCK)] - two[b + U(2 * BLOCK)]
        count += dx * dx + dy * dy + dz * dz < squared
    return count > 0


@kernel
def _planar_pairs(centers, i, first, stop, least):  # type: ignore[no-untyped-def]
    """Lower `least` to the squared distances of one sphere from a range of spheres; four in registers at a time."""
    j = first
    while j + U(4) <= stop:
        for n in range(BLOCK):
            lane = U(n)
            x, y, best = centers[i + lane], centers[i + U(BLOCK) + lane], least[lane]
            for t in range(4):
                k = j * U(ROWS) + U(t * ROWS) + lane
                dx, dy = x - centers[k], y - centers[k + U(BLOCK)]
                squared = dx * dx + dy * dy
                best = squared if squared < best else best
            least[lane] = best
        j += U(4)
    while j < stop:
        for n in range(BLOCK):
            lane, k = U(n), j * U(ROWS) + U(n)
            dx, dy = centers[i + lane] - centers[k], centers[i + U(BLOCK) + lane] - centers[k + U(BLOCK)]
            squared, best = dx * dx + dy * dy, least[lane]
            least[lane] = squared if squared < best else best
        j += U(1)


@kernel
def _spatial_pairs(centers, i, first, stop, least):  # type: ignore[no-untyped-def]
    j = first
    while j + U(4) <= stop:
        for n in range(BLOCK):
            lane, best = U(n), least[U(n)]
            x, y, z = centers[i + lane], centers[i + U(BLOCK) + lane], centers[i + U(2 * BLOCK) + lane]
            for t in range(4):
                k = j * U(ROWS) + U(t * ROWS) + lane
                dx, dy, dz = x - centers[k], y - centers[k + U(BLOCK)], z - centers[k + U(2 * BLOCK)]
                squared = dx * dx + dy * dy + dz * dz
                best = squared if squared < best else best
            least[lane] = best
        j += U(4)
    while j < stop:
        for n in range(BLOCK):
            lane, k = U(n), j * U(ROWS) + U(n)
            dx, dy = centers[i + lane] - centers[k], centers[i + U(BLOCK) + lane] - centers[k + U(BLOCK)]
            dz = centers[i + U(2 * BLOCK) + lane] - centers[k + U(2 * BLOCK)]
            squared, best = dx * dx + dy * dy + dz * dz, least[lane]
            least[lane] = squared if squared < best else best
        j += U(1)


@kernel
def _to_obstacles(obstacles, bounds, limit, centers, middles, scratch, out):  # type: ignore[no-untyped-def]
    """Lower `out` (BLOCK,), the limit, to the signed distance of any centre to any obstacle's surface."""
    _, _, reach, spheres, _ = bounds
    kind, center, rotation, size = obstacles
    place = np.empty(ROWS)
    for o in range(len(kind)):
        for row in range(3):
            place[row * BLOCK : (row + 1) * BLOCK] = center[o, row]
        extent = _length(size[o, 0], size[o, 1], size[o, 2]) if kind[o] == BOX else size[o, 0] + size[o, 1]
        for link in range(len(reach)):
            if _meet(middles, U(link) * U(ROWS), place, U(0), (limit + reach[link] + extent) * MARGIN):
                for i in range(spheres[link, 0], spheres[link, 1]):
                    _into_frame(center[o], rotation[o], centers, U(i) * U(ROWS), scratch)
                    _to_obstacle(kind[o], size[o, 0], size[o, 1], size[o, 2], scratch, out)


@kernel
def _to_obstacle(kind, a, b, c, point, out):  # type: ignore[no-untyped-def]
    """Lower `out` to the signed distance of points in an obstacle's frame to its surface."""
    for n in range(BLOCK):
        lane = U(n)
        x, y, z = point[lane], point[U(BLOCK) + lane], point[U(2 * BLOCK) + lane]
        if kind == SPHERE:
            distance = _length(x, y, z) - a
        elif kind == BOX:
            u, v, w = abs(x) - a, abs(y) - b, abs(z) - c
            distance = _length(max(u, 0.0), max(v, 0.0), max(w, 0.0)) + min(max(u, max(v, w)), 0.0)
        else:
            distance = _length(x, y, z - min(max(z, -b), b)) - a
        out[lane] = min(out[lane], distance)


@kernel
def _into_frame(center, rotation, centers, i, out):  # type: ignore[no-untyped-def]
    """Centres at offset i seen from a frame, (ROWS,)."""
    cx, cy, cz = center[0], center[1], center[2]
    for row in range(3):
        a, b, c, e = rotation[row], rotation[3 + row], rotation[6 + row], U(row * BLOCK)
        for n in range(BLOCK):
            lane = i + U(n)
            x, y, z = centers[lane] - cx, centers[lane + U(BLOCK)] - cy, centers[lane + U(2 * BLOCK)] - cz
            out[e + U(n)] = a * x + b * y + c * z


@kernel
def _length(x, y, z):  # type: ignore[no-untyped-def]
    return np.sqrt(x * x + y * y + z * z)
