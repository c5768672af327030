"""Grid paths: valid under every operator, their costs as the equations say, and what is refused."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.collision.potential_fields import PotentialFields
from evoexp.errors import SettingError
from evoexp.numeric.random_stream import Block
from evoexp.objectives.path_cost import PathCost
from evoexp.planners.baselines.random_search import RandomSearch
from evoexp.planners.grid_path_ga import path_operators
from evoexp.planners.grid_path_ga import planner as grid_planner
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations
from evoexp.testing import conditions
from matrix import num_cases
from planners.grid_samples import FIELDS, faults, planner, robot, scenario, solvable

SEEDS = st.integers(0, 2**32)
SHAPES = st.sampled_from([(3, 3), (6, 5), (9, 9), (12, 4), (4, 4, 4)])


@pytest.fixture(autouse=True)
def _paths_of_all_generations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid_planner, "KEPT", grid_planner.PER_CALL + 1)


def rng(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def nodes_of(path: np.ndarray) -> list[int]:
    return [int(node) for node in path[1 : path[0] + 1]]


def without_loops(nodes: list[int]) -> list[int]:
    """The obvious way: cut out the first loop that closes, and look again."""
    for k, node in enumerate(nodes):
        if node in nodes[:k]:
            return without_loops(nodes[: nodes.index(node)] + nodes[k:])
    return nodes


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), st.booleans(), SEEDS)
def test_every_path_of_every_generation_is_valid_and_costs_what_the_equations_say(
    shape: tuple[int, ...], share: float, revisits: bool, seed: int
) -> None:
    own = planner(revisits=revisits)
    problem = solvable(shape, share, seed, own)
    grid = problem.fields.grid
    for generation in generations(own.evolve(problem, rng(seed))):
        for path, cost in zip(generation.population, generation.costs, strict=True):
            assert faults(problem, path, revisits=revisits) == []
            nodes = grid.coordinates[nodes_of(path)].astype(float)
            distance = np.sqrt((np.diff(nodes, axis=0) ** 2).sum(axis=1)).sum()
            unsafeness = problem.fields.unsafeness[nodes_of(path)].mean()
            assert cost == pytest.approx(0.2 * distance + 1.0 * unsafeness, rel=1e-12)


@settings(max_examples=num_cases(10, 40), deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), SEEDS)
def test_exchange_without_loops_is_exchange_and_then_erasing_loops(
    shape: tuple[int, ...], share: float, seed: int
) -> None:
    own = planner()
    problem = solvable(shape, share, seed, own)
    paths = own.sample(problem, rng(seed), 12)
    size = problem.fields.grid.num_nodes
    seen, sites = (np.zeros(size + 1, dtype=np.int64) for _ in range(2))
    pair = np.zeros((2, size + 1), dtype=np.int32)
    for one, two in zip(paths[:-1], paths[1:], strict=True):
        count = path_operators.coincident_sites(one, two, seen, sites)
        common = set(nodes_of(one)[1:-1]) & set(nodes_of(two)[1:-1])
        assert count == len(common)
        for site, (i, j) in enumerate(map(places_of, sites[:count].tolist())):
            assert one[i] == two[j]
            children = pair[0], pair[1]
            path_operators.exchange_without_loops(one, two, sites[:count], site, children)
            heads = nodes_of(one)[:i] + nodes_of(two)[j:], nodes_of(two)[:j] + nodes_of(one)[i:]
            assert [nodes_of(child) for child in pair] == [without_loops(head) for head in heads]


def places_of(site: int) -> tuple[int, int]:
    return divmod(site, 2**path_operators.PLACE_BITS)


def test_paths_without_a_common_node_are_crossed_where_they_are_near() -> None:
    own = planner()
    blocked = np.zeros((9, 4), dtype=bool)
    blocked[2:7, 1:3] = (
        True  # a block of two rows between the lower and the upper way: rows 0 and 3, three apart
    )
    problem = own.prepare(robot(), scenario(blocked))
    index = problem.fields.grid.index_of
    lower = [(0, 0), *((x, 0) for x in range(1, 8)), (8, 1), (8, 2), (8, 3)]
    upper = [(0, 0), (0, 1), (0, 2), (0, 3), *((x, 3) for x in range(1, 9))]
    size = problem.fields.grid.num_nodes
    table = np.zeros((4, size + 1), dtype=np.int32)
    for row, path in zip(table, (lower, upper), strict=False):
        row[: len(path) + 1] = [len(path), *map(index, path)]
    draws = Block(rng(1).random(64), np.zeros(1, dtype=np.int64))
    scratch, pair = path_operators.Scratch.of(size), (table[2], table[3])
    for reach, crossed in ((0, False), (2, True)):
        breeding = path_operators.Breeding(True, 2.0, 1.0, reach, 0.0)
        done = path_operators.cross(
            draws, problem.world, (table[0], table[1]), breeding, pair, scratch
        )
        assert done is crossed
    for child in table[2:]:
        assert faults(problem, child, revisits=False) == []
        assert nodes_of(child) not in (nodes_of(table[0]), nodes_of(table[1]))


def test_blocks_of_uniform_numbers_grow_where_walks_are_long() -> None:
    """A labyrinth, whose walks take more numbers than a block has.

    Small populations draw short blocks.
    """
    blocked = np.zeros((21, 21), dtype=bool)
    for x in range(1, 21, 2):
        blocked[x, :20] = True
        blocked[x] = np.roll(blocked[x], 1 if x % 4 == 3 else 0)
    own = planner(population_size=60, mutation_rate=1.0, num_generations=2)
    problem = own.prepare(robot(), scenario(blocked))
    for generation in generations(own.evolve(problem, rng(5))):
        assert all(faults(problem, path, revisits=False) == [] for path in generation.population)


@pytest.mark.parametrize(
    ("block", "stretch"), [(1, 8), (300, 8), (2000, 8), (16384, 1), (16384, 3), (400, 5)]
)
def test_generations_do_not_depend_on_how_numbers_and_they_are_made_in_blocks(
    block: int, stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = planner(mutation_rate=1.0, num_elites=2)
    problem = solvable((9, 9), 0.3, 4, own)

    def run() -> list[tuple[list[list[int]], list[float], list[float]]]:
        return [
            (
                [nodes_of(path) for path in g.population],
                g.costs.tolist(),
                [g.best_cost, g.mean_cost, g.std_cost],
            )
            for g in generations(own.evolve(problem, rng(6)))
        ]

    expected = run()
    monkeypatch.setattr(grid_planner, "BLOCK", block)
    monkeypatch.setattr(grid_planner, "PER_CALL", stretch)
    assert run() == expected


def test_walks_whose_moves_weigh_no_whole_numbers_take_the_longer_way() -> None:
    fields = PotentialFields(**(FIELDS | {"goal_potentials": (0.5, 1.75)}))
    own = planner(collision=fields)
    problem = solvable((9, 9), 0.3, 4, own)
    assert len(problem.sums) == len(problem.world.sums) == 0
    for path in own.sample(problem, rng(2), 200):
        assert faults(problem, path, revisits=False) == []


def test_large_grids_work_out_weights_as_they_go() -> None:
    own = planner(population_size=6, mutation_rate=1.0, num_generations=2)
    problem = own.prepare(robot(), scenario(np.zeros((50, 50), dtype=bool)))
    assert len(problem.world.sums) == 0
    last = list(generations(own.evolve(problem, rng(0))))[-1]
    assert all(faults(problem, path, revisits=False) == [] for path in last.population)


def test_a_map_asks_for_every_node_beforehand_and_no_other_planner_does() -> None:
    own = planner()
    problem = solvable((6, 5), 0.2, 3, own)
    assert own.prior_queries(problem) == 30
    assert RandomSearch(planner=own).prior_queries(problem) == 30
    other, task = conditions("experiment=rana_planar")["via-point GA"].prepare()
    assert other.prior_queries(task) == 0


def test_permitted_moves_past_corners_are_certified() -> None:
    blocked = np.zeros((4, 4), dtype=bool)
    blocked[1:3, 2] = True
    own = planner()
    problem = own.prepare(robot(), scenario(blocked, obstacles=((1, 2, 2, 2),)))
    past = np.array([[0, 0], [1, 1], [2, 1], [3, 2], [3, 3]], dtype=float)
    assert own.evaluate(problem, past.ravel())["forbidden_moves"] == 0.0
    verdict = judge_motion(own, problem, own.motion(problem, past.ravel()))
    assert verdict.certified
    assert verdict.clearance == pytest.approx(np.sqrt(0.5) - 0.4, abs=0.02)
    through = np.array([[0, 2], [3, 2], [3, 3]], dtype=float)
    assert judge_motion(own, problem, own.motion(problem, through.ravel())).certified is False


def test_evaluate_says_what_is_wrong_with_a_path() -> None:
    blocked = np.zeros((4, 4), dtype=bool)
    blocked[1, 1] = True
    own = planner()
    problem = own.prepare(robot(), scenario(blocked))
    terms = own.evaluate(problem, np.array([0, 0, 1, 1, 2, 2, 3.0, 2]))
    assert terms["blocked_nodes"] == 1.0
    assert terms["forbidden_moves"] == 2.0
    assert terms["missed_ends"] == 1.0
    assert terms["cost"] == np.inf
    assert terms["distance"] == pytest.approx(2 * np.sqrt(2.0) + 1.0)


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ([[0.0, 0.0]], "path: must be two nodes at least"),
        (
            [[0, 0], [0, 4]],
            r"path\[1\]: must be a node of the grid, whole numbers \(0\.\.3 × 0\.\.3\)"
            r", was \[0\.0, 4\.0\]",
        ),
        ([[0, 0], [0.5, 1]], r"path\[1\]: must be a node"),
        ([[-1, 0], [0, 0]], r"path\[0\]: must be a node"),
    ],
)
def test_evaluate_refuses_what_is_no_path(path: list[list[float]], said: str) -> None:
    own = planner()
    problem = own.prepare(robot(), scenario(np.zeros((4, 4), dtype=bool)))
    with pytest.raises(SettingError, match=said):
        own.evaluate(problem, np.array(path, dtype=float).ravel())


def test_a_goal_behind_obstacles_is_said_before_any_search() -> None:
    blocked = np.zeros((5, 5), dtype=bool)
    blocked[3, 3:] = blocked[4, 3] = True
    with pytest.raises(
        SettingError,
        match=r"scenario\.goal: must be a node that can be reached from the start \[0, 0\]",
    ):
        planner().prepare(robot(), scenario(blocked))
    blocked[3, 3] = False  # leaves the gap between two corners, which may not be passed
    with pytest.raises(SettingError, match="can be reached"):
        planner().prepare(robot(), scenario(blocked))


def test_start_and_goal_are_safe_enough() -> None:
    capped = PotentialFields(**FIELDS, max_unsafeness=7.0)
    with pytest.raises(
        SettingError,
        match=r"scenario\.start: must be a node of an unsafeness of at most .* \(7\), was 9",
    ):
        planner(collision=capped).prepare(robot(), scenario(np.zeros((5, 5), dtype=bool)))


def test_the_cap_is_kept_by_all_paths() -> None:
    capped = PotentialFields(**FIELDS, max_unsafeness=7.0)
    own = planner(collision=capped)
    inside: dict[str, Any] = {"start": (1, 1), "goal": (8, 8)}
    problem = own.prepare(robot(), scenario(np.zeros((10, 10), dtype=bool), **inside))
    for generation in generations(own.evolve(problem, rng(0))):
        for path in generation.population:
            assert problem.fields.unsafeness[nodes_of(path)].max() <= 7.0


def test_something_must_cost() -> None:
    with pytest.raises(
        SettingError, match="distance_weight: must be above 0, or unsafeness_weight is"
    ):
        PathCost(distance_weight=0.0, unsafeness_weight=0.0)


def test_robot_and_grid_have_the_same_dimensions() -> None:
    with pytest.raises(
        SettingError, match=r"robot\.dimensions: must be as many as the grid has \(2\), was 3"
    ):
        planner().prepare(robot(3), scenario(np.zeros((4, 4), dtype=bool)))


def test_populations_are_checked() -> None:
    own = planner()
    problem = solvable((4, 4), 0.0, 0, own)
    with pytest.raises(ValueError, match="paths must be"):
        own.cost(problem, np.zeros((3, 4), dtype=np.int32))
