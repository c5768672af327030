"""Search that accepts proven motions only: every answer is one, and nothing else changes.

`./scripts/test --exhaustive tests/planners/test_certified_search.py` judges thousands of motions.
"""

import importlib.util
import itertools
import math
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.collision.scene import Part
from evoexp.condition import Condition
from evoexp.evolution.teams import best_team
from evoexp.paths.motion import Motion
from evoexp.planners.answers import Proofs
from evoexp.planners.coevolution.generations import ProvenTeams
from evoexp.planners.via_point_ga.strings import settle
from evoexp.store.log_reader import read_log
from matrix import counts
from planners.runs import ran, verdict

HAS_OMPL = importlib.util.find_spec("ompl") is not None
SAMPLES = 40  # per segment
COARSE = "collision.collision_substeps=1 planner.range=60"  # an edge is tested at its end alone
CONTROL = "rana_planar ga.num_generations=300 control="
FEW = "ga.population_size=30 ga.num_generations=20"
OMPL = f"rrt_connect planner=ompl ga=ompl {COARSE} ga.num_generations=20"
OMPL += " ga.queries_per_generation=100 planner.algorithm="
REACHING = "planner=rrt_reaching ga=rrt_connect objective=null collision=lavoie"
ALWAYS_SOLVED = (  # by one of the seeds at least
    "curkovic_motion",
    "curkovic_three",
    "curkovic_safety",
    "lavoie_7dof",
    "lavoie_10dof",
    "corsepius_shelf",
    "corsepius_pick_and_place planner.scope=0.05",
    f"rrt_connect {COARSE}",
    *(f"lavoie_{arm} {REACHING}" for arm in ("7dof", "10dof")),
    "rana_planar",
    "rana_obstacles",
    "rana_three_arms",
    "rana_puma",
    *(f"{CONTROL}{name}" for name in ("cma_es", "random_search", "multi_start")),
    *(f"chen_{name} robot.body_radius=0.8" for name in ("path", "mission")),
    "chen_path robot.body_radius=0.8 control=path_climbing",
)
MAYBE_SOLVED = (
    *(f"{CONTROL}{name}" for name in ("stomp", "nsga2")),
    *(f"{name} control=random_search {FEW}" for name in ("curkovic_motion", "lavoie_7dof")),
    "corsepius_shelf control=random_search ga.num_generations=20",
    "motionbenchmaker ga.num_generations=4 ga.population_size=40 planner.num_new_trajectories=8",
)
WITH_OMPL = [
    pytest.param(
        f"{OMPL}{name} planner.num_shortcuts={num}",
        id=f"ompl {name}",
        marks=pytest.mark.skipif(not HAS_OMPL, reason="an extra"),
    )
    for name, num in (("RRTConnect", 200), ("BITstar", 0), ("PRMstar", 0))
]


def condition(words: str, acceptance: str = "certified") -> Condition:
    return composed(*f"experiment={words} planner.acceptance={acceptance}".split())


def least_distance(part: Part, motion: Motion) -> float:
    """Return the least distance of coal over all pairs that must not touch and many instants."""
    scene = part.scene
    data, geometry_data = scene.model.createData(), pin.GeometryData(scene.geometry)
    pairs = [frozenset((p.first, p.second)) for p in scene.geometry.collisionPairs]
    watched = {frozenset(pair) for pair in scene.pairs.tolist()}
    assert watched <= set(pairs)
    least = np.inf
    for t in np.linspace(part.first, part.last, SAMPLES * (part.last - part.first) + 1):
        pin.computeDistances(scene.model, data, scene.geometry, geometry_data, motion.at(float(t)))
        for pair, result in zip(pairs, geometry_data.distanceResults, strict=True):
            least = min(least, result.min_distance if pair in watched else np.inf)
    return float(least)


@pytest.mark.parametrize("words", [*ALWAYS_SOLVED, *MAYBE_SOLVED, *WITH_OMPL])
def test_every_answer_is_proven_and_none_touches(words: str) -> None:
    """By the certifier and, without it, by many exact distances."""
    num_solved = 0
    for seed in range(counts(2, 25)):
        planner, problem, records = ran(condition(words), seed)
        bests = [math.inf, *(record.best_cost for record in records)]
        assert all(later <= earlier for earlier, later in itertools.pairwise(bests))
        answers = {r.best.tobytes(): r.best for r in records if r.solved and r.best_cost < math.inf}
        for solution in answers.values():
            assert verdict(planner, problem, solution).certified is True
        for solution in list(answers.values())[-counts(1, 1000) :]:
            motion = planner.motion(problem, solution)
            assert min(least_distance(p, motion) for p in planner.parts(problem, motion)) > 0.0
        num_solved += bool(answers)
    assert num_solved > 0 or words in MAYBE_SOLVED


def test_the_cheapest_free_strings_are_judged_until_one_is_proven(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    proofs, asked = Proofs(*condition("rana_planar").prepare()), list[int]()

    def proven(solution: Any) -> bool:
        asked.append(int(solution[0]))
        return asked[-1] in (1, 5)

    monkeypatch.setattr(proofs, "is_proven", proven)
    strings = np.broadcast_to(np.arange(6.0), (4, 21, 6))
    costs = np.array([3.0, 9.0, 1.0, 2.0, 4.0, 10.0])
    hits = np.array([0.0, 0.0, 2.0, 0.0, 1.0, 0.0])
    assert settle(proofs, strings, costs, hits) == 1
    assert asked == [3, 0, 1]
    assert costs.tolist() == [103.0, 9.0, 1.0, 102.0, 4.0, 10.0]
    assert hits.tolist() == [1.0, 0.0, 2.0, 1.0, 1.0, 0.0]
    assert settle(proofs, strings, costs, hits, below=9.0) is None
    assert asked == [3, 0, 1]
    asked.clear()
    costs = np.array([3.0, np.inf, 4.0, 9.0, 2.0, 5.0])  # without collisions to be counted
    assert proofs.settle(costs, lambda k: np.array([float(k)])) == 5
    assert asked == [4, 0, 2, 5]
    assert costs.tolist() == [np.inf, np.inf, np.inf, 9.0, np.inf, 5.0]


def test_a_refuted_team_counts_as_colliding_once_more() -> None:
    planner, problem = condition("curkovic_three").prepare()
    populations = planner.sample(problem, np.random.default_rng(1), 40)
    found, untouched = (planner.evaluated(problem, populations) for _ in range(2))
    teams = ProvenTeams(planner, problem)
    best, first = (
        teams.settle(populations, found),
        best_team(untouched.collisions, untouched.teamable),
    )
    more = found.collisions.astype(int) - untouched.collisions
    counted = found.criteria[:, 0] - untouched.criteria[:, 0]
    assert first.found and more.min() == 0
    assert counted.sum() == 2 * more.sum()
    weight = planner.objective.collision_weight
    assert found.costs - untouched.costs == pytest.approx(weight * counted)
    assert teams.num_certificates >= 1
    if best.found:
        solution = planner.team_solution(problem, populations, best.individuals)
        assert verdict(planner, problem, solution).certified is True
        assert best.cost >= first.cost


def test_margins_can_be_asked_for() -> None:
    run = ran(condition("rana_planar scenario.security_margin=0.02", "margin"))
    assert run.last.solved
    assert run.verdict().certified_margin


@pytest.mark.parametrize("experiment", ["rana_planar", "rrt_connect", "chen_path"])
def test_the_default_is_the_model_and_no_part_of_the_identity(experiment: str) -> None:
    plain = composed(f"experiment={experiment}")
    assert plain.id == condition(experiment, "model").id != condition(experiment).id
    assert b"acceptance" not in plain.to_json()


def test_the_log_of_a_proven_search_counts_its_certificates() -> None:
    log = read_log(run_replicate(condition("rana_planar ga.num_generations=400"), 0).content)
    assert log.summary.certified
    assert log.generations[-1].terms["certificates"] >= 1.0
