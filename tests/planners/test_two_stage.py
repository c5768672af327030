"""The mission: both searches, one motion; its parts are what the two planners say of them."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import SettingError
from evoexp.planners.proofs import Proofs, judge_motion
from evoexp.records import generations
from evoexp.robots.floor_manipulator import FloorManipulator
from evoexp.store.log_reader import read_log


@pytest.fixture(scope="module")
def condition() -> Condition:
    return composed("experiment=chen_mission", "budget=smoke")


@pytest.fixture(scope="module")
def found(condition: Condition) -> tuple[Any, Any, np.ndarray]:
    planner, problem = condition.prepare()
    return planner, problem, read_log(run_replicate(condition, 1).content).solutions[-1].values


def end_effector(robot: FloorManipulator, q: np.ndarray) -> np.ndarray:
    model = robot.build().model
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    return np.asarray(data.oMi[model.njoints - 1].act(np.array([robot.link_lengths[-1], 0.0, 0.0])))


def test_the_motion_ends_where_the_task_is(
    condition: Condition, found: tuple[Any, Any, np.ndarray]
) -> None:
    planner, problem, solution = found
    motion = planner.motion(problem, solution)
    scenario: Any = condition.scenario
    (x, y), (reach, above) = scenario.task_origin, scenario.docking.target
    robot: Any = condition.robot
    assert end_effector(robot, motion.q[-1]) == pytest.approx(
        [x + reach, y, robot.body_height + above], abs=1e-9
    )
    assert motion.q[0, :2].tolist() == list(scenario.grid.start)
    assert np.abs(motion.q[-2, :2] - scenario.grid.goal).max() < 0.5
    assert np.array_equal(motion.q[-2, :2], motion.q[-1, :2])


def test_cost_and_terms_are_those_of_the_stages(found: tuple[Any, Any, np.ndarray]) -> None:
    planner, problem, solution = found
    terms = planner.evaluate(problem, solution)
    posture = planner.placement.evaluate(problem.placement, solution[:2])
    path = planner.path.evaluate(problem.path, solution[2:])
    assert terms["cost"] == pytest.approx(posture["cost"] + path["cost"])
    assert terms["distance"] == path["distance"]
    assert terms["torque_norm"] == posture["torque_norm"]
    assert terms["last_leg"] <= np.sqrt(0.5)


def test_the_whole_motion_is_certified(found: tuple[Any, Any, np.ndarray]) -> None:
    planner, problem, solution = found
    verdict = judge_motion(planner, problem, planner.motion(problem, solution))
    assert verdict.certified
    through = np.concatenate([solution[:2], [2.0, 6.0, 30.0, 27.0]])  # straight across
    assert judge_motion(planner, problem, planner.motion(problem, through)).certified is False


def test_another_docking_place_has_another_goal(
    condition: Condition, found: tuple[Any, Any, np.ndarray]
) -> None:
    planner, problem, solution = found
    scenario = condition.scenario.model_copy(update={"task_origin": (23.2, 26.0)})
    moved = problem._replace(scenario=scenario)
    docked = last_of(planner, problem, condition)
    *_, last = planner._drive(moved, condition.rng(0), docked)
    assert last.best[-2:].tolist() == [28.0, 26.0]
    blocked = problem._replace(
        scenario=condition.scenario.model_copy(update={"task_origin": (18.0, 23.0)})
    )
    with pytest.raises(SettingError, match=r"scenario\.goal: must be a free node"):
        planner.evaluate(blocked, solution)


def last_of(planner: Any, problem: Any, condition: Condition) -> Any:
    return list(planner.placement.evolve(problem.placement, condition.rng(0)))[-1]


def test_the_first_stage_has_no_plan_yet(condition: Condition) -> None:
    planner, problem = condition.prepare()
    rows = list(generations(planner.evolve(problem, condition.rng(2))))
    stages = [row.terms["sub_path"] for row in rows]
    assert stages == sorted(stages)
    assert all(
        (row.best_cost == np.inf) == (stage == 1.0) for row, stage in zip(rows, stages, strict=True)
    )
    assert [row.index for row in rows] == list(range(len(rows)))
    assert planner.prior_queries(problem) == 1024  # the map's nodes, 32 × 32
    assert (
        rows[-1].evaluations
        == planner.placement.ga.num_evaluations + planner.path.ga.num_evaluations
    )


def test_the_manipulator_agrees_with_the_arm_of_the_placement_search() -> None:
    robot = FloorManipulator(body_radius=0.5, body_height=0.4, link_lengths=(1.0, 0.7, 0.5))
    arm = robot.arm().build().model
    data = arm.createData()
    rng = np.random.default_rng(0)
    for _ in range(20):
        x, y, *angles = rng.uniform(-3.0, 3.0, 5)
        pin.forwardKinematics(arm, data, np.array([x, *angles]))
        flat = data.oMi[arm.njoints - 1].act(np.array([0.5, 0.0, 0.0]))
        assert end_effector(robot, np.array([x, y, *angles])) == pytest.approx(
            [flat[0], y, 0.4 + flat[1]], abs=1e-12
        )


def test_a_mission_is_over_a_floor(condition: Condition) -> None:
    grid = condition.scenario.grid.model_copy(update={"size": (4, 4, 4)})  # type: ignore[attr-defined]
    scenario = condition.scenario.model_copy(update={"grid": grid})
    with pytest.raises(SettingError, match=r"scenario\.grid\.size: must be of a floor"):
        condition.planner.prepare(condition.robot, scenario)  # type: ignore[attr-defined]


def test_by_proof_every_mission_is_proven() -> None:
    """A wider platform touches corners that its moves over the grid pass."""
    refuted = 0
    for acceptance in ("model", "certified"):
        words = "robot.body_radius=0.8", f"planner.acceptance={acceptance}"
        (experiment,) = compose.expand(["experiment=chen_mission", "budget=smoke", *words])
        planner, problem = experiment.conditions[0].condition.prepare()
        for seed in (0, 3):
            *_, last = generations(planner.evolve(problem, np.random.default_rng(seed)))
            verdict = judge_motion(planner, problem, planner.motion(problem, last.best))
            assert last.solved
            assert verdict.certified or acceptance == "model"
            refuted += verdict.certified is False
    assert refuted > 0


def test_a_mission_whose_end_is_refuted_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    words = "experiment=chen_mission", "budget=smoke", "planner.acceptance=certified"
    planner, problem = composed(*words).prepare()
    monkeypatch.setattr(Proofs, "is_proven", lambda self, plan: False)
    *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
    assert not last.solved
    assert last.best_cost == np.inf


def test_a_posture_is_no_motion_to_prove() -> None:
    with pytest.raises(SettingError, match=r"planner\.acceptance: must be 'model': the answer is"):
        compose.expand(["experiment=chen_placement", "planner.acceptance=certified"])
