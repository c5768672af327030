"""Two populations of planar arms of two links, every individual against every other.

Beside numpy and coal.

100 × 100 pairs in 4 configurations of 4 pairs of links each: 160 000 link tests, fresh and of
populations that have gathered around one collision-free pair. The paper's closed form is timed,
too: on angles, but once per pair.
"""

from collections.abc import Callable
from typing import Any

import coal
import numpy as np
import pytest

from evoexp.collision.models.link_crossings import (
    Arm,
    closed_form,
    count_crossings,
    update_crossings,
)
from evoexp.collision.models.link_envelopes import EnvelopedArm, count_collisions
from references import link_crossings_numpy as plain

INDIVIDUALS, CONFIGURATIONS = 100, 4
LINK_TESTS = INDIVIDUALS * INDIVIDUALS * CONFIGURATIONS * 4
ONE, TWO = Arm((0.0, 0.0), (0.25, 0.25)), Arm((0.3, 0.0), (0.25, 0.25))
HALF_WIDTH, TCP_RADIUS = 0.02, 0.05
HANDFUL = 5  # individuals of each population that coal is given


def populations(when: str) -> list[Any]:
    """Return the angles of both populations, (K, 2, N) [rad]."""
    rng = np.random.default_rng(0)
    q = [rng.uniform(0.0, np.pi, (CONFIGURATIONS, 2, INDIVIDUALS)) for _ in (ONE, TWO)]
    if when == "finished":  # around a pair of motions, one allele of some individuals mutated
        for k, (start, goal) in enumerate([((2.6, 1.0), (1.5, 1.0)), ((1.0, 2.0), (0.5, 1.2))]):
            t = np.linspace(0.2, 0.8, CONFIGURATIONS)[:, None]
            best = np.array(start) + t * (np.array(goal) - np.array(start))
            q[k] = np.where(
                rng.random(q[k].shape) < 0.05,
                q[k],
                best[:, :, None] + rng.normal(0.0, 0.05, q[k].shape),
            )
    return q


def coal_counts(points_1: Any, points_2: Any) -> Callable[[], Any]:
    """Return a function that counts by capsules of (nearly) no radius, pair by pair."""
    bodies = []
    for arm, points in ((ONE, points_1), (TWO, points_2)):
        bodies.append(
            [
                [placed_links(arm, points[k, :, n]) for n in range(HANDFUL)]
                for k in range(CONFIGURATIONS)
            ]
        )
    request, result = coal.CollisionRequest(), coal.CollisionResult()

    def meet(one: Any, two: Any) -> bool:
        result.clear()
        return bool(coal.collide(one, two, request, result))

    def count() -> Any:
        counts = np.zeros((HANDFUL, HANDFUL), dtype=np.int64)
        for left, right in zip(*bodies, strict=True):
            for i, j in np.ndindex(counts.shape):
                counts[i, j] += any(meet(one, two) for one in left[i] for two in right[j])
        return counts

    return count


def placed_links(arm: Arm, point: Any) -> list[Any]:
    ends = np.array([*arm.base, *point]).reshape(3, 2)
    links = []
    for a, b in zip(ends[:-1], ends[1:], strict=True):
        axis = np.array([*(b - a), 0.0]) / np.sqrt(((b - a) ** 2).sum())
        turn = np.column_stack([[-axis[1], axis[0], 0.0], [0.0, 0.0, 1.0], axis])
        turn[:, 0] = np.cross(turn[:, 1], axis)
        place = coal.Transform3s(turn, np.array([*(0.5 * (a + b)), 0.0]))
        links.append(coal.CollisionObject(coal.Capsule(1e-9, 0.25), place))
    return links


@pytest.mark.parametrize("when", ["fresh", "finished"])
def bench_link_crossings(beside: Any, when: str) -> None:
    q_1, q_2 = populations(when)
    points_1, points_2 = ONE.points(q_1), TWO.points(q_2)
    found = count_crossings(ONE, points_1, TWO, points_2)
    by_coal = coal_counts(points_1, points_2)
    each = [
        np.repeat(q_1, INDIVIDUALS, axis=2).swapaxes(0, 1),
        np.tile(q_2, INDIVIDUALS).swapaxes(0, 1),
    ]
    each = [np.ascontiguousarray(q.reshape(2, -1)) for q in each]
    assert np.array_equal(
        found.counts, plain.counts_of_populations(ONE.base, points_1, TWO.base, points_2)
    )
    assert np.array_equal(found.counts[:HANDFUL, :HANDFUL], by_coal())
    colliding = closed_form(ONE, each[0], TWO, each[1]).colliding
    assert np.array_equal(found.counts.ravel(), colliding.reshape(CONFIGURATIONS, -1).sum(axis=0))
    beside(
        f"link tests of {INDIVIDUALS} × {INDIVIDUALS} arms in {CONFIGURATIONS} configurations, "
        f"{when}",
        lambda: count_crossings(ONE, ONE.points(q_1), TWO, TWO.points(q_2)),
        {
            "numpy": (
                lambda: plain.counts_of_populations(ONE.base, points_1, TWO.base, points_2),
                LINK_TESTS,
                1,
            ),
            "the paper's closed form, compiled": (
                lambda: closed_form(ONE, each[0], TWO, each[1]),
                LINK_TESTS,
                1,
            ),
            "coal, pair by pair": (by_coal, HANDFUL * HANDFUL * CONFIGURATIONS * 4, 1),
        },
        unit="link test",
        amount=LINK_TESTS,
        repeat=10,
    )


def bench_changed_individuals(beside: Any) -> None:
    q_1, q_2 = populations("fresh")
    points_1, points_2 = ONE.points(q_1), TWO.points(q_2)
    found = count_crossings(ONE, points_1, TWO, points_2)
    changed = np.arange(INDIVIDUALS) % 10 < 3
    beside(
        f"counts of {INDIVIDUALS} × {INDIVIDUALS} arms, 30 % of each changed",
        lambda: update_crossings(found, ONE, points_1, TWO, points_2, changed, changed),
        {"all anew": (lambda: count_crossings(ONE, points_1, TWO, points_2), 1, 10)},
        unit="matrix",
        repeat=10,
    )


def bench_envelopes(beside: Any) -> None:
    arms = [EnvelopedArm(arm, HALF_WIDTH, TCP_RADIUS) for arm in (ONE, TWO)]
    outlines = [arm.outlines(q) for arm, q in zip(arms, populations("fresh"), strict=True)]
    parts: list[Any] = []
    for arm, outline in zip(arms, outlines, strict=True):
        parts += [arm.boundaries(outline), outline[:, 2:4], TCP_RADIUS]

    def count() -> Any:
        return count_collisions(arms[0], outlines[0], arms[1], outlines[1])

    assert np.array_equal(count().counts, plain.envelope_counts(*parts))
    beside(
        f"envelopes of {INDIVIDUALS} × {INDIVIDUALS} arms in {CONFIGURATIONS} configurations",
        count,
        {"numpy": (lambda: plain.envelope_counts(*parts), 1, 1)},
        unit="matrix",
        repeat=5,
        rounds=20,
    )
