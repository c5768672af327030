"""The shipped problems of MotionBenchMaker: valid ends on exact bodies, of robots of known size."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import evoexp
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.moveit_tasks import arm_motion, with_allowed_pairs
from evoexp.planners.via_point_ga import tasks
from evoexp.testing.small_conditions import conditions

ASSETS = Path(evoexp.__file__).parent / "assets" / "motionbenchmaker"


@pytest.fixture(scope="module")
def shipped() -> dict[str, Condition]:
    return conditions("experiment=motionbenchmaker")


def test_a_problem_of_every_scene_with_both_robots(shipped: dict[str, Condition]) -> None:
    scenes = {label.rpartition("_")[0] for label in shipped}
    assert len(scenes) == 7
    assert set(shipped) == {f"{scene}_{robot}" for scene in scenes for robot in ("panda", "ur5")}
    total = sum(path.stat().st_size for path in ASSETS.rglob("*") if path.is_file())
    assert total <= 2_000_000
    assert (ASSETS / "NOTICE").is_file()


@pytest.mark.parametrize("robot", ["panda", "ur5"])
def test_starts_and_goals_are_free_on_exact_bodies(
    robot: str, shipped: dict[str, Condition]
) -> None:
    """By coal, without any of evoexp's tables; and a body moved to the hand is found."""
    own = [each for label, each in shipped.items() if label.endswith(robot)]
    built = own[0].robot.build()  # type: ignore[attr-defined]
    for each in own:
        assembly = with_allowed_pairs(built, each.scenario)  # type: ignore[arg-type]
        task = arm_motion(assembly, each.scenario)  # type: ignore[arg-type]
        ends = tasks.ends_of(assembly, task)
        tasks.check_limits(assembly, ends)
        bodies = tasks.covered_scene(assembly, task, each.scenario)  # type: ignore[arg-type]
        assert len(bodies.pairs) > 50
        data, placed = bodies.model.createData(), bodies.geometry.createData()
        for q in ends:
            found = pin.computeCollisions(
                bodies.model, data, bodies.geometry, placed, np.deg2rad(q), False
            )
            assert not found
        # an obstacle brought to where the last body is touches it
        last = assembly.geometry.ngeoms - 1
        bodies.geometry.geometryObjects[last + 1].placement = placed.oMg[last]
        with pytest.raises(SettingError, match="free of contact between bodies"):
            tasks.check_bodies(bodies, np.deg2rad(ends[1]), "scenario.q_goal", "m")
