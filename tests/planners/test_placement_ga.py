"""Chen & Zalzala's placement search: coding, elitism, verdicts, settings."""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.errors import EvoexpError
from planners.runs import verdict


def condition(*words: str) -> Condition:
    return composed("experiment=chen_placement", *words, label="A torque norm")


def prepared(*words: str) -> Any:
    return condition(*words).prepare()


def test_postures_are_judged_by_their_bodies() -> None:
    planner, problem = prepared("scenario=chen_docking_link", "objective=chen_obstacle_link")
    assert planner.motion(problem, np.array([68.96, 41.74])).q.shape == (2, 4)
    refuted = verdict(planner, problem, np.array([68.96, 41.74]))
    assert refuted.certified is False
    assert "obstacle_1" in refuted.refuted_pair
    assert verdict(planner, problem, np.array([110.46, -36.09])).certified is True


def test_an_infeasible_posture_is_told_as_such() -> None:
    planner, problem = prepared()
    terms = planner.evaluate(problem, np.array([0.0, -90.0]))
    assert [terms[name] for name in ("branch", "cost", "other_cost")] == [-1.0, 250.0, 250.0]
    assert np.isnan(terms["theta_3_deg"])
    assert planner.motion(problem, np.array([0.0, -90.0])) is None


TRUTH = "reference=placement_optimum"


@pytest.mark.examples(5)
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            "scenario.target=[5,2.6]",
            "target: must be within the arm's reach: Y_e between −2.5 and 2.",
        ),
        ("objective=chen_torque", "objective: no option 'chen_torque'"),
        ("objective.torqe_norm_weight=1", "torqe_norm_weight: unknown setting; did you mean"),
        ("objective.torque_norm_weight=0", "torque_norm_weight: must be above 0, or another"),
        ("objective.torque_norm_weight=-1", "torque_norm_weight: must be at least 0.0, was -1"),
        ("objective=chen_obstacle_link", "avoidances[0].obstacle: must be an obstacle of the"),
        ("planner.angle_range=[90,-90]", "angle_range: must be [least, greatest] with least <"),
        ("planner.coding=grey", "'binary' or 'gray', was 'grey'; did you mean 'gray'?"),
        ("planner.bits_per_gene=0", "planner.bits_per_gene: must be at least 1, was 0"),
        ("ga.scaling_multiple=1", "ga.scaling_multiple: must be greater than 1.0"),
        ("ga=lavoie", "planner.ga: must be a ScaledGenetic"),
        ("+robot.joint_limits=[[0,0],[0,1],[0,1]]", "joint_limits[0]: must be [least, greatest]"),
        ("robot.platform_size=[0.2,0.6]", "platform_size: must be [length, height] with length >"),
        ("robot=planar_7r", "robot: must be one that placement_ga takes (MobileArm), was"),
        (f"{TRUTH} reference.num_angles=7", "reference.num_angles: must be at least 8, was 7"),
        (f"{TRUTH} control=random_search", "reference: must be left out beside a control"),
        ("reference=optimum", "reference: no option 'optimum'"),
    ],
)
def test_bad_input_is_refused_in_one_line(words: str, message: str) -> None:
    with pytest.raises(EvoexpError) as error:
        prepared(*words.split())
    assert message in str(error.value)
    assert "\n" not in str(error.value)
