"""Maps of distances, beside coal's distances at many configurations."""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.collision.distance_maps import coal_distances
from evoexp.paths.motion import Motion

PROBLEM = "evoexp:motionbenchmaker/problems/table_under_pick_ur5"
WORDS = (
    *("robot=ur5", "planner=rrt_connect", "ga=rrt_connect", "objective=null"),
    *("collision=covered_bodies", "scenario=moveit"),
    *(f"scenario.{name}='{PROBLEM}/{name}0001.yaml'" for name in ("scene", "request")),
)


@pytest.fixture(scope="module")
def problem() -> Any:
    return composed(*WORDS).prepare()[1]


@pytest.fixture(scope="module")
def q(problem: Any) -> np.ndarray:
    """Configurations (nq, n) over the whole range of all joints, both ends of it included."""
    low, high = problem.limits.T
    shares = np.random.default_rng(1).random((len(low), 300))
    shares[:, 0], shares[:, 1] = 0.0, 1.0
    return np.asarray(np.radians(low[:, None] + (high - low)[:, None] * shares))


def test_the_pairs_whose_covers_always_touch_have_maps(problem: Any) -> None:
    bodies = problem.collision.bodies
    names = [tuple(bodies.names[body] for body in each.pair) for each in bodies.maps]
    assert names == [("base_link", "upper_arm_link"), ("forearm_link", "wrist_2_link")]
    assert bodies.sorted_pairs.overlapping == ()
    assert bodies.sorted_pairs.mapped == tuple(each.pair for each in bodies.maps)
    (note,) = (line for line in problem.collision.notes("m") if "maps of exact distances" in line)
    assert "forearm_link with wrist_2_link" in note


def test_bounds_are_below_coals_distances_and_not_far(problem: Any, q: np.ndarray) -> None:
    def exact(q: np.ndarray) -> np.ndarray:
        return coal_distances(problem.collision.assembly, each.pair, q)

    for each in problem.collision.bodies.maps:
        distances, bounds = exact(q), each.at(q)
        assert (bounds <= distances).all()
        assert (bounds > 0.0).any() and ((distances == 0.0) <= (bounds <= 0.0)).all()
        for ends in np.split(q[:, :60].T, 20):  # three configurations, two long lines
            motion = Motion(np.ascontiguousarray(ends))
            between = np.array([motion.at(t) for t in np.linspace(0.0, 2.0, 200)])
            assert each.least(motion) <= exact(between.T).min()
        still = Motion(np.ascontiguousarray(q[:, :1].T))
        assert each.least(still) >= bounds[0]


def test_kernels_read_the_maps(problem: Any, q: np.ndarray) -> None:
    collision, maps = problem.collision.collision, problem.collision.bodies.maps
    least = np.min([each.at(q) for each in maps], axis=0)
    assert (collision.clearance(q).to_self <= least).all()
    assert collision.collides(q)[least < 0.0].all()
    alone = problem.collision.bodies._replace(maps=()).collision(problem.collision.obstacles)
    assert (collision.collides(q) == (alone.collides(q) | (least < 0.0))).all()
    beyond = np.full((len(q), 8), np.nan)
    assert collision.collides(beyond).all()
