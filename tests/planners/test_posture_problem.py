"""Goals of posture searches, scenes without obstacles, and what is refused in one line."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.objectives.posture_cost import AXIAL, COLLISION, DISTANCE, HEADING
from evoexp.planners.posture_es.kernels import COST
from evoexp.planners.posture_es.problem import reach
from evoexp.records import FloatArray
from planners.runs import ran

BALL, BOTTLE, WALL = "corsepius_ball", "corsepius_bottle", "corsepius_wall"
PICK, WIDE = "corsepius_pick_and_place", "corsepius_gate_wide"
FAR = "kind: point, point: [2,0,0.6]"


def phases(goal: str, rest: str = "") -> str:
    """Return a task of one phase."""
    return f"scenario.phases=[{{name: a, goal: {{{goal}}}{rest}}}]"


def prepared(name: str, *overrides: str) -> Any:
    return composed(f"experiment={name}", *overrides).prepare().problem


def random_postures(problem: Any, count: int) -> FloatArray:
    """Return postures within the limits, (nq, count)."""
    low, high = problem.limits.T
    return np.random.default_rng(0).uniform(low, high, (count, len(low))).T.copy()


def judged(problem: Any, q: FloatArray) -> FloatArray:
    """Return the terms of postures in the first phase."""
    rows: FloatArray = problem.begin(0, problem.start, problem.first_situation).judge(q).rows
    return rows


def tools(problem: Any, q: FloatArray) -> FloatArray:
    """Return the tool's places by Pinocchio, (postures, 3)."""
    model, tool = problem.assembly.model, problem.assembly.tools[0]
    data, places = model.createData(), []
    for one in q.T:
        pin.forwardKinematics(model, data, one.copy())
        places.append(data.oMi[tool.joint].act(np.asarray(tool.position)))
    return np.array(places)


@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_a_ball_around_a_point_is_met_at_its_surface(radius: float) -> None:
    problem = prepared(WIDE, f"scenario.phases.0.goal.radius={radius}")
    q = random_postures(problem, 300)
    away = np.linalg.norm(tools(problem, q) - [1.35, 0.15, 0.8], axis=1)
    assert judged(problem, q)[DISTANCE] == pytest.approx(away - radius, abs=1e-12)


def test_a_place_is_a_disc() -> None:
    problem = prepared(BALL, phases("kind: place, point: [0.4, 0.2, 0.7], radius: 0.06"))
    q = random_postures(problem, 300)
    away = tools(problem, q) - [0.4, 0.2, 0.7]
    beside = np.maximum(np.hypot(away[:, 0], away[:, 1]) - 0.06, 0.0)
    expected = np.hypot(beside, away[:, 2])
    assert np.abs(judged(problem, q)[DISTANCE]) == pytest.approx(expected, abs=1e-9)


def test_of_two_grasping_angles_the_larger_one_alone_may_count() -> None:
    both, larger = prepared(BOTTLE), prepared(BOTTLE, "objective.grasp_angles=larger")
    q = random_postures(both, 200)
    one, two = judged(both, q), judged(larger, q)
    free = one[COLLISION] == 0.0
    assert one[:COST] == pytest.approx(two[:COST])
    less = 0.15 * np.minimum(one[AXIAL], one[HEADING])
    assert (one[COST] - two[COST])[free] == pytest.approx(less[free])


@pytest.mark.parametrize(
    ("name", "objects"),
    [(BOTTLE, ("bottle",)), (WIDE, ()), (WALL, ()), (PICK, ("bottle",)), (BALL, ("ball",))],
)
def test_an_empty_scene_keeps_only_objects_that_a_goal_or_a_grasp_names(
    name: str, objects: tuple[str, ...]
) -> None:
    full, empty = prepared(name), prepared(name, "scenario.empty_scene=true")
    assert empty.task.names == objects
    assert len(empty.obstacles.kind) == len(objects)
    one, two = (p.begin(0, p.start, p.first_situation) for p in (full, empty))
    assert set(empty.scene_of(two).names) == {*empty.bodies.names, *objects}
    assert all(map(np.array_equal, one.judging.aim, two.judging.aim))


def test_goals_out_of_reach_are_searched_on_request() -> None:
    words = phases(FAR), "scenario.check_reach=false", "ga.num_generations=30"
    last = ran(composed(f"experiment={BALL}", *words)).last
    assert not last.solved
    assert last.terms["goal_distance"] > 1.0


@pytest.mark.parametrize("name", [BALL, "corsepius_shelf", WIDE])
def test_nothing_is_farther_than_the_reach(name: str) -> None:
    problem = prepared(name)
    center, far = reach(problem.assembly, problem.limits)
    away = np.linalg.norm(tools(problem, random_postures(problem, 5000)) - center, axis=1)
    assert 0.5 * far < away.max() <= far + 1e-12
