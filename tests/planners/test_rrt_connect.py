"""RRT-Connect against a slow version, proofs by pieces; trees toward places of a planar tip."""

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.configuration.compose import expand
from evoexp.errors import SettingError
from evoexp.planners.sampling_based.trees import EdgeTest, TreePair
from evoexp.robots.planar_ends import bring_tip_to, tip
from moveit_samples import COVERED, body, scene, write_problem, write_robot
from planners.runs import ran
from references import rrt_connect_python

ARMS = "lavoie_7dof", "lavoie_10dof"
TREES = "planner=rrt_reaching", "ga=rrt_connect", "objective=null", "collision=lavoie"
POST = body("cylinder", [1.0, 0.03], [0.35, 0.35, 0.5], name="post")  # in the straight way


def condition(*changes: str) -> Condition:
    return composed("experiment=rrt_connect", *changes, label="rana_planar")


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("shortcuts", "restarts"), [(0, 0), (60, 0), (5, 1)])
def test_runs_are_those_of_the_slow_version(seed: int, shortcuts: int, restarts: int) -> None:
    """Of several starts the shortest path of all is kept."""
    words = f"planner.num_shortcuts={shortcuts}", f"planner.num_restarts={restarts}"
    planner, problem, records = ran(condition(*words, "ga.num_generations=400"), seed)

    def collides(q: Any) -> bool:
        return bool(problem.collision.collides(q[:, None])[0])

    rng, last = np.random.default_rng(seed), records[-1]
    starts = [rrt_connect_python.run(planner, problem, collides, rng) for _ in range(1 + restarts)]
    slow = min(starts, key=lambda start: rrt_connect_python.length(start.path))
    path = last.best.reshape(-1, len(problem.start))
    assert last.stop_reason == "solution"
    assert path.shape == (len(slow.path), len(problem.start))
    assert np.allclose(path, slow.path, rtol=0.0, atol=1e-9)
    assert last.best_cost == pytest.approx(rrt_connect_python.length(slow.path))
    assert last.collision_queries == sum(start.asked for start in starts)
    assert last.terms["iterations"] == sum(start.iterations for start in starts)
    assert last.terms["first_solution_length_deg"] == pytest.approx(starts[0].first_length)
    assert restarts or last.terms["nodes"] == slow.nodes
    terms = planner.evaluate(problem, last.best)
    assert terms["collisions"] == 0.0
    assert terms["length_deg"] == pytest.approx(last.best_cost)
    assert not planner.departures(problem, last.best)


def test_a_search_that_is_given_up_has_no_path_and_no_motion() -> None:
    planner, problem, (only,) = ran(condition("planner.max_iterations=3"))
    assert only.stop_reason == "no solution"
    assert (only.evaluations, only.best_cost, only.solved) == (3, math.inf, False)
    assert planner.motion(problem, only.best) is None
    departures = planner.departures(problem, only.best)
    assert "there is no path, one configuration only" in departures


def test_tasks_of_moveit_are_planned_around_obstacles(tmp_path: Path) -> None:
    words = [*write_robot(tmp_path), *write_problem(tmp_path, scene(POST))]
    words += [word for word in COVERED if not word.startswith(("planner", "ga", "objective"))]
    words += ["planner=rrt_connect", "ga=rrt_connect", "objective=null"]
    run = ran(expand(words)[0].conditions[0].condition)
    assert run.last.solved
    assert run.verdict().certified
    assert any("tested every 2.5 deg" in note for note in run.planner.notes(run.problem))


def test_the_cost_of_a_path_by_proof_is_inf_where_it_is_refuted() -> None:
    coarse = "collision.collision_substeps=1", "planner.range=60"
    run = ran(condition(*coarse), 1)
    assert run.verdict().certified is False
    path = run.last.best.reshape(-1, 4).T[:, :, None]
    proving = condition(*coarse, "planner.acceptance=certified").prepare()[0]
    assert run.planner.cost(run.problem, path).feasible.all()
    assert proving.cost(run.problem, path).cost.tolist() == [math.inf]


def sharpest(path: np.ndarray) -> float:
    """Return the greatest turn between two edges of a path [rad]."""
    steps = np.diff(path, axis=0)
    steps /= np.linalg.norm(steps, axis=1)[:, None]
    return float(np.arccos(np.clip((steps[1:] * steps[:-1]).sum(axis=1), -1.0, 1.0)).max())


def test_corners_are_cut_behind_the_shortcuts_and_paths_stay_free() -> None:
    """A path of few nodes becomes one of many: shorter, with lesser turns, and as free."""
    for seed in range(3):
        run, plain = (ran(condition(f"planner.num_smoothings={num}"), seed) for num in (4, 0))
        smooth, angular = (each.last.best.reshape(-1, 4) for each in (run, plain))
        assert run.last.best_cost < plain.last.best_cost
        assert np.array_equal(smooth[[0, -1]], angular[[0, -1]])
        assert len(smooth) > 2 * len(angular)
        assert sharpest(smooth) < sharpest(angular) + 1e-9  # a corner that cannot be cut stays
        assert run.planner.evaluate(run.problem, run.last.best)["collisions"] == 0.0
    assert condition().id == condition("planner.num_smoothings=0").id


class RefusesOneNode:
    """Proofs that refuse every motion through one configuration."""

    def __init__(self, q: np.ndarray) -> None:
        self._q, self.asked, self.num_certificates = q, list[int](), 0

    def is_proven(self, solution: np.ndarray) -> bool:
        nodes = solution.reshape(-1, len(self._q))
        self.asked.append(len(nodes))
        return not (nodes == self._q).all(axis=1).any()


def test_a_path_is_proven_whole_and_by_pieces_behind_a_refuted_one() -> None:
    planner, problem = condition().prepare()
    path = np.random.default_rng(0).normal(size=(4, len(problem.start)))
    proofs: Any = RefusesOneNode(path[2])
    edges = EdgeTest(problem.collision, planner.resolution, proofs)
    assert edges.unproven(path[:2]) is None
    assert proofs.asked == [2]
    assert np.array_equal(edges.unproven(path), path[2:3])  # type: ignore[arg-type]
    assert proofs.asked == [2, 4, 2, 2]  # whole, then its nodes, each as a motion that stands
    proofs.asked.clear()
    assert edges.unproven(path[:2]) is None
    assert proofs.asked == [2]  # by pieces: its one edge
    assert np.array_equal(edges.unproven(path[1:3]), path[1:3])  # type: ignore[arg-type]


def test_trees_lose_a_node_that_is_refuted_and_all_that_grew_from_it() -> None:
    planner, problem = condition("planner.num_shortcuts=0").prepare()
    low, high = planner.box(problem)

    def grown(proofs: Any) -> tuple[TreePair, Any]:
        edges = EdgeTest(problem.collision, planner.resolution, proofs)
        pair = TreePair(problem.start, problem.goal, edges, planner.range)
        rng, path = np.random.default_rng(3), None
        while path is None:
            path = pair.iterate(low + rng.random(len(low)) * (high - low))
            refuted = proofs is not None and bool(proofs.asked)
            assert not (refuted and (pair.nodes == first[1]).all(axis=1).any())
        return pair, path

    first = grown(None)[1]
    assert len(first) > 3
    again = grown(RefusesOneNode(first[1]))[1]
    assert not (again == first[1]).all(axis=1).any()


# trees toward places of a planar arm's tip


def reaching(*words: str, arm: str = "lavoie_7dof") -> Condition:
    return composed(f"robot=planar_{arm[7:-3]}r", f"scenario={arm}", *TREES, *words)


@pytest.mark.parametrize("arm", ARMS)
def test_the_tip_is_brought_to_a_place_within_the_limits(arm: str) -> None:
    _, problem = reaching(arm=arm).prepare()
    rng, planar = np.random.default_rng(0), problem.collision.arm
    low, high = problem.joint_limits.T
    reached = 0
    for target in np.repeat(problem.targets, 50, axis=0):
        q = low + (high - low) * rng.random(len(low))
        if bring_tip_to(q, target, problem.joint_limits, planar):
            reached += 1
            turns = np.exp(1j * (planar.base_angle + np.cumsum(q)))
            there = complex(planar.base_x, planar.base_y) + planar.lengths @ turns
            assert abs(there - complex(*target)) < 1e-7
            assert tip(q, planar) == pytest.approx((there.real, there.imag))
            assert ((low <= q) & (q <= high)).all()
    assert reached > 80
    far = 2.0 * np.array([planar.lengths.sum(), 0.0])
    assert not bring_tip_to(problem.start.copy(), far, problem.joint_limits, planar)


@pytest.mark.parametrize("arm", ARMS)
def test_configurations_are_judged_as_paths_that_stay(arm: str) -> None:
    _, problem = reaching(arm=arm).prepare()
    low, high = problem.joint_limits.T
    q = np.random.default_rng(1).uniform(low, high, (300, len(low)))
    expected = [problem.collision.contact(each, each) is not None for each in q]
    assert problem.collision.collides(np.degrees(q.T.copy())).tolist() == expected
    assert 20 < sum(expected) < 280


@pytest.mark.parametrize("arm", ARMS)
def test_answers_are_of_the_task_and_mostly_proven(arm: str) -> None:
    num_proven = 0
    for seed in range(4):
        run = ran(reaching(arm=arm), seed)
        planner, problem, last = run.planner, run.problem, run.last
        assert (last.solved, last.stop_reason) == (True, "solution")
        assert planner.departures(problem, last.best) == []
        terms = planner.evaluate(problem, last.best)
        assert terms["collisions"] == 0.0
        assert terms["length_deg"] == pytest.approx(last.best_cost)
        assert max(terms["via_error"], terms["goal_error"]) < 1e-6
        counts = [record.collision_queries for record in run.records]
        assert all(earlier <= later for earlier, later in itertools.pairwise(counts))
        num_proven += run.verdict().certified is True
    assert num_proven >= 1


def test_a_search_toward_places_may_end_without_a_plan() -> None:
    planner, problem, (*_, last) = ran(reaching("planner.max_iterations=1"))
    assert (last.solved, last.stop_reason) == (False, "no solution")
    assert np.array_equal(last.best, problem.start)
    assert planner.motion(problem, last.best) is None
    assert len(planner.departures(problem, last.best)) == 2


def test_what_cannot_be_asked_of_trees_toward_places_is_refused() -> None:
    planner: Any
    planner, problem = reaching().prepare()
    with pytest.raises(SettingError, match="a planner that draws paths one by one"):
        planner.sample(problem, np.random.default_rng(0), 1)
    with pytest.raises(ValueError, match="a multiple of 7"):
        planner.evaluate(problem, np.zeros(8))
