"""The mission: both searches, one motion; its parts are what the two planners say of them."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.answers import Proofs
from evoexp.robots.arms import FloorManipulator
from evoexp.store.log_reader import read_log
from planners.runs import ran, verdict

Mission = tuple[Any, Any, np.ndarray]  # planner, problem, a solution


def mission(*words: str) -> Condition:
    return composed("experiment=chen_mission", "budget=smoke", *words)


@pytest.fixture(scope="module")
def found() -> Mission:
    planner, problem = mission().prepare()
    return planner, problem, read_log(run_replicate(mission(), 1).content).solutions[-1].values


def test_the_motion_ends_where_the_task_is(found: Mission) -> None:
    planner, problem, solution = found
    motion, scenario, robot = planner.motion(problem, solution), problem.scenario, mission().robot
    (x, y), (reach, above) = scenario.task_origin, scenario.docking.target
    assert isinstance(robot, FloorManipulator)
    place = [x + reach, y, robot.body_height + above]
    model = robot.build().model
    data = model.createData()
    pin.forwardKinematics(model, data, motion.q[-1])
    tip = data.oMi[model.njoints - 1].act(np.array([robot.link_lengths[-1], 0.0, 0.0]))
    assert tip == pytest.approx(place, abs=1e-9)
    assert motion.q[0, :2].tolist() == list(scenario.grid.start)
    assert np.abs(motion.q[-2, :2] - scenario.grid.goal).max() < 0.5
    assert np.array_equal(motion.q[-2, :2], motion.q[-1, :2])


def test_cost_and_terms_are_those_of_the_stages(found: Mission) -> None:
    planner, problem, solution = found
    terms = planner.evaluate(problem, solution)
    posture = planner.placement.evaluate(problem.placement, solution[:2])
    path = planner.path.evaluate(problem.path, solution[2:])
    assert terms["cost"] == pytest.approx(posture["cost"] + path["cost"])
    assert terms["distance"] == path["distance"]
    assert terms["torque_norm"] == posture["torque_norm"]
    assert terms["last_leg"] <= np.sqrt(0.5)


def test_the_whole_motion_is_certified(found: Mission) -> None:
    planner, problem, solution = found
    assert verdict(planner, problem, solution).certified
    through = np.concatenate([solution[:2], [2.0, 6.0, 30.0, 27.0]])  # straight across
    assert verdict(planner, problem, through).certified is False


def test_another_docking_place_has_another_goal(found: Mission) -> None:
    planner, problem, solution = found
    away, blocked = (
        problem._replace(scenario=problem.scenario.model_copy(update={"task_origin": origin}))
        for origin in ((23.2, 26.0), (18.0, 23.0))
    )
    *_, docked = planner.placement.evolve(problem.placement, mission().rng(0))
    *_, last = planner._drive(away, mission().rng(0), docked)
    assert last.best[-2:].tolist() == [28.0, 26.0]
    with pytest.raises(SettingError, match=r"scenario\.goal: must be a free node"):
        planner.evaluate(blocked, solution)


def test_the_first_stage_has_no_plan_yet() -> None:
    planner, problem, rows = ran(mission(), 2)
    stages = [row.terms["sub_path"] for row in rows]
    assert stages == sorted(stages)
    assert [row.best_cost == np.inf for row in rows] == [stage == 1.0 for stage in stages]
    assert [row.index for row in rows] == list(range(len(rows)))
    assert planner.prior_queries(problem) == 1024  # the map's nodes, 32 × 32
    both = sum(map(planner.num_evaluations, range(planner.num_generations + 1)))
    assert rows[-1].evaluations == both


def test_a_mission_is_over_a_floor() -> None:
    given: Any = mission()
    grid = given.scenario.grid.model_copy(update={"size": (4, 4, 4)})
    with pytest.raises(SettingError, match=r"scenario\.grid\.size: must be two numbers"):
        given.planner.prepare(given.robot, given.scenario.model_copy(update={"grid": grid}))


def test_a_mission_whose_end_is_refuted_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Proofs, "is_proven", lambda self, plan: False)
    last = ran(mission("planner.acceptance=certified")).last
    assert (last.solved, last.best_cost) == (False, np.inf)
