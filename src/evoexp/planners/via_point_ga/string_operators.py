"""Operators of strings of via-points (Rana & Zalzala 1995, section 3.4 b and d).

"Double cross-over" of a string p : q can be read in two ways:

- tails: either arm's path is cut in two, and what follows the site is exchanged, arm by arm;
- segment: the whole string is cut at both sites, and what lies between them is exchanged: the end
  of the first arm's path and the beginning of the second arm's. With more arms every second piece
  of the string is exchanged.
"""

from typing import Annotated

import numpy as np
from pydantic import Field

from evoexp.evolution.operators.operator import Context, Crossover, Genome, Mutation
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import DEGREE, sincos
from evoexp.records import FloatArray, IntArray
from evoexp.validation import NonNegativeCount, Positive


def num_uniforms(arm_slices: np.ndarray, num_via_points: int) -> int:
    """Return the number of uniform numbers of one string: N − 1 times the arm's joints less one."""
    return int(sum((num_via_points - 1) * (stop - first - 1) for first, stop in arm_slices))


@kernel
def walk_strings(
    via_points: FloatArray,  # (nq, N + 1, lanes), written in the given lanes
    lanes: IntArray,  # (strings,) where to write
    uniforms: FloatArray,  # (strings, num_uniforms) in [0, 1)
    start: FloatArray,  # (nq,)
    goal: FloatArray,  # (nq,)
    arm_slices: IntArray,  # (arms, 2) rows of each arm
    step: float,  # step length in units of D / N
    max_turn: float,  # turns are uniform in ± this [rad]
) -> None:
    """Write new strings into some lanes.

    Every arm takes N − 1 steps of length step · D / N, D its straight distance from start to goal.
    A step goes in the direction of the goal, each of whose angles is turned by a uniform random
    angle: in the plane of two joints the one angle, in space azimuth and elevation, and so on. The
    goal itself is the last point. An arm of one joint has no angle to turn.
    """
    via_points, lanes, uniforms = borrowed((via_points, lanes, uniforms))
    num, here, direction = via_points.shape[1] - 1, np.empty(len(start)), np.empty(len(start))
    for s in range(len(lanes)):
        lane, taken = lanes[s], 0
        via_points[:, 0, lane], via_points[:, num, lane] = start, goal
        here[:] = start
        for arm in range(len(arm_slices)):
            first, stop = arm_slices[arm, 0], arm_slices[arm, 1]
            squared = 0.0
            for j in range(first, stop):
                squared += (goal[j] - start[j]) * (goal[j] - start[j])
            length = step * np.sqrt(squared) / num
            for i in range(1, num):
                # the direction of the goal, turned; one angle less than joints
                for j in range(first, stop):
                    direction[j] = goal[j] - here[j]
                scale = length * _turn(direction, first, stop, uniforms[s], taken, max_turn)
                taken += stop - first - 1
                for j in range(first, stop):
                    here[j] = here[j] + scale * direction[j]
                    via_points[j, i, lane] = here[j]


@inlined
def _turn(
    direction: FloatArray,
    first: int,
    stop: int,
    uniforms: FloatArray,
    taken: int,  # place of the first number
    max_turn: float,
) -> float:
    """Turn the hyperspherical angles of an arm's direction; return the factor to unit length.

    The azimuth is turned first. The angle of coordinate k stands between the axis k and the vector
    of the coordinates before it, of length `below`. Turning it takes (below, direction[k]) around;
    the coordinates before keep their proportions. A direction straight along a later axis has
    azimuth 0.
    """
    x = direction[first]
    if stop - first == 1:
        return 0.0 if x == 0.0 else 1.0 / abs(x)
    y = direction[first + 1]
    sine, cosine = sincos((2.0 * uniforms[taken] - 1.0) * max_turn)
    below = np.sqrt(x * x + y * y)
    one, two = x * cosine - y * sine, x * sine + y * cosine
    direction[first], direction[first + 1] = one, two
    one, two = (one / below, two / below) if below != 0.0 else (cosine, sine)
    for k in range(first + 2, stop):
        sine, cosine = sincos((2.0 * uniforms[taken + k - first - 1] - 1.0) * max_turn)
        turned = below * cosine - direction[k] * sine
        beyond = below * sine + direction[k] * cosine
        for j in range(first, k):
            alone = direction[j]
            if j < first + 2:
                alone = turned * (one if j == first else two)
            direction[j] = alone if below == 0.0 else direction[j] * (turned / below)
        direction[k] = beyond
        below = np.sqrt(turned * turned + beyond * beyond)
    return 0.0 if below == 0.0 else float(1.0 / below)


class StringCrossover(Crossover):
    """Crosses strings at one site per arm, where the parents are close (section 3.4 b).

    A pair is crossed only if at the sites chosen in all arms' portions the two parents' via-points
    are closer than a distance.
    """

    crossover_distance: Positive  # Euclidean [deg]
    # whether the segment between the sites is exchanged, instead of the tails
    exchanges_segment: bool = False

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return per pair one for the decision, and one for the site of every arm."""
        return count // 2 * (1 + len(genome.arms))

    @staticmethod
    @kernel
    def cross(genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray) -> None:
        """Write offspring; see `Crossover`."""
        arms, num_points = context.genome.arms, context.genome.num_points
        max_distance, segment = context.settings[0], context.settings[1] != 0.0
        num_arms, num_offspring = len(arms), len(parents)
        # mates and sites of every pair; who is not crossed is its own mate
        mates = parents.copy()
        sites = np.full((num_arms, num_offspring), num_points)
        for pair in range(num_offspring // 2):
            draw = context.uniforms[pair * (1 + num_arms) :]
            first, second = parents[2 * pair], parents[2 * pair + 1]
            if num_points < 3 or not draw[0] < context.rate:
                continue
            close = True
            for arm in range(num_arms):
                site = 1 + min(int(draw[1 + arm] * (num_points - 2)), num_points - 3)  # 1 … N − 1
                squared = 0.0
                for j in range(arms[arm, 0], arms[arm, 1]):
                    gene = j * num_points + site
                    step = genomes[gene, first] - genomes[gene, second]
                    squared += step * step
                close = close and np.sqrt(squared) < max_distance
                sites[arm, 2 * pair] = site
                sites[arm, 2 * pair + 1] = site
            if close:
                mates[2 * pair], mates[2 * pair + 1] = second, first
        # every child: its own parent before the site, the mate from the site on; where a segment
        # is exchanged, the other way round for every second arm
        source = np.empty(num_offspring, dtype=np.uint64)  # not to be counted from the end
        for arm in range(num_arms):
            site = sites[arm]
            heads, tails = (mates, parents) if segment and arm % 2 == 1 else (parents, mates)
            for i in range(num_points):
                for k in range(num_offspring):
                    source[k] = heads[k] if i < site[k] else tails[k]
                for j in range(arms[arm, 0], arms[arm, 1]):
                    before, after = genomes[j * num_points + i], out[j * num_points + i]
                    for k in range(num_offspring):
                        after[k] = before[source[k]]


class NewTrajectories(Mutation):
    """Replaces offspring by new random walks (section 3.4 d).

    They take distinct places, each with the rate as probability.
    """

    num_new_trajectories: NonNegativeCount  # offspring that may be replaced
    walk_step: Positive  # step of a new trajectory, in units of its straight distance over N
    # largest random turn of a step away from the direction of the goal [deg]
    max_turn: Annotated[float, Field(ge=0.0, le=180.0)]

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return per new trajectory one for the place, one for the decision, then the walk's."""
        walk = num_uniforms(genome.arms, genome.num_points - 1)
        return self.num_new_trajectories * (2 + walk)

    @staticmethod
    @kernel
    def mutate(genomes: FloatArray, count: int, context: Context) -> None:
        """Change offspring; see `Mutation`."""
        arms, num_points = context.genome.arms, context.genome.num_points
        uniforms = context.uniforms
        new, step, max_turn = int(context.settings[0]), context.settings[1], context.settings[2]
        if new == 0:
            return
        # distinct places in random order: the head of a Fisher–Yates shuffle
        slots, num = np.arange(count), 0
        for k in range(min(new, count)):
            other = k + min(int(uniforms[k] * (count - k)), count - k - 1)
            slots[k], slots[other] = slots[other], slots[k]
        # each with the mutation's probability
        walks = uniforms[2 * new :].reshape((new, -1))
        for k in range(min(new, count)):
            if uniforms[new + k] < context.rate:
                slots[num] = slots[k]
                for j in range(walks.shape[1]):  # assigning rows compiles numba's message on shapes
                    walks[num, j] = walks[k, j]
                num += 1
        # all strings have the same ends
        strings = genomes.reshape((-1, num_points, genomes.shape[1]))
        start, goal = strings[:, 0, 0].copy(), strings[:, num_points - 1, 0].copy()
        turn = DEGREE * max_turn
        walk_strings(strings, slots[:num], walks[:num], start, goal, arms, step, turn)
