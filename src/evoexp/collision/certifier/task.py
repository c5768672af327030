"""A motion among bodies for the certifier's kernels, distances of pairs, and their local minima."""

from typing import NamedTuple

import numpy as np

from evoexp.collision.body_table import BodyTable
from evoexp.collision.certifier.convex_distance import CONVERGED, distance_bounds, support
from evoexp.collision.motion_bounds import (
    joint_frames,
    joint_twists,
    moved_by_one,
    pair_reaches,
    reaches,
)
from evoexp.collision.scene import Scene
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.paths.motion import Motion
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import SPATIAL_ROWS, KinematicChain

FIRST_STEP = 0.02  # [segments] towards a local minimum
FINEST = 1e-10  # [segments] the last step is not less
SHRINK = 0.0625  # [-] of the step where neither side is closer
MAX_MOVES = 1000  # on the way to a local minimum
MAX_POLISHED = 8  # pairs whose local minimum is sought, those with the least distances
WIDER = 1.0 + 1e-9  # on all bounds of speed: more than rounding


class Task(NamedTuple):
    """A motion among bodies."""

    chain: KinematicChain  # the joints
    bodies: BodyTable  # the bodies
    pairs: IntArray  # (pairs, 2) indices of bodies
    # (pairs,) whether upper bounds of distances are believed; where they are not, every interval in
    # which contact cannot be excluded becomes a leaf
    exact: BoolArray
    coefficients: FloatArray  # (segments, 4, nq) of the motion
    straight: bool  # whether all segments are straight lines
    last: float  # the last instant: the number of segments, or 0 for a motion of one instant
    weights: FloatArray  # (pairs, joints) from `approach_weights`
    by_one: BoolArray  # (pairs,) from `moved_by_one`


class Workspace(NamedTuple):
    """The configuration that is looked at, and scratch."""

    q: FloatArray  # (nq,)
    frames: FloatArray  # (joints, 12) of the joints
    world: FloatArray  # (bodies, 12) of the bodies
    # (bodies + 2,) the configuration's number when each body was placed; the last but one when the
    # twists were computed; the last: its number now
    stamps: IntArray
    normals: FloatArray  # (pairs, 3) direction across which each pair was last separated
    simplex: FloatArray  # (4, 3) of `distance_bounds`
    scratch: FloatArray  # (3, 3)
    twists: FloatArray  # (joints, 6) of the joints


def motion_task(scene: Scene, motion: Motion) -> Task:
    """Return the task of a motion; a single instant becomes a segment without movement."""
    polynomials = motion.polynomials
    if motion.num_segments == 0:
        polynomials = np.zeros((1, 4, motion.q.shape[1]))
        polynomials[0, 0] = motion.q[0]
    chain, bodies, pairs = scene.table.chain, scene.bodies, scene.pairs
    return Task(
        chain,
        bodies,
        pairs,
        bodies.exact[pairs].all(axis=1),
        np.ascontiguousarray(polynomials),
        motion.coefficients is None,
        float(motion.num_segments),
        approach_weights(chain, bodies, pairs, motion.greatest),
        moved_by_one(chain, bodies.joint, pairs),
    )


def work_space(task: Task) -> Workspace:
    """Return the workspace of a task; bodies that stand still are in their places."""
    num_joints, bodies = len(task.chain.parent), task.bodies
    world = np.empty((len(bodies.joint), SPATIAL_ROWS))
    world[:, :9], world[:, 9:] = bodies.rotation, bodies.translation
    return Workspace(
        q=np.zeros(task.coefficients.shape[2]),
        frames=np.zeros((num_joints, SPATIAL_ROWS)),
        world=world,
        stamps=np.zeros(len(bodies.joint) + 2, dtype=np.int64),
        normals=np.ones((len(task.pairs), 3)),
        simplex=np.zeros((4, 3)),
        scratch=np.zeros((3, 3)),
        twists=np.zeros((num_joints, 6)),
    )


@kernel
def approach_weights(
    chain: KinematicChain, bodies: BodyTable, pairs: IntArray, strokes: FloatArray
) -> FloatArray:
    """Bound the change of each pair's distance by each joint's speed, widened against rounding.

    Args:
        pairs: (pairs, 2) indices of bodies.
        strokes: (nq,) greatest |q| in the motion.

    Returns:
        (pairs, joints).
    """
    reach = reaches(chain, bodies.joint, bodies.from_origin, bodies.from_axis, strokes)
    return pair_reaches(pairs, reach) * WIDER


@inlined
def move_to(task: Task, work: Workspace, segment: int, u: float) -> None:
    """Place the joints at u in [0, 1] on a segment."""
    work.stamps[-1] += 1
    coefficients, q = task.coefficients[segment], work.q
    for k in range(len(q)):  # by Horner's rule
        c1, c2, c3 = coefficients[1, k], coefficients[2, k], coefficients[3, k]
        q[k] = coefficients[0, k] + u * (c1 + u * (c2 + u * c3))
    joint_frames(task.chain, work.q, work.frames)


@inlined
def pair_distance(
    task: Task, work: Workspace, pair: int, need: float, enough: float, converged: float
) -> tuple[float, float]:
    """Return `distance_bounds` of a pair, whose bodies are placed first unless they already are."""
    bodies, stamps, world = task.bodies, work.stamps, work.world
    for side in range(2):
        body = task.pairs[pair, side]
        joint = bodies.joint[body]
        if joint >= 0 and stamps[body] != stamps[-1]:
            stamps[body] = stamps[-1]
            frame, rotation, translation = (
                work.frames[joint],
                bodies.rotation[body],
                bodies.translation[body],
            )
            for e in range(3):
                a, b, c = frame[3 * e], frame[3 * e + 1], frame[3 * e + 2]
                for k in range(3):
                    turned = a * rotation[k] + b * rotation[3 + k] + c * rotation[6 + k]
                    world[body, 3 * e + k] = turned
                x, y, z = translation[0], translation[1], translation[2]
                world[body, 9 + e] = frame[9 + e] + (a * x + b * y + c * z)
    one, two, normal = task.pairs[pair, 0], task.pairs[pair, 1], work.normals[pair]
    return distance_bounds(
        bodies, world, one, two, need, enough, converged, normal, work.simplex, work.scratch
    )


@inlined
def least_separation(
    task: Task, work: Workspace, pair: int, segment: int, u: float, half: float
) -> float:
    """Return the least gap across a pair's last normal from u − half to u + half.

    Velocities count as constant; the gap is concave, so it is least at an end.
    """
    if work.stamps[-2] != work.stamps[-1]:
        work.stamps[-2] = work.stamps[-1]
        joint_twists(task.chain, task.coefficients[segment], u, work.frames, work.twists)
    return min(_gap_later(task, work, pair, -half), _gap_later(task, work, pair, half))


@inlined
def _gap_later(task: Task, work: Workspace, pair: int, later: float) -> float:
    """Return the gap across a pair's last normal, `later` ahead, at constant velocities.

    A point x of a body then stands at x + later (v + ω × x), at a height
    n·x + later (n·v + (n × ω)·x) that is linear in x: the least and the greatest height are those
    of support points in a turned direction. The gap is a concave function of `later`. The normal
    leads from the second to the first, and has any length.
    """
    bodies, world, twists, normal = task.bodies, work.world, work.twists, work.normals[pair]
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    if not length > 0.0:
        return -np.inf
    nx, ny, nz = normal[0] / length, normal[1] / length, normal[2] / length
    gap, turned, point = 0.0, work.scratch[2], work.scratch[1]
    for side in range(2):
        body, sign = task.pairs[pair, side], -1.0 if side == 0 else 1.0
        joint = bodies.joint[body]
        # the normal turned with the body, and the height that its velocity adds
        turned[0], turned[1], turned[2], moved = nx, ny, nz, 0.0
        if joint >= 0:
            w = twists[joint]
            turned[0] += later * (ny * w[2] - nz * w[1])
            turned[1] += later * (nz * w[0] - nx * w[2])
            turned[2] += later * (nx * w[1] - ny * w[0])
            moved = later * (nx * w[3] + ny * w[4] + nz * w[5])
        support(bodies, world, body, turned, sign, point)
        tx, ty, tz = turned[0], turned[1], turned[2]
        height = tx * point[0] + ty * point[1] + tz * point[2] + moved
        gap -= sign * height + bodies.radius[body] * np.sqrt(tx * tx + ty * ty + tz * tz)
    return gap


class LeastDistance:
    """The least distance of a scene's pairs, configuration by configuration.

    It agrees with coal up to rounding, and for ellipsoids up to coal's own error.
    """

    def __init__(self, scene: Scene) -> None:
        """Take a scene whose bodies are `known`, and its pairs."""
        self._task = motion_task(scene, Motion(np.zeros((1, scene.model.nq))))
        self._work = work_space(self._task)

    def __call__(self, q: FloatArray) -> FloatArray:
        """Return the least distance at each configuration, 0 where bodies overlap.

        Args:
            q: (nq, configurations) [rad].

        Returns:
            (configurations,) [length unit]; inf without pairs.
        """
        least = np.empty(q.shape[1])
        _least_distances(self._task, self._work, np.ascontiguousarray(q.T), least)
        return least


def known(scene: Scene) -> bool:
    """Return whether the kernels know every body of a scene's pairs by its very shape."""
    return bool(scene.bodies.exact[scene.pairs].all())


@kernel
def _least_distances(task: Task, work: Workspace, q: FloatArray, least: FloatArray) -> None:
    task, work, q, least = borrowed((task, work, q, least))
    for k in range(len(q)):
        work.stamps[-1] += 1
        joint_frames(task.chain, q[k], work.frames)
        best = np.inf
        for pair in range(len(task.pairs)):
            # a pair that is seen to be farther than the best need not be measured
            _, high = pair_distance(task, work, pair, best, -np.inf, CONVERGED)
            best = min(best, high)
        least[k] = max(best, 0.0)


@kernel
def polish(
    task: Task, work: Workspace, pairs: IntArray, t: FloatArray, distances: FloatArray
) -> None:
    """Walk from given instants to local minima of pairs' distances.

    The walk goes on in equal steps while a neighbour is closer. Where neither is, the vertex of the
    parabola through the three is tried, and the step shrinks: a smooth minimum takes some 25
    distances; a minimum at an instant, where the motion bends, takes no more.

    Args:
        work: From `work_space`.
        pairs: (walks,) the pair of each walk.
        t: (walks,) where it begins; written: where it ended.
        distances: (walks,), written.
    """
    task, work, pairs, t, distances = borrowed((task, work, pairs, t, distances))
    for walk in range(len(pairs)):
        here, best, step = t[walk], np.inf, FIRST_STEP
        for move in range(MAX_MOVES):
            after = before = np.inf
            closer = False
            # the place itself (once), a step ahead, a step back, the parabola's vertex
            for k in range(1 if move > 0 else 0, 4):
                ahead = 0.0
                if k == 1:
                    ahead = step
                elif k == 2:
                    ahead = -step
                elif k == 3:
                    bend = (after - best) + (before - best)
                    ahead = 0.5 * step * (before - after) / bend if 0.0 < bend < np.inf else 0.0
                tried = min(max(here + ahead, 0.0), task.last)
                if tried == here and k > 0:
                    continue
                segment = min(int(tried), len(task.coefficients) - 1)
                move_to(task, work, segment, tried - segment)
                _, distance = pair_distance(task, work, pairs[walk], np.inf, -np.inf, CONVERGED)
                after = distance if k == 1 else after
                before = distance if k == 2 else before
                if distance < best:
                    here, best, closer = tried, distance, k in (1, 2)
                    if closer:
                        break
            step *= 1.0 if closer else SHRINK
            if step < FINEST:
                break
        t[walk], distances[walk] = here, best
