"""Links and their envelopes against numpy, rational numbers, the closed form; obstacles: coal."""

from typing import Any

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coal_shapes import distance, placed
from evoexp.collision.planar import planar_arms
from evoexp.collision.planar.arm_pairs import count_collisions
from evoexp.collision.planar.link_collision import LinkCollision, LinkCrossings
from evoexp.errors import SettingError
from evoexp.robots.arms import PlanarChain
from matrix import first
from obstacle_samples import box, capsule, ellipse, half_space, sphere
from references import arms_6r
from references import link_crossings_numpy as plain

SCENE_A = planar_arms.Arm((0.0, 0.0), (0.25, 0.25)), planar_arms.Arm((0.3, 0.0), (0.25, 0.25))
UNEQUAL = planar_arms.Arm((-0.2, 0.1), (0.4, 0.1)), planar_arms.Arm((0.3, -0.05), (0.15, 0.35))


def outlines(arms: Any, rng: np.random.Generator, *counts: int, size: int = 3) -> Any:
    return [
        arm.outlines(rng.uniform(0.0, np.pi, (size, 2, count)))
        for arm, count in zip(arms, counts, strict=True)
    ]


def counts_of(arms: Any, drawn: Any) -> np.ndarray:
    """Count the collisions of each pair; their sums are checked."""
    found = count_collisions(arms[0], drawn[0], arms[1], drawn[1])
    assert np.array_equal(found.sums_1, found.counts.sum(axis=1))
    assert np.array_equal(found.sums_2, found.counts.sum(axis=0))
    return found.counts


def boundaries(arm: planar_arms.Arm, outline: np.ndarray) -> np.ndarray:
    """Return the four boundary lines of all outlines, (4, 4, K, N)."""
    base = np.broadcast_to(np.reshape(arm.base, (2, 1, 1)), outline.transpose(1, 0, 2)[:2].shape)
    elbow, tip, *turns = outline[:, :8].transpose(1, 0, 2).reshape(4, 2, *base.shape[1:])
    return np.array(
        [
            np.concatenate(
                [end + side * arm.half_width * np.array([-turn[1], turn[0]]) for end in ends]
            )
            for ends, turn in zip(((base, elbow), (elbow, tip)), turns, strict=True)
            for side in (-1.0, 1.0)
        ]
    )


def touch(arms: Any, points: Any, i: int, j: int, k: int) -> bool:
    """Whether two arms touch, line by line and circle by circle."""
    tolerance, lines, tips = planar_arms.tolerance_of(*arms), [], []
    for arm, outline, n in zip(arms, points, (i, j), strict=True):
        own = outline[k : k + 1, :, n : n + 1]
        if arm.half_width:
            lines.append([tuple(line) for line in boundaries(arm, own)[:, :, 0, 0]])
        else:
            lines.append([(*arm.base, *own[0, :2, 0]), tuple(own[0, :4, 0])])
        tips.append(own[0, 2:4, 0])
    near = [(*tips[0], *tips[0]), *tips[1], arms[0].tcp_radius + arms[1].tcp_radius]
    circles = [near, *((line, *tips[1], arms[1].tcp_radius) for line in lines[0])]
    circles += [(line, *tips[0], arms[0].tcp_radius) for line in lines[1]]
    return any(planar_arms.meeting(a, b, tolerance) for a in lines[0] for b in lines[1]) or any(
        radius > 0.0 and planar_arms.squared_distance(line, x, y) <= (radius + tolerance) ** 2
        for line, x, y, radius in circles
    )


@pytest.mark.parametrize("arms", [SCENE_A, UNEQUAL])
@pytest.mark.parametrize(
    ("num_1", "num_2"), first(3, [(1, 1), (8, 3), (55, 57), (56, 113), (100, 100)])
)
def test_counts_are_numpy_s(arms: Any, num_1: int, num_2: int) -> None:
    drawn = outlines(arms, np.random.default_rng(num_2), num_1, num_2, size=4)
    found = counts_of(arms, drawn)
    points = [outline[:, :4] for outline in drawn]  # random links are far from touching
    expected = plain.counts_of_populations(arms[0].base, points[0], arms[1].base, points[1])
    assert np.array_equal(found, expected)
    assert num_1 < 10 or 0 < found.mean() < 4


@pytest.mark.examples(1)
@pytest.mark.parametrize("arms", [SCENE_A, UNEQUAL])
@pytest.mark.parametrize(
    "sizes",
    [(0.02, 0.05, 0.02, 0.05), (0.03, 0.0, 0.0, 0.2), (0.0, 0.1, 0.05, 0.0), (0.2, 0.3, 0.1, 0.4)],
)
def test_counts_of_envelopes_are_numpy_s(arms: Any, sizes: Any) -> None:
    enveloped = planar_arms.Arm(*arms[0][:2], *sizes[:2]), planar_arms.Arm(*arms[1][:2], *sizes[2:])
    drawn, parts = outlines(enveloped, np.random.default_rng(3), 100, 61), []
    for arm, outline in zip(enveloped, drawn, strict=True):
        parts += [boundaries(arm, outline), outline[:, 2:4], arm.tcp_radius]
    found = counts_of(enveloped, drawn)
    assert np.array_equal(found, plain.envelope_counts(*parts))
    assert 0 < found.mean() < 3


def touching_points(kind: str, rng: np.random.Generator, size: int) -> tuple[Any, Any]:
    """Bases (2, 2) and points (2, 5, 4, size) of arms that often touch, align, have no length."""
    grid = rng.integers(-2, 3, (2, 5, 4, size)).astype(np.float64)
    if kind == "thirds":  # a grid whose points are rounded: nearly on one line
        return [(0.1, 0.1), (1.0 / 3.0 + 0.1, 0.1)], grid / 3.0 + 0.1
    if kind == "close":  # touching but for less than, and more than, single precision resolves
        off = rng.uniform(-1.0, 1.0, grid.shape) * 10.0 ** rng.uniform(-9.0, -5.0, grid.shape)
        return [(0.0, 0.0), (1.0 / 3.0, 0.0)], grid / 3.0 + off
    if kind == "far":  # rounded coarsely, far away from the origin
        return [(1e6, 1e6), (1e6 + 1.0 / 7.0, 1e6)], 1e6 + grid / 7.0
    if kind == "ulps":  # on one line but for the last places
        base, way = np.array([0.1, 0.3]), np.array([0.7, 0.2])
        t = rng.uniform(-1.0, 1.0, (2, 5, 2, 1, size))
        points = (base[:, None] + way[:, None] * t).reshape(2, 5, 4, size)
        return [tuple(base), tuple(base + way / 3.0)], points * (1.0 + grid * 2.0**-52)
    scale = {"grid": 1.0, "tiny": 1e-120, "huge": 1e60}[kind]
    return [(0.0, 0.0), (scale, 0.0)], grid * scale


def longest_arm(base: Any, points: Any) -> planar_arms.Arm:
    """Return an arm whose links are no shorter than those of any individual."""
    steps = points[:, :2] - np.array(base)[:, None], points[:, 2:] - points[:, :2]
    lengths = (float(np.hypot(*np.moveaxis(step, 1, 0)).max()) for step in steps)
    return planar_arms.Arm((float(base[0]), float(base[1])), tuple(lengths))


@pytest.mark.examples(3)
@pytest.mark.parametrize(
    "kind", ["grid", "thirds", "close", "far", "ulps", "tiny", "huge", "envelopes"]
)
def test_counts_are_those_of_single_pairs_where_links_touch(kind: str) -> None:
    """Sign products decide nothing that is close."""
    rng = np.random.default_rng(11)
    if kind == "envelopes":
        arms = [planar_arms.Arm((x, 0.0), (0.5, 0.5), 0.125, 0.25) for x in (0.0, 0.75)]
        angles = rng.integers(0, 5, (2, 3, 2, 80)) * (np.pi / 4.0)
        off = rng.uniform(-1.0, 1.0, angles.shape)
        angles += off * 10.0 ** rng.uniform(-9.0, -5.0, angles.shape)
        points = [arm.outlines(q) for arm, q in zip(arms, angles, strict=True)]
    else:
        bases, points = touching_points(kind, rng, 30)
        arms = [longest_arm(*each) for each in zip(bases, points, strict=True)]
    found = counts_of(arms, points)
    single = np.zeros(found.shape, dtype=int)
    for i, j, k in np.ndindex(*single.shape, len(points[0])):
        single[i, j] += touch(arms, points, i, j, k)
    assert np.array_equal(found, single)
    assert 0 < single.mean() < 5


COORDINATES = st.one_of(
    st.integers(-3, 3).map(float),
    st.floats(-1.0, 1.0).map(lambda x: x if abs(x) > 1e-80 else 0.0),
    st.just(1e-9),
)
POINTS = st.tuples(COORDINATES, COORDINATES)


def check_meeting(a: Any, b: Any, c: Any, d: Any) -> None:
    """Compare with rational arithmetic: what touches meets, what is apart does not."""
    tolerance = planar_arms.ROUNDING * max(abs(x) for x in (*a, *b, *c, *d))
    square = plain.exact_squared_distance(a, b, c, d)
    if square == 0 or square > 4 * plain.Fraction(tolerance) ** 2:
        assert planar_arms.meeting((*a, *b), (*c, *d), tolerance) == (square == 0)


@given(
    POINTS, POINTS, POINTS, POINTS, st.sampled_from([0.0, 0.5, 1.0 / 3.0, 1.7]), st.integers(-2, 2)
)
@settings(max_examples=400)
def test_segments_meet_as_in_rational_arithmetic(
    a: Any, b: Any, c: Any, d: Any, t: float, places: int
) -> None:
    check_meeting(a, b, c, d)
    # almost on one line
    near = (a[0] + t * (b[0] - a[0])) * (1.0 + places * 2.0**-52), a[1] + t * (b[1] - a[1])
    check_meeting(a, b, near, c)
    check_meeting(a, b, near, (near[0] + (b[0] - a[0]), near[1] + (b[1] - a[1])))


@pytest.mark.parametrize("arms", [SCENE_A, UNEQUAL, (SCENE_A[1], SCENE_A[0])])
def test_the_closed_form_decides_the_same(arms: Any) -> None:
    rng, size = np.random.default_rng(2), 350_000
    q_1, q_2 = rng.uniform(0.0, np.pi, (2, 2, size))
    q_2[:, : size // 10] = q_1[:, : size // 10]  # parallel links
    q_2[:, size // 10 : size // 5] = q_1[::-1, size // 10 : size // 5]
    found = planar_arms.closed_form(arms[0], q_1, arms[1], q_2)
    one, two = (
        [np.array(arm.base)[:, None], *arm.outlines(q[None])[0, :4].reshape(2, 2, -1)]
        for arm, q in zip(arms, (q_1, q_2), strict=True)
    )
    for pair, (m, n) in enumerate(np.ndindex(2, 2)):
        expected = plain.crossing(one[m], one[m + 1], two[n], two[n + 1])
        met = np.isfinite(found.mu[pair])
        first_point = one[m] + found.mu[pair] * (one[m + 1] - one[m])
        second_point = two[n] + found.nu[pair] * (two[n + 1] - two[n])
        near = met & (np.abs(found.mu[pair]) + np.abs(found.nu[pair]) < 1e3)
        assert np.allclose(first_point[:, near], second_point[:, near], rtol=0.0, atol=1e-9)
        assert np.array_equal(found.crossing[pair, met], expected[met])
        assert not found.crossing[pair, ~met].any()  # parallel, and not on one line


def test_many_configurations_and_no_individuals() -> None:
    one = SCENE_A[0]
    everywhere = one.outlines(np.zeros((300, 2, 3)))
    assert (counts_of((one, one), [everywhere, everywhere]) == 300).all()
    assert counts_of(SCENE_A, [np.empty((300, 4, 0)), everywhere]).shape == (0, 3)
    assert not counts_of(SCENE_A, [np.empty((0, 4, 2)), np.empty((0, 4, 3))]).any()


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_numbers_that_are_not_finite_are_refused(value: float) -> None:
    one, two = (arm._replace(half_width=0.02, tcp_radius=0.05) for arm in SCENE_A)
    drawn = outlines((one, two), np.random.default_rng(0), 5, 6)
    wrong = drawn[1].copy()
    wrong[2, 1, 3] = value
    arms = [two, two._replace(tcp_radius=value), two._replace(base=(value, 0.0))]
    for arm, outline in zip(arms, (wrong, drawn[1], drawn[1]), strict=True):
        with pytest.raises(ValueError, match="two and its outlines must be finite and below 1e70"):
            counts_of((one, arm), [drawn[0], outline])
        with pytest.raises(ValueError, match="one and its outlines must be finite and below 1e70"):
            counts_of((arm, one), [outline, drawn[0]])


def test_shapes_that_do_not_fit_are_refused() -> None:
    one, two = SCENE_A
    with pytest.raises(ValueError, match=r"q must have shape \(configurations, 2, individuals\)"):
        one.outlines(np.zeros((3, 4)))
    with pytest.raises(ValueError, match="at most 32767 configurations, were 32768"):
        counts_of(SCENE_A, [np.zeros((32768, 4, 1))] * 2)
    with pytest.raises(ValueError, match=r"both have shape \(2, n\), were \(2, 3\) and \(2, 4\)"):
        planar_arms.closed_form(one, np.zeros((2, 3)), two, np.zeros((2, 4)))


@pytest.mark.parametrize("scale", [2.0**-300, 1e-3, 1.0, 7e5, 2.0**200])
@pytest.mark.parametrize("turn", range(8))
@pytest.mark.parametrize("offset", [0.0, 0.3, 1e6])
def test_blocks_that_an_axis_seems_to_separate(scale: float, turn: int, offset: float) -> None:
    """Arm 1 ends on a link of arm 2 that stands across; then a little before it."""
    along = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)][turn])
    across, base = np.array([-along[1], along[0]]), np.full(2, offset * scale)

    def arm(start: Any) -> planar_arms.Arm:
        return planar_arms.Arm((float(start[0]), float(start[1])), (0.4 * scale, 0.4 * scale))

    def equal(*points: Any) -> np.ndarray:  # a block of eight individuals, and one more
        return np.repeat(np.concatenate(points)[np.newaxis, :, np.newaxis], 9, axis=2)

    tip, one = base + 0.5 * scale * along, arm(base)
    for gap in (0.0, 4.0):
        centre = tip + gap * planar_arms.tolerance_of(one, one) * along
        below, above = centre - 0.25 * scale * across, centre + 0.25 * scale * across
        drawn = [equal(base + 0.25 * scale * along, tip), equal(centre, above)]
        expected = np.full((9, 9), not gap)
        assert np.array_equal(counts_of((one, arm(below)), drawn), expected)
        assert np.array_equal(counts_of((arm(below), one), drawn[::-1]), expected)


ARM = planar_arms.Arm((0.1, -0.05), (0.3, 0.2))
OBSTACLES: dict[str, Any] = {
    "disc": sphere((0.3, 0.2), 0.08),
    "box": box((0.2, 0.3), (0.2, 0.05), (0.0, 0.0, 35.0)),
    "tall box": box((-0.1, 0.1, 0.5), (0.1, 0.1, 1.5)),
    "capsule": capsule((-0.2, 0.3), (0.0, 0.45), 0.04),
    "wall": half_space((0.4, 0.0), (-1.0, 0.2)),
}


def bound(arm: planar_arms.Arm, *obstacles: Any) -> LinkCollision:
    """Return the collision model of one arm among obstacles."""
    robot = PlanarChain(link_lengths=arm.lengths, base_position=arm.base)
    model = LinkCrossings(
        collision_substeps=1, half_width=arm.half_width, tcp_radius=arm.tcp_radius
    )
    return model.bind(robot.build(), obstacles)


def rod(ends: Any) -> Any:
    """Return a segment of the plane as a coal capsule of radius 0."""
    return placed(*arms_6r.capsule(np.array([*ends[:2], 0.0]), np.array([*ends[2:], 0.0]), 0.0))


@pytest.mark.parametrize("arm", [ARM, ARM._replace(half_width=0.03, tcp_radius=0.07)])
@pytest.mark.parametrize("names", [*([name] for name in OBSTACLES), list(OBSTACLES)], ids=" ".join)
def test_counts_are_coal_s(names: Any, arm: planar_arms.Arm) -> None:
    obstacles = [OBSTACLES[name] for name in names]
    solids = [placed(*arms_6r.coal_obstacle(each)) for each in obstacles]
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (4, 2, 60))
    outline = arm.outlines(q)
    lines, least = boundaries(arm, outline), np.empty((4, 60))
    for k, n in np.ndindex(4, 60):
        points = outline[k, :4, n]
        parts = [rod([*arm.base, *points[:2]]), rod(points)]
        if arm.tcp_radius:
            parts = [rod(line[:, k, n]) for line in lines]
            parts.append(placed(coal.Sphere(arm.tcp_radius), [*points[2:], 0.0]))
        least[k, n] = min(distance(one, solid) for one in parts for solid in solids)
    found = bound(arm, *obstacles).with_obstacles(0, q)
    # a rod has no inside: where it crosses, coal may say 0
    assert not ((least > 0.0) & (least < 1e-7)).any()
    assert np.array_equal(found, (least <= 0.0).sum(axis=0))
    assert 0 < found.sum() < least.size


@pytest.mark.parametrize(
    ("obstacles", "expected"),
    [
        ([sphere((0.0, 0.0), 3.0)], 4),
        ([box((0.0, 0.0), (5.0, 5.0), (0.0, 0.0, 20.0))], 4),
        ([capsule((0.0, -1.0), (0.0, 1.0), 3.0)], 4),
        ([], 0),
    ],
)
def test_a_link_inside_collides_and_nothing_collides_with_nothing(
    obstacles: Any, expected: int
) -> None:
    q = np.random.default_rng(1).uniform(0.0, np.pi, (4, 2, 9))
    assert (bound(ARM, *obstacles).with_obstacles(0, q) == expected).all()


def test_an_ellipse_is_refused() -> None:
    with pytest.raises(SettingError, match=r"scenario.obstacles\[1\].shape: must be any but"):
        bound(ARM, OBSTACLES["disc"], ellipse((0.0, 0.0), (1.0, 2.0)))
