"""The compiled planners of Chen & Zalzala against the same algorithms in plain Python; postures.

Both take the same uniform numbers, so paths and strings of bits are equal, and costs differ by
rounding alone.
"""

import functools
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.collision.potential_fields import PotentialFields
from evoexp.planners.grid_path_ga import planner as grid_planner
from evoexp.planners.placement_ga import planner as placement_planner
from evoexp.records import generations
from planners.grid_samples import FIELDS, planner, robot, scenario, solvable
from planners.runs import verdict
from references import chen_python

ROUNDING = 1e-12  # relative, of costs
BROKEN = PotentialFields(**(FIELDS | {"goal_potentials": (0.5, 1.75)}))  # no whole numbers


@pytest.fixture(autouse=True)
def _paths_of_all_generations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid_planner, "KEPT", grid_planner.PER_CALL + 1)


def same_paths(own: Any, problem: Any, seed: int) -> bool:
    """Return whether all generations have the same paths, at the same costs."""
    rng = np.random.default_rng(seed)
    size = own.ga.population_size
    first = [row[1 : row[0] + 1].tolist() for row in own.sample(problem, rng, size)]
    expected = chen_python.evolve_paths(own, problem, first, rng)
    best = np.inf
    for generation, (paths, costs) in zip(
        generations(own.evolve(problem, np.random.default_rng(seed))), expected, strict=True
    ):
        if [row[1 : row[0] + 1].tolist() for row in generation.population] != paths:
            return False
        best = min(best, *costs)
        np.testing.assert_allclose(generation.costs, costs, rtol=ROUNDING)
        found = [generation.best_cost, generation.best_cost_in_generation, generation.mean_cost]
        assert found == pytest.approx([best, min(costs), np.mean(costs)], rel=ROUNDING)
        assert generation.std_cost == pytest.approx(np.std(costs), rel=1e-9, abs=1e-12)
        assert own.evaluate(problem, generation.best)["cost"] == pytest.approx(best, rel=ROUNDING)
    return True


@pytest.mark.examples(12)
@pytest.mark.parametrize(
    ("shape", "share", "changes"),
    [
        ((12, 12), 0.3, {}),
        ((12, 12), 0.3, {"revisits": True, "mutation_rate": 0.8}),
        ((4, 4), 0.1, {"revisits": True, "mutation_rate": 1.0, "crossover_rate": 1.0}),
        ((4, 4, 4), 0.3, {"num_elites": 0, "population_size": 15}),
        ((16, 16), 0.35, {"crossover_reach": 0, "num_elites": 3, "scaling_multiple": 1.3}),
        ((16, 9), 0.2, {"weights": (1.0, 0.02), "population_size": 1, "num_elites": 0}),
        ((9, 9), 0.3, {"collision": BROKEN, "mutation_rate": 1.0}),  # longer ways of walking
        ((50, 50), 0.0, {"population_size": 6, "mutation_rate": 1.0, "num_generations": 2}),
    ],
    ids=str,
)
@pytest.mark.parametrize("seed", range(3))
def test_generations_of_paths_are_the_same(
    shape: tuple[int, ...], share: float, changes: dict[str, Any], seed: int
) -> None:
    own = planner(**({"population_size": 20, "num_generations": 30} | changes))
    problem = solvable(shape, share, seed, own)
    is_tabled = shape != (50, 50) and "collision" not in changes
    assert (len(problem.world.sums) > 0) is is_tabled
    assert same_paths(own, problem, seed)


@pytest.mark.parametrize(
    ("block", "stretch"), [(1, 8), (300, 8), (2000, 8), (16384, 1), (16384, 3), (400, 5)]
)
def test_paths_do_not_depend_on_how_numbers_and_generations_are_made_in_blocks(
    block: int, stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(grid_planner, "BLOCK", block)
    monkeypatch.setattr(grid_planner, "PER_CALL", stretch)
    own = planner(mutation_rate=1.0, num_elites=2)
    assert same_paths(own, solvable((9, 9), 0.3, 4, own), 6)


def test_paths_that_are_near_but_do_not_meet_are_crossed_the_same() -> None:
    """Two ways around a block, three nodes wide: few paths have a node in common."""
    blocked = np.zeros((9, 5), dtype=bool)
    blocked[2:7, 1:4:2] = blocked[2:7, 2] = True
    own = planner(crossover_reach=4, crossover_rate=1.0, num_generations=30)
    problem = own.prepare(robot(), scenario(blocked))
    assert all(same_paths(own, problem, seed) for seed in range(4))


@functools.cache
def prepared(*words: str) -> tuple[Any, Any]:
    return composed("experiment=chen_placement", *words, label="A torque norm").prepare()


def same_postures(planner: Any, problem: Any, seed: int) -> bool:
    """Return whether all generations have the same strings, at the same costs."""
    rng = np.random.default_rng(seed)
    expected = chen_python.evolve_postures(planner, problem, rng)
    bits, best = planner.bits_per_gene, np.inf
    for generation, (strings, costs, num_feasible) in zip(
        generations(planner.evolve(problem, np.random.default_rng(seed))), expected, strict=True
    ):
        if ["".join(f"{n:0{bits}b}" for n in pair) for pair in generation.population.T] != strings:
            return False
        best = min(best, *costs)
        np.testing.assert_allclose(generation.costs, costs, rtol=1e-9)
        assert generation.num_feasible == num_feasible
        found = [generation.best_cost, generation.best_cost_in_generation, generation.mean_cost]
        assert found == pytest.approx([best, min(costs), np.mean(costs)], rel=1e-9)
        assert planner.evaluate(problem, generation.best)["cost"] == generation.best_cost
    return True


@pytest.mark.parametrize(
    ("words", "changes"),
    [
        ((), {}),
        (("objective=chen_minimax",), {"num_elites": 2, "mutation_rate": 0.1}),
        (("scenario=chen_docking_link", "objective=chen_obstacle_link"), {"population_size": 31}),
        (("planner.coding=gray",), {"crossover_rate": 1.0, "mutation_rate": 0.0}),
        (("planner.bits_per_gene=5",), {"mutation_rate": 1.0, "scaling_multiple": 1.5}),
        (("planner.bits_per_gene=52", "planner.coding=gray"), {"mutation_rate": 0.05}),
    ],
    ids=str,
)
@pytest.mark.parametrize("seed", range(2))
def test_generations_of_postures_are_the_same(
    words: tuple[str, ...], changes: dict[str, Any], seed: int
) -> None:
    planner, problem = prepared(*words)
    ga = planner.ga.model_copy(update={"num_generations": 30} | changes)
    assert same_postures(planner.model_copy(update={"ga": ga}), problem, seed)


@pytest.mark.parametrize(("block", "stretch"), [(1, 16), (500, 16), (8192, 1), (700, 3)])
def test_postures_do_not_depend_on_how_numbers_and_generations_are_made_in_blocks(
    block: int, stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(placement_planner, "BLOCK", block)
    monkeypatch.setattr(placement_planner, "PER_CALL", stretch)
    planner, problem = prepared()
    ga = planner.ga.model_copy(update={"num_generations": 20, "num_elites": 2})
    assert same_postures(planner.model_copy(update={"ga": ga}), problem, 3)


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
