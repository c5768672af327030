"""Crossing links against rational arithmetic, numpy, the paper's closed form.

And themselves seen in a mirror.
"""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.collision.planar.arm_pairs import Crossings, count_collisions
from evoexp.collision.planar.closed_form import closed_form
from evoexp.collision.planar.planar_arms import Arm, colliding, path_configurations, tolerance_of
from evoexp.collision.planar.segment_predicates import ROUNDING, meeting
from matrix import first
from references import link_crossings_numpy as plain

SCENE_A = Arm((0.0, 0.0), (0.25, 0.25)), Arm((0.3, 0.0), (0.25, 0.25))
UNEQUAL = Arm((-0.2, 0.1), (0.4, 0.1)), Arm((0.3, -0.05), (0.15, 0.35))


def populations(
    rng: np.random.Generator, arms: Any, num_1: int, num_2: int, size: int = 4
) -> tuple[Any, Any]:
    return tuple(
        arm.outlines(rng.uniform(0.0, np.pi, (size, 2, n)))[:, :4]
        for arm, n in zip(arms, (num_1, num_2), strict=True)
    )


def check_sums(found: Crossings) -> None:
    assert np.array_equal(found.sums_1, found.counts.sum(axis=1))
    assert np.array_equal(found.sums_2, found.counts.sum(axis=0))


def test_points_are_the_links_ends() -> None:
    q = np.random.default_rng(0).uniform(-7.0, 7.0, (3, 2, 5))
    one = UNEQUAL[0]
    ends = one.outlines(q)[:, :4].reshape(3, 2, 2, 5)  # (K, elbow and tip, x and y, N)
    steps = np.stack([np.cos(q), np.sin(q)], axis=2) * np.array(one.lengths)[:, None, None]
    assert np.allclose(ends[:, 0], np.array(one.base)[:, None] + steps[:, 0], rtol=0.0, atol=1e-15)
    assert np.allclose(ends[:, 1], ends[:, 0] + steps[:, 1], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("arms", [SCENE_A, UNEQUAL])
@pytest.mark.parametrize(
    ("num_1", "num_2"), first(3, [(1, 1), (8, 3), (55, 57), (56, 113), (100, 100)])
)
def test_counts_are_numpy_s(arms: Any, num_1: int, num_2: int) -> None:
    points_1, points_2 = populations(np.random.default_rng(num_2), arms, num_1, num_2)
    found = count_collisions(arms[0], points_1, arms[1], points_2)
    assert np.array_equal(
        found.counts, plain.counts_of_populations(arms[0].base, points_1, arms[1].base, points_2)
    )  # random links are far from touching
    assert found.counts.shape == (num_1, num_2)
    assert num_1 < 10 or 0 < found.counts.mean() < 4
    check_sums(found)


def test_all_four_pairs_of_links_count() -> None:
    """The top links alone miss most of the collisions."""
    rng = np.random.default_rng(3)
    q_1, q_2 = rng.uniform(0.0, np.pi, (2, 2, 20000))
    found = closed_form(SCENE_A[0], q_1, SCENE_A[1], q_2)
    assert 0.3 < found.crossing[3].sum() / found.crossing.any(axis=0).sum() < 0.45
    assert found.crossing.any(axis=1).all()


def random_points(kind: str, rng: np.random.Generator, size: int) -> tuple[Any, Any, Any, Any]:
    """Bases and points (5, 4, size) of arms, many of which touch, are parallel, on one line.

    Or of length 0.
    """
    if kind == "grid":
        points = rng.integers(-2, 3, (2, 5, 4, size)).astype(np.float64)
        return (0.0, 0.0), points[0], (1.0, 0.0), points[1]
    if kind == "thirds":  # a grid whose points are rounded: nearly on one line
        points = rng.integers(-2, 3, (2, 5, 4, size)) / 3.0 + 0.1
        return (0.1, 0.1), points[0], (1.0 / 3.0 + 0.1, 0.1), points[1]
    if kind == "close":  # touching but for less than, and more than, single precision resolves
        points = rng.integers(-2, 3, (2, 5, 4, size)) / 3.0
        points += rng.uniform(-1.0, 1.0, points.shape) * 10.0 ** rng.uniform(
            -9.0, -5.0, points.shape
        )
        return (0.0, 0.0), points[0], (1.0 / 3.0, 0.0), points[1]
    if kind == "far":  # rounded coarsely, far away from the origin
        points = 1e6 + rng.integers(-2, 3, (2, 5, 4, size)) / 7.0
        return (1e6, 1e6), points[0], (1e6 + 1.0 / 7.0, 1e6), points[1]
    if kind == "ulps":  # on one line but for the last places
        base = np.array([0.1, 0.3])
        t = rng.uniform(-1.0, 1.0, (2, 5, 2, 1, size))
        points = (
            (base + np.array([0.7, 0.2]) * np.moveaxis(t, 3, 4))
            .transpose(0, 1, 2, 4, 3)
            .reshape(2, 5, 4, size)
        )
        points = points * (1.0 + rng.integers(-2, 3, points.shape) * 2.0**-52)
        return tuple(base), points[0], tuple(base + np.array([0.7, 0.2]) / 3.0), points[1]
    scale = {"tiny": 1e-120, "huge": 1e60}[kind]
    points = rng.integers(-2, 3, (2, 5, 4, size)) * scale
    return (0.0, 0.0), points[0], (scale, 0.0), points[1]


def longest_arm(base: Any, points: Any) -> Arm:
    """Return an arm whose links are no shorter than those of any individual."""
    steps = points[:, :2] - np.array(base)[:, None], points[:, 2:] - points[:, :2]
    first, second = (float(np.hypot(*np.moveaxis(step, 1, 0)).max()) for step in steps)
    return Arm((float(base[0]), float(base[1])), (first, second))


@pytest.mark.examples(2)
@pytest.mark.parametrize("kind", ["grid", "thirds", "close", "far", "ulps", "tiny", "huge"])
def test_counts_are_those_of_single_pairs_where_links_touch(kind: str) -> None:
    base_1, points_1, base_2, points_2 = random_points(kind, np.random.default_rng(11), 30)
    one, two = longest_arm(base_1, points_1), longest_arm(base_2, points_2)
    found = count_collisions(one, points_1, two, points_2)
    tolerance = tolerance_of(one, two)
    single = np.zeros(found.counts.shape, dtype=int)
    for i, j, k in np.ndindex(*single.shape, len(points_1)):
        single[i, j] += colliding(one, points_1, i, two, points_2, j, k, tolerance)
    assert np.array_equal(found.counts, single)
    assert 0 < single.mean() < 5
    check_sums(found)


coordinate = st.one_of(
    st.integers(-3, 3).map(float),
    st.floats(-1.0, 1.0).map(lambda x: x if abs(x) > 1e-80 else 0.0),
    st.just(1e-9),
)
point = st.tuples(coordinate, coordinate)


def check_meeting(a: Any, b: Any, c: Any, d: Any) -> None:
    """Compare with rational arithmetic: what touches meets, what is apart does not."""
    tolerance = ROUNDING * max(abs(x) for x in (*a, *b, *c, *d))
    square = plain.exact_squared_distance(a, b, c, d)
    if square == 0 or square > 4 * plain.Fraction(tolerance) ** 2:
        assert meeting(*a, *b, *c, *d, tolerance) == (square == 0)


@given(st.lists(point, min_size=4, max_size=4))
@settings(max_examples=400)
def test_segments_meet_as_in_rational_arithmetic(points: Any) -> None:
    check_meeting(*points)


@given(point, point, point, st.integers(0, 3), st.integers(-2, 2))
@settings(max_examples=300)
def test_segments_almost_on_a_line_meet_as_in_rational_arithmetic(
    a: Any, b: Any, c: Any, what: int, places: int
) -> None:
    t = (0.0, 0.5, 1.0 / 3.0, 1.7)[what]
    near = (
        (a[0] + t * (b[0] - a[0])) * (1.0 + places * 2.0**-52),
        a[1] + t * (b[1] - a[1]),
    )
    beyond = (near[0] + (b[0] - a[0]), near[1] + (b[1] - a[1]))
    for other in (c, beyond):
        check_meeting(a, b, near, other)


@pytest.mark.parametrize("kind", ["random", "grid", "thirds"])
def test_mirror_and_exchange_change_nothing(kind: str) -> None:
    rng = np.random.default_rng(8)
    one, two = SCENE_A
    if kind == "random":
        points_1, points_2 = populations(rng, SCENE_A, 70, 61)
    else:
        base_1, points_1, base_2, points_2 = random_points(kind, rng, 64)
        one, two = longest_arm(base_1, points_1), longest_arm(base_2, points_2)
    found = count_collisions(one, points_1, two, points_2)
    flip = np.array([-1.0, 1.0, -1.0, 1.0])[:, None]
    left, right = (arm._replace(base=(-arm.base[0], arm.base[1])) for arm in (one, two))
    exchanged = count_collisions(right, points_2 * flip, left, points_1 * flip)
    assert np.array_equal(exchanged.counts.T, found.counts)
    assert np.array_equal(exchanged.sums_1, found.sums_2)
    assert np.array_equal(exchanged.sums_2, found.sums_1)


@pytest.mark.parametrize("arms", [SCENE_A, UNEQUAL, (SCENE_A[1], SCENE_A[0])])
def test_the_closed_form_decides_the_same(arms: Any) -> None:
    rng, size = np.random.default_rng(2), 350_000
    q_1, q_2 = rng.uniform(0.0, np.pi, (2, 2, size))
    q_2[:, : size // 10] = q_1[:, : size // 10]  # parallel links
    q_2[:, size // 10 : size // 5] = q_1[::-1, size // 10 : size // 5]
    found = closed_form(arms[0], q_1, arms[1], q_2)
    points_1, points_2 = arms[0].outlines(q_1[None]), arms[1].outlines(q_2[None])
    one = [np.array(arms[0].base)[:, None], points_1[0, :2], points_1[0, 2:4]]
    two = [np.array(arms[1].base)[:, None], points_2[0, :2], points_2[0, 2:4]]
    for pair, (m, n) in enumerate(np.ndindex(2, 2)):
        expected = plain.crossing(one[m], one[m + 1], two[n], two[n + 1])
        met = np.isfinite(found.mu[pair])
        meeting = one[m] + found.mu[pair] * (one[m + 1] - one[m])
        other = two[n] + found.nu[pair] * (two[n + 1] - two[n])
        near = np.abs(found.mu[pair]) + np.abs(found.nu[pair]) < 1e3
        assert np.allclose(meeting[:, met & near], other[:, met & near], rtol=0.0, atol=1e-9)
        assert np.array_equal(found.crossing[pair, met], expected[met])
        assert not found.crossing[pair, ~met].any()  # parallel, and not on one line


def test_the_closed_form_is_equation_12() -> None:
    """The paper's formula, symbol by symbol: top links, equal lengths, xi = d / L."""
    rng = np.random.default_rng(4)
    f1, f2, f3, f4 = rng.uniform(0.0, np.pi, (4, 1000))
    xi = 0.3 / 0.25
    mu = (np.sin(f3 - f4) - np.sin(f1 - f4) - xi * np.sin(f4)) / np.sin(f2 - f4)
    nu = (np.sin(f2 - f1) + np.sin(f3 - f2) - xi * np.sin(f2)) / np.sin(f2 - f4)
    found = closed_form(SCENE_A[0], np.array([f1, f2]), SCENE_A[1], np.array([f3, f4]))
    assert np.allclose(found.mu[3], mu, rtol=1e-9, atol=1e-9)
    assert np.allclose(found.nu[3], nu, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("base", "length", "angle", "expected"),
    [
        ((0.5, 0.0), 1.0, 0.0, True),  # overlapping
        ((0.5, 0.0), 1.0, np.pi, True),
        ((0.25, 0.0), 0.5, 0.0, True),  # one within the other
        ((1.0, 0.0), 1.0, 0.0, True),  # end to end
        ((2.0, 0.0), 1.0, np.pi, True),
        ((-1.0, 0.0), 1.0, 0.0, True),
        ((3.0, 0.0), 1.0, 0.0, False),  # on one line, apart
        ((-0.5, 0.0), 1.0, np.pi, False),
        ((0.5, 0.1), 1.0, 0.0, False),  # side by side
        ((0.5, 1e-9), 1.0, np.pi, False),
        ((0.5, 0.0), 0.0, 0.7, True),  # a point on the link
        ((0.5, 0.1), 0.0, 0.7, False),
        ((1.1, 0.0), 0.0, 0.7, False),
    ],
)
def test_the_closed_form_has_a_branch_for_parallel_links(
    base: Any, length: float, angle: float, expected: bool
) -> None:
    one, two = Arm((0.0, 0.0), (1.0, 1.0)), Arm(base, (length, 1.0))
    q_1, q_2 = np.array([[0.0], [1.0]]), np.array([[angle], [2.0]])
    for found in (closed_form(one, q_1, two, q_2), closed_form(two, q_2, one, q_1)):
        assert np.isnan(found.mu[0, 0])
        assert np.isnan(found.nu[0, 0])
        assert found.crossing[0, 0] == expected


def test_two_points_meet_where_they_are_one() -> None:
    one, apart = Arm((0.0, 0.0), (0.0, 0.0)), Arm((0.1, 0.0), (0.0, 0.0))
    q = np.array([[0.3], [1.0]])
    assert closed_form(one, q, one, q).crossing.all()
    assert not closed_form(one, q, apart, q).crossing.any()


def test_one_substep_tests_the_genes_alone() -> None:
    genes = np.random.default_rng(0).uniform(0.0, np.pi, (4, 2, 10))
    assert np.array_equal(path_configurations(genes, np.zeros(2), np.ones(2), 1), genes)


@pytest.mark.parametrize("steps", [2, 5])
@pytest.mark.parametrize("size", [0, 1, 4])
def test_substeps_divide_every_segment(steps: int, size: int) -> None:
    genes = np.random.default_rng(0).uniform(0.0, np.pi, (size, 2, 10))
    start, goal = np.array([2.0, 1.0]), np.array([0.5, -0.5])
    tested = path_configurations(genes, start, goal, steps)
    ends = np.concatenate(
        [
            np.broadcast_to(start[:, None], (1, 2, 10)),
            genes,
            np.broadcast_to(goal[:, None], (1, 2, 10)),
        ]
    )
    t = np.arange(1, (size + 1) * steps) / steps
    expected = [
        np.array([np.interp(t, np.arange(size + 2), ends[:, j, n]) for n in range(10)])
        for j in (0, 1)
    ]
    assert tested.shape == ((size + 1) * steps - 1, 2, 10)
    assert np.allclose(tested, np.array(expected).transpose(2, 0, 1), rtol=0.0, atol=1e-14)
    assert np.array_equal(tested[steps - 1 :: steps], genes)


def test_many_configurations_and_all_colliding() -> None:
    q = np.zeros((300, 2, 3))
    found = count_collisions(SCENE_A[0], SCENE_A[0].outlines(q), SCENE_A[1], SCENE_A[1].outlines(q))
    assert (found.counts == 300).all()
    assert (found.sums_1 == 900).all()


def test_empty_populations() -> None:
    found = count_collisions(
        SCENE_A[0], np.empty((4, 4, 0)), SCENE_A[1], SCENE_A[1].outlines(np.zeros((4, 2, 3)))
    )
    assert found.counts.shape == (0, 3)
    assert np.array_equal(found.sums_2, np.zeros(3))
    none = count_collisions(SCENE_A[0], np.empty((0, 4, 2)), SCENE_A[1], np.empty((0, 4, 3)))
    assert not none.counts.any()


def test_what_does_not_fit_is_refused() -> None:
    one, two = SCENE_A
    points_1, points_2 = populations(np.random.default_rng(0), SCENE_A, 5, 6)
    with pytest.raises(
        ValueError, match=r"q must have shape \(configurations, 2, individuals\), was \(3, 4\)"
    ):
        one.outlines(np.zeros((3, 4)))
    with pytest.raises(ValueError, match="at most 32767 configurations, were 32768"):
        count_collisions(one, np.zeros((32768, 4, 1)), two, np.zeros((32768, 4, 1)))
    for value in (np.nan, np.inf, 1e200):
        wrong = points_2.copy()
        wrong[2, 1, 3] = value
        with pytest.raises(ValueError, match="finite and below 1e70"):
            count_collisions(one, points_1, two, wrong)
    with pytest.raises(ValueError, match="finite"):
        count_collisions(Arm((np.nan, 0.0), (1.0, 1.0)), points_1, two, points_2)
    with pytest.raises(ValueError, match=r"both have shape \(2, n\), were \(2, 3\) and \(2, 4\)"):
        closed_form(one, np.zeros((2, 3)), two, np.zeros((2, 4)))
