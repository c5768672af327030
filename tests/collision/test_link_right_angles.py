"""Links at exact multiples of 90°: on one line with each other, or crossing at right angles.

sin π = 1.2e-16 of the float64 nearest to π would put overlapping links beside each other.
"""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from evoexp.collision.models.link_crossings import Arm, count_crossings
from evoexp.configuration import compose
from evoexp.numeric.elementary import DEGREE
from evoexp.planners.proofs import judge_motion
from references.link_crossings_numpy import segments_touch

QUARTERS = (0, 1, 2, 3)
POSTURES = list(itertools.product(QUARTERS, QUARTERS))
DIRECTIONS = {0: (1, 0), 1: (0, 1), 2: (-1, 0), 3: (0, -1)}


def ideal_arm(base: Fraction, posture: tuple[int, int]) -> list[tuple[Fraction, Fraction]]:
    """Return base, elbow and tip of an arm of two links of 1/4, in rational numbers."""
    points = [(base, Fraction(0))]
    for quarter in posture:
        x, y = DIRECTIONS[quarter]
        points.append((points[-1][0] + Fraction(x, 4), points[-1][1] + Fraction(y, 4)))
    return points


@pytest.mark.parametrize("distance", [Fraction(3, 10), Fraction(1, 2), Fraction(3, 4)])
def test_counts_are_those_of_rational_geometry(distance: Fraction) -> None:
    arms = Arm((0.0, 0.0), (0.25, 0.25)), Arm((float(distance), 0.0), (0.25, 0.25))
    q = DEGREE * (90.0 * np.array(POSTURES, dtype=float).T.reshape(1, 2, -1))
    found = count_crossings(arms[0], arms[0].points(q), arms[1], arms[1].points(q)).counts
    for i, j in np.ndindex(found.shape):
        one, two = ideal_arm(Fraction(0), POSTURES[i]), ideal_arm(distance, POSTURES[j])
        met = any(segments_touch(*one[m : m + 2], *two[n : n + 2]) for m in (0, 1) for n in (0, 1))
        assert bool(found[i, j]) is met, (POSTURES[i], POSTURES[j])


def test_links_that_overlap_on_one_line_collide_as_the_exact_verdict_says() -> None:
    """Both arms lie on the x axis: 0°, 180° folds back on itself, 180°, 180° reaches over it."""
    condition = compose.expand(["experiment=curkovic_methods"], only=["V"])[0].conditions[0]
    planner, problem = condition.condition.prepare()
    solution = np.array([[0.0, 180.0] * 6, [180.0, 180.0] * 6]).ravel()
    assert planner.evaluate(problem, solution)["team_collisions"] == planner.num_configurations
    verdict = judge_motion(planner, problem, planner.motion(problem, solution))
    assert verdict.certified is False
