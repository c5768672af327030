"""Arms at multiples of 15°, 30° and 45°, judged as in exact arithmetic.

Sines are rounded: sin 45° and sin 135° differ by a unit in the last place, so links on one line do
not come out on one line. Nothing that touches may be missed, nothing else may be counted.
"""

import itertools
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from collision.test_link_crossings_obstacles import bound
from composed import composed
from evoexp.collision.planar.arm_pairs import count_collisions
from evoexp.collision.planar.closed_form import closed_form
from evoexp.collision.planar.planar_arms import Arm
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.planners.proofs import judge_motion
from evoexp.records import FloatArray
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    CapsuleObstacle,
    HalfSpaceObstacle,
    SphereObstacle,
)
from references.link_crossings_numpy import exact_touch
from references.surds import Surd, as_near, exact_arm, exact_boundaries, within

UNIT = 1 / 800  # [m] all lengths below are multiples of it
LINK = 200
RADIUS = 40

Posture = tuple[int, int]


def postures(step: int, end: int = 180) -> list[Posture]:
    return list(itertools.product(range(0, end + 1, step), repeat=2))


def angles(chosen: list[Posture]) -> FloatArray:
    """Return link angles as planners compute them.  # (1, 2, N) [rad]."""
    return DEGREE * np.array(chosen, dtype=float).T.reshape(1, 2, -1)


def arm_at(x: int, y: int = 0) -> Arm:
    return Arm((x * UNIT, y * UNIT), (LINK * UNIT, LINK * UNIT))


def lines_of(points: list[Any]) -> list[Any]:
    return list(zip(points[:-1], points[1:], strict=True))


def check(found: Any, expected: Any) -> None:
    """Compare counts with exact ones: none missed, none too many."""
    assert np.array_equal(np.asarray(found) > 0, np.asarray(expected))
    assert 0 < np.count_nonzero(expected) < np.size(expected)


@pytest.mark.parametrize(
    ("step", "end", "distance"),
    [(45, 180, 400), (45, 180, 240), (90, 270, 200), (30, 180, 400)],
)
def test_lines_collide_as_in_exact_arithmetic(step: int, end: int, distance: int) -> None:
    """All four angles: with 45° and 180° these are 625 poses."""
    chosen = postures(step, end)
    first, second = arm_at(0), arm_at(distance)
    exact_1 = [lines_of(exact_arm((0, 0), LINK, posture)) for posture in chosen]
    exact_2 = [lines_of(exact_arm((distance, 0), LINK, posture)) for posture in chosen]
    expected = [
        [any(exact_touch(*a, *b) for a in one for b in two) for two in exact_2] for one in exact_1
    ]
    q = angles(chosen)
    points = first.outlines(q), second.outlines(q)
    counts = count_collisions(first, points[0], second, points[1]).counts
    check(counts, expected)
    pairs = np.array(list(np.ndindex(len(chosen), len(chosen)))).T
    closed = closed_form(first, q[0][:, pairs[0]], second, q[0][:, pairs[1]])
    check(closed.crossing.any(axis=0).reshape(counts.shape), expected)


def test_multiples_of_15_degrees_collide_as_in_exact_arithmetic() -> None:
    chosen, distance = postures(15), (300, 100)
    q, first, second = angles(chosen), arm_at(0), arm_at(*distance)
    counts = count_collisions(first, first.outlines(q), second, second.outlines(q)).counts
    exact_1 = [lines_of(exact_arm((0, 0), LINK, posture)) for posture in chosen]
    exact_2 = [lines_of(exact_arm(distance, LINK, posture)) for posture in chosen]
    drawn = np.random.default_rng(3).integers(0, len(chosen), (1000, 2))
    expected = [any(exact_touch(*a, *b) for a in exact_1[i] for b in exact_2[j]) for i, j in drawn]
    check(counts[drawn[:, 0], drawn[:, 1]], expected)


@pytest.mark.parametrize(("half_width", "radius", "distance"), [(20, 0, 240), (100, 200, 400)])
def test_envelopes_collide_as_in_exact_arithmetic(
    half_width: int, radius: int, distance: int
) -> None:
    """Widths and radii at which boundary lines lie on one line, and circles touch them."""
    chosen = postures(45)
    enveloped = [Arm(*arm_at(x)[:2], half_width * UNIT, radius * UNIT) for x in (0, distance)]
    exact = [
        [
            (
                exact_boundaries((x, 0), LINK, posture, half_width),
                exact_arm((x, 0), LINK, posture)[2],
            )
            for posture in chosen
        ]
        for x in (0, distance)
    ]

    def collide(one: Any, two: Any) -> bool:
        (lines_1, tip_1), (lines_2, tip_2) = one, two
        if any(exact_touch(*a, *b) for a in lines_1 for b in lines_2):
            return True
        return radius > 0 and (
            within(tip_1, tip_1, tip_2, 2 * radius)
            or any(within(*line, tip_2, radius) for line in lines_1)
            or any(within(*line, tip_1, radius) for line in lines_2)
        )

    expected = [[collide(one, two) for two in exact[1]] for one in exact[0]]
    outlines = [arm.outlines(angles(chosen)) for arm in enveloped]
    check(count_collisions(enveloped[0], outlines[0], enveloped[1], outlines[1]).counts, expected)


def _inside_box(point: Any, half: tuple[int, int], center: tuple[int, int]) -> bool:
    return all(
        Surd(-size) <= value - middle <= Surd(size)
        for value, size, middle in zip(point, half, center, strict=True)
    )


def test_obstacles_are_hit_as_in_exact_arithmetic() -> None:
    """Discs and capsules are touched by a link's line, edges and corners by its end."""
    chosen = postures(45, 315)
    arms = [exact_arm((0, 0), LINK, posture) for posture in chosen]
    place = [x * UNIT for x in range(801)]
    start, end = (Surd(200), Surd(0)), (Surd(200), Surd(100))
    corners = [(Surd(x), Surd(y)) for x, y in ((200, 0), (300, 0), (300, 100), (200, 100))]
    cases: list[tuple[Any, Any]] = [
        (
            SphereObstacle(shape="sphere", center=(place[200], place[200]), radius=place[200]),
            lambda line, radius: within(*line, (Surd(200), Surd(200)), 200 + radius),
        ),
        (
            CapsuleObstacle(
                shape="capsule",
                start=(place[200], 0.0),
                end=(place[200], place[100]),
                radius=place[100],
            ),
            lambda line, radius: as_near(line, (start, end), 100 + radius),
        ),
        (
            BoxObstacle(shape="box", center=(place[250], place[50]), size=(place[100], place[100])),
            lambda line, radius: (
                any(_inside_box(point, (50, 50), (250, 50)) for point in line)
                or any(
                    as_near(line, edge, radius)
                    for edge in zip(corners, [*corners[1:], corners[0]], strict=True)
                )
            ),
        ),
        (
            HalfSpaceObstacle(shape="half_space", point=(place[200], 0.0), normal=(-1.0, 0.0)),
            lambda line, radius: any(point[0] + radius >= Surd(200) for point in line),
        ),
    ]
    arm = arm_at(0)
    circled = arm._replace(tcp_radius=RADIUS * UNIT)
    for obstacle, touches in cases:
        links = [any(touches(line, 0) for line in lines_of(points)) for points in arms]
        check(bound(arm, obstacle).with_obstacles(0, angles(chosen)), links)
        tips = [
            met or touches((points[2], points[2]), RADIUS)
            for met, points in zip(links, arms, strict=True)
        ]
        check(bound(circled, obstacle).with_obstacles(0, angles(chosen)), tips)


def turned(t: Fraction) -> tuple[Fraction, Fraction]:
    """Return a direction with rational coordinates, its angle twice the arctangent of t."""
    return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)


def degrees_of(x: Fraction, y: Fraction) -> float:
    return float(np.degrees(np.arctan2(float(y), float(x))))


@pytest.mark.parametrize("offset", [0.0, 1.0, 1e4])
@pytest.mark.parametrize("tilt", [Fraction(0), Fraction(1, 10**10), Fraction(1, 10**8)])
def test_parallel_links_are_decided_at_any_angle(offset: float, tilt: Fraction) -> None:
    """Directions with rational sines: on one line, or almost, then a little beside it."""
    rng, quarter = np.random.default_rng(8), Fraction(1, 4)
    expected, found = [], []
    for _ in range(100):
        t = Fraction(int(rng.integers(1, 400)), int(rng.integers(1, 400)))
        shift = Fraction(int(rng.choice([-1, 1])) * int(rng.integers(4, 41)), 100)
        (x, y), (u, v) = turned(t), turned(t + tilt * int(1 + offset))
        for aside in (Fraction(0), Fraction(int(1 + offset), 10**13)):
            # the second arm's base lies on the line of the first arm's first link, or beside it
            base = (x * shift - y * aside, y * shift + x * aside)
            first = Arm((offset, offset), (0.25, 0.25))
            place = [float(Fraction(offset) + b) for b in base]
            second = Arm((place[0], place[1]), (0.25, 0.25))
            one = [(Fraction(0), Fraction(0)), (x * quarter, y * quarter)]
            one.append((one[1][0] - y * quarter, one[1][1] + x * quarter))
            q_1 = DEGREE * np.array([degrees_of(x, y), degrees_of(-y, x)]).reshape(1, 2, 1)
            for a, b in ((u, v), (-u, -v)):
                two = [base, (base[0] + a * quarter, base[1] + b * quarter)]
                two.append((two[1][0] + v * quarter, two[1][1] - u * quarter))
                q_2 = DEGREE * np.array([degrees_of(a, b), degrees_of(v, -u)]).reshape(1, 2, 1)
                expected.append(
                    any(exact_touch(*m, *n) for m in lines_of(one) for n in lines_of(two))
                )
                counts = count_collisions(first, first.outlines(q_1), second, second.outlines(q_2))
                found.append(counts.counts[0, 0])
    check(found, expected)


def test_links_on_one_line_collide_as_the_exact_verdict_says() -> None:
    """Both arms lie on the x axis: 0°, 180° folds back on itself, 180°, 180° reaches over it."""
    planner, problem = composed("experiment=curkovic_methods", label="V").prepare()
    solution = np.array([[0.0, 180.0] * 6, [180.0, 180.0] * 6]).ravel()
    assert planner.evaluate(problem, solution)["team_collisions"] == planner.num_configurations
    verdict = judge_motion(planner, problem, planner.motion(problem, solution))
    assert verdict.certified is False


OVERLAPPING = "[{angles: [45.0, 180.0]}, {angles: [135.0, 180.0]}]"


@pytest.mark.parametrize(
    "words",
    [
        ["experiment=curkovic_methods_b", f"scenario.q_start={OVERLAPPING}"],
        ["experiment=curkovic_methods_b", f"scenario.q_goal={OVERLAPPING}"],
        [
            "experiment=curkovic_methods_b",
            f"scenario.q_start={OVERLAPPING}",
            f"scenario.q_goal={OVERLAPPING}",
            "scenario.stationary=[1]",
        ],
    ],
)
def test_a_start_whose_links_overlap_on_one_line_is_refused(words: list[str]) -> None:
    """At 45° and 135° the links that lie at 180° share 10 cm, at heights one last place apart."""
    condition = composed(*words, label="I")
    with pytest.raises(SettingError, match=r"free of collision \(robots 1 and 2 touch"):
        condition.prepare()
