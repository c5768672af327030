"""Arms with envelopes: against numpy on all their lines and circles.

And against the plain arms inside.
"""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.collision.planar.arm_pairs import count_collisions
from evoexp.collision.planar.planar_arms import Arm, boundary, colliding, tolerance_of
from references import link_crossings_numpy as plain

SCENE_A = Arm((0.0, 0.0), (0.25, 0.25)), Arm((0.3, 0.0), (0.25, 0.25))
UNEQUAL = Arm((-0.2, 0.1), (0.4, 0.1)), Arm((0.3, -0.05), (0.15, 0.35))


def outlines(arms: Any, rng: np.random.Generator, num_1: int, num_2: int, size: int = 3) -> Any:
    return [
        arm.outlines(rng.uniform(0.0, np.pi, (size, 2, n)))
        for arm, n in zip(arms, (num_1, num_2), strict=True)
    ]


def expected(arms: Any, drawn: Any) -> np.ndarray:
    parts: list[Any] = []
    for arm, outline in zip(arms, drawn, strict=True):
        parts += [boundaries(arm, outline), outline[:, 2:4], arm.tcp_radius]
    return plain.envelope_counts(*parts)


def boundaries(arm: Arm, outlines: np.ndarray) -> np.ndarray:
    """Return the four boundary lines of all outlines, (4, 4, K, N)."""
    wide = arm._replace(half_width=max(arm.half_width, 1e-300))
    lines = np.empty((4, 4, outlines.shape[0], outlines.shape[2]))
    for line, k, n in np.ndindex(4, outlines.shape[0], outlines.shape[2]):
        lines[line, :, k, n] = boundary(wide, outlines, k, n, line)
    return lines


def test_boundaries_are_parallel_to_the_links() -> None:
    arm = Arm(*UNEQUAL[1][:2], 0.04, 0.1)
    q = np.random.default_rng(0).uniform(0.0, np.pi, (3, 2, 5))
    drawn = arm.outlines(q)
    points, lines = drawn[:, :4], boundaries(arm, drawn)
    middle = 0.5 * (lines[0::2] + lines[1::2])  # of right and left
    assert np.allclose(middle[0, 2:], points[:, :2].swapaxes(0, 1), rtol=0.0, atol=1e-15)
    assert np.allclose(middle[1], points.swapaxes(0, 1), rtol=0.0, atol=1e-15)
    for right, left in zip(lines[0::2], lines[1::2], strict=True):
        across = left[:2] - right[:2]
        along = right[2:] - right[:2]
        assert np.allclose(np.sqrt((across**2).sum(axis=0)), 0.08, rtol=0.0, atol=1e-15)
        assert np.allclose((across * along).sum(axis=0), 0.0, rtol=0.0, atol=1e-15)
        assert (plain.cross(along, across) > 0.0).all()


@pytest.mark.examples(1)
@pytest.mark.parametrize("arms", [SCENE_A, UNEQUAL])
@pytest.mark.parametrize(
    "sizes",
    [(0.02, 0.05, 0.02, 0.05), (0.03, 0.0, 0.0, 0.2), (0.0, 0.1, 0.05, 0.0), (0.2, 0.3, 0.1, 0.4)],
)
def test_counts_are_numpy_s(arms: Any, sizes: Any) -> None:
    enveloped = Arm(*arms[0][:2], *sizes[:2]), Arm(*arms[1][:2], *sizes[2:])
    drawn = outlines(enveloped, np.random.default_rng(3), 100, 61)
    found = count_collisions(enveloped[0], drawn[0], enveloped[1], drawn[1])
    assert np.array_equal(found.counts, expected(enveloped, drawn))
    assert 0 < found.counts.mean() < 3
    assert np.array_equal(found.sums_1, found.counts.sum(axis=1))
    assert np.array_equal(found.sums_2, found.counts.sum(axis=0))


def test_single_precision_decides_nothing_that_is_close() -> None:
    """Almost touching lines and circles: the same counts as by the careful test alone."""
    rng = np.random.default_rng(12)
    arms = (
        Arm((0.0, 0.0), (0.5, 0.5), 0.125, 0.25),
        Arm((0.75, 0.0), (0.5, 0.5), 0.125, 0.25),
    )
    angles = [rng.integers(0, 5, (3, 2, 80)) * (np.pi / 4.0) for _ in arms]
    drawn = [
        arm.outlines(q + rng.uniform(-1.0, 1.0, q.shape) * 10.0 ** rng.uniform(-9.0, -5.0, q.shape))
        for arm, q in zip(arms, angles, strict=True)
    ]
    near = tolerance_of(*arms)
    counts = np.zeros((80, 80), dtype=np.int64)
    for k, i, j in np.ndindex(3, 80, 80):
        counts[i, j] += colliding(arms[0], drawn[0], i, arms[1], drawn[1], j, k, near)
    assert np.array_equal(count_collisions(arms[0], drawn[0], arms[1], drawn[1]).counts, counts)


def test_touching_boundary_lines_are_exact() -> None:
    """Multiples of 90 degrees: boundary lines on one line, end to end, crossing at their ends."""
    exact = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])  # directions that are exact
    which = np.array(np.meshgrid([0, 1, 2], [0, 1, 2])).reshape(2, -1)
    drawn = []
    arms = [
        Arm((0.0, 0.0), (0.5, 0.5), 0.125, 0.0),
        Arm((0.75, 0.0), (0.5, 0.5), 0.125, 0.0),
    ]
    for enveloped in arms:
        first, second = exact[which[0]].T, exact[which[1]].T
        elbow = np.array(enveloped.base)[:, None] + 0.5 * first
        drawn.append(np.concatenate([elbow, elbow + 0.5 * second, first, second])[None])
    found = count_collisions(arms[0], drawn[0], arms[1], drawn[1])
    assert np.array_equal(found.counts, exact_line_counts(arms, drawn))
    assert 0 < found.counts.mean() < 1


def exact_line_counts(arms: Any, drawn: Any) -> np.ndarray:
    one, two = (
        boundaries(arm, outline)[:, :, 0] for arm, outline in zip(arms, drawn, strict=True)
    )  # (4, 4, N)
    counts = np.zeros((one.shape[2], two.shape[2]), dtype=np.int64)
    for i, j in np.ndindex(counts.shape):
        counts[i, j] = any(
            plain.exact_squared_distance(a[:2], a[2:], b[:2], b[2:]) == 0
            for a in one[:, :, i].tolist()
            for b in two[:, :, j].tolist()
        )
    return counts


@given(
    st.floats(0.0, 0.2),
    st.floats(0.0, 0.4),
    st.floats(0.0, 0.2),
    st.floats(0.0, 0.4),
    st.integers(0, 1000),
)
@settings(max_examples=40)
def test_exchanged_arms_collide_as_often(
    half_1: float, radius_1: float, half_2: float, radius_2: float, seed: int
) -> None:
    arms = Arm(*UNEQUAL[0][:2], half_1, radius_1), Arm(*UNEQUAL[1][:2], half_2, radius_2)
    drawn = outlines(arms, np.random.default_rng(seed), 20, 13)
    found = count_collisions(arms[0], drawn[0], arms[1], drawn[1])
    assert np.array_equal(
        count_collisions(arms[1], drawn[1], arms[0], drawn[0]).counts.T, found.counts
    )


@given(st.integers(0, 1000), st.floats(0.0, 0.1))
@settings(max_examples=25)
def test_a_larger_circle_never_collides_less(seed: int, more: float) -> None:
    small = Arm(*SCENE_A[0][:2], 0.02, 0.05), Arm(*SCENE_A[1][:2], 0.02, 0.05)
    large = Arm(*SCENE_A[0][:2], 0.02, 0.05 + more), small[1]
    drawn = outlines(small, np.random.default_rng(seed), 20, 20)
    before = count_collisions(small[0], drawn[0], small[1], drawn[1]).counts
    assert (count_collisions(large[0], drawn[0], large[1], drawn[1]).counts >= before).all()


def test_links_without_length_leave_the_circles() -> None:
    arms = (
        Arm((0.0, 0.0), (0.0, 0.0), 0.0, 0.25),
        Arm((0.5, 0.0), (0.0, 0.0), 0.0, 0.25),
    )
    drawn = [arm.outlines(np.zeros((1, 2, 1))) for arm in arms]
    assert count_collisions(arms[0], drawn[0], arms[1], drawn[1]).counts[0, 0] == 1  # circles touch
    narrower = arms[1]._replace(tcp_radius=0.2499999)
    assert count_collisions(arms[0], drawn[0], narrower, drawn[1]).counts[0, 0] == 0


def test_what_does_not_fit_is_refused() -> None:
    arms = Arm(*SCENE_A[0][:2], 0.02, 0.05), Arm(*SCENE_A[1][:2], 0.02, 0.05)
    drawn = outlines(arms, np.random.default_rng(0), 3, 4)
    with pytest.raises(ValueError, match="two and its outlines must be finite"):
        count_collisions(arms[0], drawn[0], arms[1]._replace(tcp_radius=np.nan), drawn[1])
    with pytest.raises(ValueError, match="two and its outlines must be finite"):
        count_collisions(arms[0], drawn[0], arms[1]._replace(tcp_radius=np.inf), drawn[1])
    with pytest.raises(ValueError, match="one and its outlines must be finite"):
        count_collisions(arms[0], drawn[0] + np.nan, arms[1], drawn[1])
