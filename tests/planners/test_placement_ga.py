"""Chen & Zalzala's placement search: coding, settings, contract with its truth."""

import numpy as np
import pytest

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.errors import EvoexpError
from evoexp.planners.placement_ga import planner as placement_planner
from evoexp.planners.placement_ga.planner import Problem
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations

BASE = ("experiment=chen_placement",)


def prepared(*words: str) -> tuple[object, Problem]:
    return composed(*BASE, *words, label="A torque norm").prepare()


@pytest.mark.parametrize("coding", ["binary", "gray"])
def test_the_ends_of_the_range_are_values(coding: str) -> None:
    planner, problem = prepared(f"planner.coding={coding}")
    strings = np.array([[0, 0x8000 if coding == "gray" else 0xFFFF], [0, 0]])
    low, high = (planner.solution(problem, strings, k) for k in range(2))  # type: ignore[attr-defined]
    assert (low[0], low[1], high[0], high[1]) == (-180.0, -180.0, 180.0, -180.0)


@pytest.mark.examples(2)
@pytest.mark.parametrize(("block", "stretch"), [(1, 16), (500, 16), (8192, 1), (8192, 5), (700, 3)])
@pytest.mark.parametrize("elites", [0, 2])
def test_generations_do_not_depend_on_how_numbers_and_they_are_made_in_blocks(
    elites: int, block: int, stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    planner, problem = prepared("ga.num_generations=20", f"ga.num_elites={elites}")

    def run() -> list[tuple[list[list[int]], list[float], list[float]]]:
        rows = generations(planner.evolve(problem, np.random.Generator(np.random.PCG64(3))))  # type: ignore[attr-defined]
        return [
            (
                g.population.tolist(),
                g.costs.tolist(),
                [g.best_cost, g.mean_cost, g.std_cost, g.num_feasible],
            )
            for g in rows
        ]

    expected = run()
    monkeypatch.setattr(placement_planner, "BLOCK", block)
    monkeypatch.setattr(placement_planner, "PER_CALL", stretch)
    assert run() == expected


def test_without_elitism_the_best_can_get_lost_and_with_it_never() -> None:
    lost = {}
    for elites in (0, 1):
        planner, problem = prepared(f"ga.num_elites={elites}")
        rng = np.random.Generator(np.random.PCG64(0))
        costs = [g.best_cost_in_generation for g in generations(planner.evolve(problem, rng))]  # type: ignore[attr-defined]
        lost[elites] = sum(b > a for a, b in zip(costs, costs[1:], strict=False))
    assert lost[0] > 10
    assert lost[1] == 0


def test_a_run_ends_near_the_optimum() -> None:
    words = [*BASE, "ga=chen_placement_elitism"]
    condition = composed(*words, label="A torque norm")
    costs = [run_replicate(condition, k).summary.best_cost for k in range(20)]
    assert min(costs) > 1.72761706
    assert np.median(costs) < 1.76, "the median of 60 runs is 1.728"


def test_postures_are_judged_by_their_bodies() -> None:
    planner, problem = prepared("scenario=chen_docking_link", "objective=chen_obstacle_link")
    motion = planner.motion(problem, np.array([68.96, 41.74]))  # type: ignore[attr-defined]
    assert motion.q.shape == (2, 4)
    verdict = judge_motion(planner, problem, motion)
    assert verdict.certified is False
    assert "obstacle_1" in verdict.refuted_pair
    free = judge_motion(planner, problem, planner.motion(problem, np.array([110.46, -36.09])))  # type: ignore[attr-defined]
    assert free.certified is True
    assert planner.motion(problem, np.array([0.0, -90.0])) is None  # type: ignore[attr-defined]


def test_an_infeasible_posture_is_told_as_such() -> None:
    planner, problem = prepared()
    found = planner.evaluate(problem, np.array([0.0, -90.0]))  # type: ignore[attr-defined]
    assert (found["branch"], found["cost"], found["other_cost"]) == (-1.0, 250.0, 250.0)
    assert np.isnan(found["theta_3_deg"])
    with pytest.raises(ValueError, match="2 values"):
        planner.evaluate(problem, np.zeros(3))  # type: ignore[attr-defined]


@pytest.mark.examples(3)
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["scenario.target=[5,2.6]"],
            "scenario.target: must be within the arm's reach: Y_e between −2.5 and 2.5",
        ),
        (["objective=chen_torque"], "objective: no option 'chen_torque'"),
        (
            ["objective.torqe_norm_weight=1"],
            "objective.torqe_norm_weight: unknown setting; did you mean 'torque_norm_",
        ),
        (
            ["objective.torque_norm_weight=0"],
            "objective.torque_norm_weight: must be above 0, or another weight",
        ),
        (
            ["objective.torque_norm_weight=-1"],
            "objective.torque_norm_weight: must be at least 0.0, was -1",
        ),
        (
            ["objective=chen_obstacle_link"],
            "objective.avoidances[0].obstacle: must be an obstacle of the scenario",
        ),
        (
            ["planner.angle_range=[90,-90]"],
            "planner.angle_range: must be [least, greatest] with least < greatest",
        ),
        (
            ["planner.coding=grey"],
            "planner.coding: must be one of 'binary' or 'gray', was 'grey'; did you mean 'gray'?",
        ),
        (["planner.bits_per_gene=0"], "planner.bits_per_gene: must be at least 1, was 0"),
        (["ga.scaling_multiple=1"], "ga.scaling_multiple: must be greater than 1.0"),
        (["ga=lavoie"], "planner.ga: must be a ScaledGenetic"),
        (
            ["+robot.joint_limits=[[0,0],[0,1],[0,1]]"],
            "robot.joint_limits[0]: must be [least, greatest]",
        ),
        (
            ["robot.platform_size=[0.2,0.6]"],
            "robot.platform_size: must be [length, height] with length > height",
        ),
        (
            ["robot=planar_7r"],
            "robot: must be one that placement_ga takes (MobileArm), was 'planar_chain'",
        ),
        (
            ["reference=placement_optimum", "reference.num_angles=7"],
            "reference.num_angles: must be at least 8, was 7",
        ),
        (
            ["reference=placement_optimum", "control=random_search"],
            "reference: must be left out beside a control",
        ),
        (["reference=optimum"], "reference: no option 'optimum'"),
    ],
)
def test_bad_input_is_refused_in_one_line(words: list[str], message: str) -> None:
    with pytest.raises(EvoexpError) as error:
        prepared(*words)
    assert message in str(error.value)
    assert "\n" not in str(error.value)
