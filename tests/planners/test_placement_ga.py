"""Chen & Zalzala's placement search: coding, elitism, verdicts, settings."""

from typing import Any

import numpy as np

from composed import composed
from evoexp.condition import Condition
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
