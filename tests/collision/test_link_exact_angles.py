"""Arms at multiples of 15°, 30°, 45°, whose links touch but for rounded sines: as if exact."""

import itertools
from typing import Any

import numpy as np
import pytest

from collision.test_link_crossings import bound
from composed import composed
from evoexp.collision.planar.arm_pairs import count_collisions
from evoexp.collision.planar.planar_arms import Arm
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from obstacle_samples import box, capsule, half_space, sphere
from references.link_crossings_numpy import exact_touch
from references.surds import Surd, as_near, exact_arm, exact_boundaries, within

UNIT = 1 / 800  # [m] all lengths below are multiples of it
LINK = 200
RADIUS = 40


def postures(step: int, end: int = 180) -> list[Any]:
    return list(itertools.product(range(0, end + 1, step), repeat=2))


def angles(chosen: list[Any]) -> FloatArray:
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
    ("step", "end", "base"),
    [(45, 180, (400, 0)), (45, 180, (240, 0)), (90, 270, (200, 0)), (30, 180, (400, 0)),
     (15, 180, (300, 100))],
)  # fmt: skip
def test_lines_collide_as_in_exact_arithmetic(step: int, end: int, base: Any) -> None:
    """All four angles: with 45° and 180° these are 625 poses; with 15°, a thousand of them."""
    chosen, arms = postures(step, end), (arm_at(0), arm_at(*base))
    exact = [
        [lines_of(exact_arm(place, LINK, posture)) for posture in chosen]
        for place in ((0, 0), base)
    ]
    pairs = np.array(list(np.ndindex(len(chosen), len(chosen)))).T
    if step == 15:
        pairs = np.random.default_rng(3).integers(0, len(chosen), (2, 1000))
    expected = [
        any(exact_touch(*a, *b) for a in exact[0][i] for b in exact[1][j]) for i, j in pairs.T
    ]
    q = angles(chosen)
    outlines = [arm.outlines(q) for arm in arms]
    counts = count_collisions(arms[0], outlines[0], arms[1], outlines[1]).counts
    check(counts[tuple(pairs)], expected)


@pytest.mark.parametrize(("half_width", "radius", "distance"), [(20, 0, 240), (100, 200, 400)])
def test_envelopes_collide_as_in_exact_arithmetic(
    half_width: int, radius: int, distance: int
) -> None:
    """Widths and radii at which boundary lines lie on one line, and circles touch them."""
    chosen, places = postures(45), [(0, 0), (distance, 0)]
    exact = [
        [
            (exact_boundaries(place, LINK, each, half_width), exact_arm(place, LINK, each)[2])
            for each in chosen
        ]
        for place in places
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
    first, second = (Arm(*arm_at(*at)[:2], half_width * UNIT, radius * UNIT) for at in places)
    outlines = [arm.outlines(angles(chosen)) for arm in (first, second)]
    check(count_collisions(first, outlines[0], second, outlines[1]).counts, expected)


CORNERS = [(Surd(x), Surd(y)) for x, y in ((200, 0), (300, 0), (300, 100), (200, 100))]
EDGES = list(zip(CORNERS, [*CORNERS[1:], CORNERS[0]], strict=True))
MIDDLE = 200 * UNIT, 100 * UNIT


def in_box(point: Any) -> bool:
    return Surd(200) <= point[0] <= Surd(300) and Surd(0) <= point[1] <= Surd(100)


TOUCHES = {
    "disc": (sphere((MIDDLE[0], MIDDLE[0]), MIDDLE[0]),
        lambda line, radius: within(*line, (Surd(200), Surd(200)), 200 + radius)),
    "capsule": (capsule((MIDDLE[0], 0.0), MIDDLE, MIDDLE[1]),
        lambda line, radius: as_near(line, (CORNERS[0], CORNERS[3]), 100 + radius)),
    "box": (box((250 * UNIT, 50 * UNIT), (MIDDLE[1], MIDDLE[1])),
        lambda line, radius: any(map(in_box, line)) or any(
            as_near(line, edge, radius) for edge in EDGES)),
    "wall": (half_space((MIDDLE[0], 0.0), (-1.0, 0.0)),
        lambda line, radius: any(point[0] + radius >= Surd(200) for point in line)),
}  # fmt: skip


@pytest.mark.parametrize("name", TOUCHES)
def test_obstacles_are_hit_as_in_exact_arithmetic(name: str) -> None:
    """Discs and capsules are touched by a link's line, edges and corners by its end."""
    (obstacle, touches), chosen, arm = TOUCHES[name], postures(45, 315), arm_at(0)
    points = [exact_arm((0, 0), LINK, posture) for posture in chosen]
    links = [any(touches(line, 0) for line in lines_of(each)) for each in points]
    check(bound(arm, obstacle).with_obstacles(0, angles(chosen)), links)
    tips = [
        hit or touches((tip, tip), RADIUS) for hit, (*_, tip) in zip(links, points, strict=True)
    ]
    circled = arm._replace(tcp_radius=RADIUS * UNIT)
    check(bound(circled, obstacle).with_obstacles(0, angles(chosen)), tips)


@pytest.mark.parametrize("end", ["q_start", "q_goal"])
def test_ends_whose_links_overlap_on_one_line_are_refused(end: str) -> None:
    """At 45° and 135° the links that lie at 180° share 10 cm, at heights one last place apart."""
    word = f"scenario.{end}=[{{angles: [45.0, 180.0]}}, {{angles: [135.0, 180.0]}}]"
    condition = composed("experiment=curkovic_methods_b", word, label="I")
    with pytest.raises(SettingError, match=r"free of collision \(robots 1 and 2 touch"):
        condition.prepare()
