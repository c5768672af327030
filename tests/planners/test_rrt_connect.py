"""RRT-Connect: kernels and whole runs against a slow version, edges, hostile input."""

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from composed import composed
from evoexp.condition import Condition
from evoexp.configuration.compose import expand
from evoexp.errors import SettingError
from evoexp.planners.proofs import judge_motion
from evoexp.planners.sampling_based.kernels import (
    distance,
    lengths_along,
    nearest_node,
    place_on_path,
    step_toward,
)
from evoexp.planners.sampling_based.kernels import (
    tested_configurations as configurations_on,
)
from evoexp.planners.sampling_based.trees import EdgeTest, TreePair
from evoexp.records import generations
from moveit_samples import COVERED, body, scene, write_problem, write_robot
from references import rrt_connect_python

PLANAR = "rana_planar"
POST = body("cylinder", [1.0, 0.03], [0.35, 0.35, 0.5], name="post")  # in the straight way


def condition(label: str, *changes: str) -> Condition:
    return composed("experiment=rrt_connect", *changes, label=label)


def ran(chosen: Condition, seed: int) -> tuple[Any, Any, list[Any]]:
    planner, problem = chosen.prepare()
    return planner, problem, list(generations(planner.evolve(problem, np.random.default_rng(seed))))


@given(st.integers(1, 300), st.integers(1, 8), st.integers(0, 99))
def test_the_nearest_node_is_the_first_of_the_least_distance(
    count: int, joints: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    nodes = np.round(rng.normal(size=(joints, count + 5)) * 2.0)  # coarse, so that many are equal
    q = np.round(rng.normal(size=joints))
    squares = ((nodes[:, :count] - q[:, None]) ** 2).sum(axis=0)
    assert nearest_node(nodes, count, q) == int(np.argmin(squares))


@given(st.floats(0.5, 200.0), st.floats(0.1, 50.0), st.integers(0, 99))
def test_an_edge_is_tested_at_equal_distances_with_its_end_and_either_way_alike(
    far: float, resolution: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    one, direction = rng.normal(size=5) * 100.0, rng.normal(size=5)
    two = one + far * direction / np.linalg.norm(direction)
    found = configurations_on(one, two, resolution)
    assert np.array_equal(found[:, 0], two)
    order = np.argsort(np.linalg.norm(found - one[:, None], axis=0))
    along = np.linspace(one, two, found.shape[1] + 1)[1:]
    assert np.allclose(found[:, order].T, along, atol=1e-9)
    assert far / found.shape[1] <= resolution * (1.0 + 1e-5)
    assert far / max(1, found.shape[1] - 1) >= resolution or found.shape[1] == 1
    back = configurations_on(two, one, resolution)
    inside, inside_back = ({tuple(q) for q in each.T[1:]} for each in (found, back))
    assert inside == inside_back


def test_steps_are_as_long_as_asked_and_end_at_the_target() -> None:
    q, target = np.array([1.0, 2.0, 3.0]), np.array([1.0, 14.0, 8.0])
    new = step_toward(q, target, 6.5)
    assert new == pytest.approx([1.0, 8.0, 5.5])
    assert distance(q, new) == pytest.approx(6.5)
    assert np.array_equal(step_toward(q, target, 13.0), target)


@given(st.integers(2, 9), st.floats(0.0, 1.0), st.floats(0.01, 5.0), st.integers(0, 99))
def test_places_on_a_path_are_the_nearest_that_were_tested(
    nodes: int, share: float, resolution: float, seed: int
) -> None:
    path = np.random.default_rng(seed).normal(size=(nodes, 3))
    lengths = lengths_along(path)
    pieces = [math.dist(a, b) for a, b in itertools.pairwise(path)]
    assert lengths == pytest.approx([0.0, *np.cumsum(pieces)])
    at = share * lengths[-1]
    segment, q = place_on_path(path, lengths, at, resolution)
    assert lengths[segment] <= at <= lengths[segment + 1] + 1e-12
    one, two = path[segment], path[segment + 1]
    lattice = np.column_stack([one, configurations_on(one, two, resolution)])
    exact = [np.interp(at, lengths, joint) for joint in path.T]
    offsets = np.linalg.norm(lattice - np.array(exact)[:, None], axis=0)
    assert math.dist(q, exact) == pytest.approx(offsets.min(), abs=1e-12)
    # what is left of the segment on either side is tested at configurations of the whole
    for a, b in ((one, q), (q, two)):
        if math.dist(a, b) > 0.0:
            left = configurations_on(a, b, resolution)
            apart = np.linalg.norm(left[:, :, None] - lattice[:, None], axis=0).min(axis=1)
            assert apart.max() < 1e-9


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("shortcuts", [0, 60])
def test_runs_are_those_of_the_slow_version(seed: int, shortcuts: int) -> None:
    chosen = condition(PLANAR, f"planner.num_shortcuts={shortcuts}", "ga.num_generations=400")
    planner, problem, records = ran(chosen, seed)
    slow = rrt_connect_python.run(
        planner, problem, lambda q: bool(problem.collision.collides(q[:, None])[0]), seed
    )
    last = records[-1]
    assert last.stop_reason == "solution"
    path = last.best.reshape(-1, len(problem.start))
    assert path.shape == (len(slow.path), len(problem.start))
    assert np.allclose(path, slow.path, rtol=0.0, atol=1e-9)
    assert last.collision_queries == slow.asked
    assert last.best_cost == pytest.approx(rrt_connect_python.length(slow.path))
    assert last.terms["iterations"] == slow.iterations
    assert last.terms["nodes"] == slow.nodes
    assert last.terms["first_solution_length_deg"] == pytest.approx(slow.first_length)


def test_paths_are_free_where_they_were_tested_and_become_shorter() -> None:
    planner, problem, records = ran(condition(PLANAR, "ga.iterations_per_generation=5"), 1)
    costs = [record.best_cost for record in records]
    assert all(later <= earlier for earlier, later in itertools.pairwise(costs))
    found = [record for record in records if math.isfinite(record.best_cost)]
    assert found[0].best_cost > found[-1].best_cost
    for record in (found[0], found[-1]):
        path = record.best.reshape(-1, len(problem.start))
        assert np.array_equal(path[[0, -1]], [problem.start, problem.goal])
        for one, two in itertools.pairwise(path):
            tested = configurations_on(one, two, planner.resolution)
            assert not problem.collision.collides(tested).any()
        terms = planner.evaluate(problem, record.best)
        assert terms["collisions"] == 0.0
        assert terms["length_deg"] == pytest.approx(record.best_cost)
        assert not planner.departures(problem, record.best)
    motion = planner.motion(problem, found[-1].best)
    assert judge_motion(planner, problem, motion).certified


def test_restarts_keep_the_shortest_path_of_all() -> None:
    words = "planner.num_shortcuts=5", "planner.max_iterations=400"
    _, _, once = ran(condition(PLANAR, *words), 4)
    _, _, thrice = ran(condition(PLANAR, *words, "planner.num_restarts=2"), 4)
    costs = [record.best_cost for record in thrice]
    assert all(later <= earlier for earlier, later in itertools.pairwise(costs))
    assert costs[-1] == min(each for record in thrice for each in record.costs)
    assert (
        np.isinf([c for record in thrice for c in record.costs]).sum()
        > np.isinf([c for record in once for c in record.costs]).sum()
    )
    assert thrice[-1].stop_reason == once[-1].stop_reason == "solution"
    assert thrice[-1].terms["first_solution_queries"] == once[-1].terms["first_solution_queries"]


def test_each_start_is_that_of_the_slow_version() -> None:
    words = "planner.num_shortcuts=5", "planner.num_restarts=1", "ga.iterations_per_generation=1"
    planner, problem, records = ran(condition(PLANAR, *words), 6)

    def collides(q: Any) -> bool:
        return bool(problem.collision.collides(q[:, None])[0])

    rng = np.random.default_rng(6)
    slow = [rrt_connect_python.run(planner, problem, collides, rng) for _ in range(2)]
    lengths = [rrt_connect_python.length(each.path) for each in slow]
    assert records[-1].best_cost == pytest.approx(min(lengths))
    assert records[-1].collision_queries == sum(each.asked for each in slow)


def test_the_last_record_has_the_iterations_that_were_made() -> None:
    chosen = condition(PLANAR, "planner.num_shortcuts=7", "ga.iterations_per_generation=10")
    _, _, records = ran(chosen, 2)
    last = records[-1]
    assert last.evaluations == last.terms["iterations"] + 7
    counts = [record.evaluations for record in records]
    assert all(b - a == 10 for a, b in itertools.pairwise([0, *counts[:-1]]))


def test_a_search_that_is_given_up_has_no_path_and_no_motion(tmp_path: Path) -> None:
    chosen = condition(PLANAR, "planner.max_iterations=3")
    planner, problem, records = ran(chosen, 0)
    (only,) = records
    assert only.stop_reason == "no solution"
    assert (only.evaluations, only.best_cost, only.solved) == (3, math.inf, False)
    assert planner.motion(problem, only.best) is None
    (departure,) = [d for d in planner.departures(problem, only.best) if "path" in d]
    assert departure == "there is no path, one configuration only"


def test_tasks_of_moveit_are_planned_around_obstacles(tmp_path: Path) -> None:
    words = [*write_robot(tmp_path), *write_problem(tmp_path, scene(POST))]
    words += [word for word in COVERED if not word.startswith(("planner", "ga", "objective"))]
    words += ["planner=rrt_connect", "ga=rrt_connect", "objective=null"]
    (experiment,) = expand(words)
    planner, problem, records = ran(experiment.conditions[0].condition, 0)
    assert records[-1].solved
    motion = planner.motion(problem, records[-1].best)
    assert judge_motion(planner, problem, motion).certified
    assert any("tested every 2.5 deg" in note for note in planner.notes(problem))


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ("planner.range=0.001", r"planner\.range: must be at least .* deg: a line through"),
        ("planner.range=-1", r"planner\.range: must be"),
        ("planner.num_shortcuts=-1", r"planner\.num_shortcuts: must be"),
        ("planner.max_iterations=0", r"planner\.max_iterations: must be"),
        ("planner.free_turn=0", r"planner\.free_turn: must be"),
        ("control=random_search", r"planner: must be one that draws paths one by one"),
    ],
)
def test_settings_that_cannot_be_are_one_line(change: str, line: str) -> None:
    with pytest.raises(SettingError, match=line):
        ran(condition(PLANAR, change), 0)


def test_solutions_of_another_size_are_refused() -> None:
    planner, problem = condition(PLANAR).prepare()
    with pytest.raises(ValueError, match="a multiple of 4 values"):
        planner.evaluate(problem, np.zeros(7))


COARSE = "collision.collision_substeps=1", "planner.range=60"  # an edge is tested at its end alone


def test_by_proof_no_edge_passes_through_a_gap_between_tests() -> None:
    refuted = 0
    for acceptance in ("model", "certified"):
        chosen = condition(PLANAR, *COARSE, f"planner.acceptance={acceptance}")
        for seed in range(3):
            planner, problem, records = ran(chosen, seed)
            for record in records:
                assert record.solved == math.isfinite(record.best_cost)
                if record.solved:
                    found = judge_motion(planner, problem, planner.motion(problem, record.best))
                    assert found.certified or acceptance == "model"
                    refuted += found.certified is False
            assert records[-1].solved
            assert ("certificates" in records[-1].terms) == (acceptance == "certified")
    assert refuted > 0


def test_the_cost_of_a_path_by_proof_is_inf_where_it_is_refuted() -> None:
    trusting = condition(PLANAR, *COARSE)
    planner, problem, records = ran(trusting, 1)  # whose path the certifier refutes
    path = records[-1].best.reshape(-1, 4).T[:, :, None]
    proving = condition(PLANAR, *COARSE, "planner.acceptance=certified").prepare()[0]
    assert planner.cost(problem, path).feasible.all()
    assert proving.cost(problem, path).cost.tolist() == [math.inf]


def test_corners_are_cut_behind_the_shortcuts_and_paths_stay_free() -> None:
    """A path of few nodes becomes one of many: shorter, with lesser turns, and as free."""
    for seed in range(3):
        planner, problem, records = ran(condition(PLANAR, "planner.num_smoothings=4"), seed)
        _, _, plain = ran(condition(PLANAR), seed)
        smooth, angular = (each[-1].best.reshape(-1, 4) for each in (records, plain))
        assert records[-1].best_cost < plain[-1].best_cost
        assert np.array_equal(smooth[[0, -1]], angular[[0, -1]])
        assert len(smooth) > 2 * len(angular)
        assert sharpest(smooth) < sharpest(angular) + 1e-9  # a corner that cannot be cut stays
        assert planner.evaluate(problem, records[-1].best)["collisions"] == 0.0


def sharpest(path: np.ndarray) -> float:
    """Return the greatest turn between two edges of a path [rad]."""
    steps = np.diff(path, axis=0)
    steps /= np.linalg.norm(steps, axis=1)[:, None]
    return float(np.arccos(np.clip((steps[1:] * steps[:-1]).sum(axis=1), -1.0, 1.0)).max())


def test_smoothings_are_no_part_of_the_identity_unless_there_are_some() -> None:
    assert condition(PLANAR).id == condition(PLANAR, "planner.num_smoothings=0").id
    with pytest.raises(SettingError, match=r"planner\.num_smoothings: must be"):
        condition(PLANAR, "planner.num_smoothings=9")


class RefusesOneNode:
    """Proofs that refuse every motion through one configuration."""

    def __init__(self, q: np.ndarray) -> None:
        self._q, self.asked, self.num_certificates = q, list[int](), 0

    def is_proven(self, solution: np.ndarray) -> bool:
        nodes = solution.reshape(-1, len(self._q))
        self.asked.append(len(nodes))
        return not (nodes == self._q).all(axis=1).any()


def test_a_path_is_proven_whole_and_by_pieces_behind_a_refuted_one() -> None:
    planner, problem = condition(PLANAR).prepare()
    path = np.random.default_rng(0).normal(size=(4, len(problem.start)))
    proofs: Any = RefusesOneNode(path[2])
    edges = EdgeTest(problem.collision, planner.resolution, proofs)
    assert edges.unproven(path[:2]) is None
    assert proofs.asked == [2]
    piece = edges.unproven(path)
    assert piece is not None and np.array_equal(piece, path[2:3])
    assert proofs.asked == [2, 4, 2, 2]  # whole, then its nodes, each as a motion that stands
    proofs.asked.clear()
    assert edges.unproven(path[:2]) is None
    assert proofs.asked == [2]  # by pieces: its one edge
    last = edges.unproven(path[1:3])
    assert last is not None and np.array_equal(last, path[1:3])


def test_trees_lose_a_node_that_is_refuted_and_all_that_grew_from_it() -> None:
    planner, problem = condition(PLANAR, "planner.num_shortcuts=0").prepare()
    rng, (low, high) = np.random.default_rng(3), planner.box(problem)
    edges = EdgeTest(problem.collision, planner.resolution)
    pair, path = TreePair(problem.start, problem.goal, edges, planner.range), None
    while path is None:
        path = pair.iterate(low + rng.random(len(low)) * (high - low))
    assert len(path) > 3
    proofs: Any = RefusesOneNode(path[1])
    edges = EdgeTest(problem.collision, planner.resolution, proofs)
    pair, rng = (
        TreePair(problem.start, problem.goal, edges, planner.range),
        np.random.default_rng(3),
    )
    again = None
    for _ in range(2000):
        again = pair.iterate(low + rng.random(len(low)) * (high - low))
        assert not (pair.nodes == path[1]).all(axis=1).any() or len(proofs.asked) == 0
        if again is not None:
            break
    assert again is not None and not (again == path[1]).all(axis=1).any()
