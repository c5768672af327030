"""The planner of Lavoie & Boudreau: worked values, degenerate cases; the same in plain numpy.

Both take the same uniform numbers and so the same discrete decisions: who is drawn, cut, mutated,
who collides. Then they differ by rounding alone; were one decision to flip, postures would differ
by tenths.
"""

import itertools
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.numeric.generator_state import state_bytes
from evoexp.planners.reaching_tasks import Problem
from evoexp.planners.redundant_ga.planner import RedundantGa
from evoexp.records import FloatArray, generations
from planners.runs import evolved
from references import lavoie_numpy

SMALL = "planner.num_attempts=3", "ga.num_generations=8"
LENGTHS = (10.0, 10.0, 10.0, 4.0, 4.0, 3.0, 2.0)
GRIP, RELEASE = (15.0, 5.0), (18.0, 8.5)


def prepared(*overrides: str, experiment: str = "lavoie_7dof") -> tuple[RedundantGa, Problem]:
    return composed(f"experiment={experiment}", *overrides).prepare()


def tip(q: FloatArray) -> tuple[float, float]:
    x = y = angle = 0.0
    for length, turn in zip(LENGTHS, q.tolist(), strict=True):
        angle += turn
        x, y = x + length * math.cos(angle), y + length * math.sin(angle)
    return x, y


def test_an_arm_that_stays_is_as_far_from_its_targets_as_its_tip() -> None:
    planner, problem = prepared()
    terms = planner.evaluate(problem, np.tile(problem.start, 3))
    away = [math.dist(tip(problem.start), place) for place in (GRIP, RELEASE)]
    errors = [terms[f"position_error_sp{k}"] for k in (1, 2)]
    assert errors == pytest.approx(away, abs=1e-12)
    assert terms["joint_displacement_sp1_rad"] == terms["joint_displacement_sp2_rad"] == 0.0
    assert terms["of_sp1"] == terms["position_error_sp1"]
    assert terms["of_sp2"] == np.inf, "the tip is outside the box"
    assert terms["contact_position_sp1"] == 0.0


def test_a_collision_costs_inf_and_says_where() -> None:
    planner, problem = prepared()
    through = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # stretched out, across the box
    terms = planner.evaluate(problem, np.concatenate([problem.start, through, through]))
    assert terms["of_sp1"] == np.inf
    assert 1.0 <= terms["contact_position_sp1"] <= 10.0
    assert 1.0 <= terms["contact_link_sp1"] <= 7.0
    assert 1.0 <= terms["contact_obstacle_sp1"] <= 5.0
    assert terms["position_error_sp1"] == pytest.approx(math.dist(tip(through), GRIP), abs=1e-12)


@pytest.mark.examples(4)
@pytest.mark.parametrize(
    "words",
    [
        "ga.population_size=60 ga=lavoie_binary",
        "ga.population_size=60 ga.num_elites=60",
        "ga.population_size=1 ga.num_elites=0",
        "ga.population_size=2 ga.num_elites=1",
        "ga.population_size=60 collision.swept=none collision.num_positions=1",
        "ga.population_size=60 scenario.obstacles=[]",
    ],
)
def test_degenerate_settings_run_and_the_best_never_gets_worse(words: str) -> None:
    planner, problem = prepared(*SMALL, *words.split())
    best = np.inf
    for record in evolved(planner, problem, 3):
        assert np.isfinite(record.population).all()
        assert np.isfinite(record.best).all()
        assert record.best_cost <= best
        best, terms = record.best_cost, planner.evaluate(problem, record.best)
        assert all(terms[name] == record.terms[name] for name in terms.keys() & record.terms.keys())


def test_a_population_without_one_feasible_member_is_searched_on() -> None:
    """A box far away: nobody ever ends inside, so every plan costs inf, in all attempts."""
    far = "ga.population_size=60", "scenario.box_x=[60.0,61.0]", "planner.stop_cost_sp1=60"
    planner, problem = prepared(*SMALL, *far)
    last = evolved(planner, problem)[-1]
    assert last.terms["attempts"] == 3.0
    assert (last.best_cost, last.solved) == (np.inf, False)
    assert math.isnan(last.mean_cost)
    assert last.index == 3 * (1 + 9) - 1
    assert planner.evaluate(problem, last.best)["of_sp1"] < 60.0, "the best posture A"
    assert np.array_equal(last.best[7:14], last.best[14:]), "where the arm stays"


ROUNDING = 1e-11  # [rad], [cost]
GA: dict[str, Any] = {"population_size": 60, "num_generations": 25, "num_elites": 2}
PLANNER = {"num_attempts": 2, "stop_cost_sp1": 3.0, "stop_cost_sp2": 0.5}


def condition(
    *words: str, collision: dict[str, Any] | None = None, **changes: Any
) -> SimpleNamespace:
    """Return a small condition; the changes are settings of the planner or of its `ga`."""
    given: Any = composed(*(words or ("experiment=lavoie_7dof",)))
    own = {
        name: value for name, value in changes.items() if name in type(given.planner).model_fields
    }
    ga = given.planner.ga.model_copy(update=GA | {k: v for k, v in changes.items() if k not in own})
    own["collision"] = given.planner.collision.model_copy(update=collision or {})
    planner = given.planner.model_copy(update=PLANNER | own | {"ga": ga})
    return SimpleNamespace(robot=given.robot, scenario=given.scenario, planner=planner)


def largest_difference(given: Any, seed: int) -> tuple[float, set[int]]:
    """Return the largest difference of genomes and costs, and the sub-paths that were searched.

    It is inf where the runs differ in length, one finds infeasible whom the other does not, or the
    random generators are not at the same place.
    """
    planner = given.planner
    rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
    ours = generations(planner.evolve(planner.prepare(given.robot, given.scenario), rng))
    theirs = lavoie_numpy.evolve(given, slow_rng)
    largest, searched, count = 0.0, set(), 0
    for found, expected in itertools.zip_longest(ours, theirs):
        if found is None or expected is None:
            return np.inf, searched
        finite, count = np.isfinite(expected.costs), count + 1
        same_search = (found.terms["attempts"], found.terms["sub_path"]) == expected[:2]
        same_place = found.state == state_bytes(slow_rng.bit_generator)
        same_search = same_search and same_place
        if not same_search or not np.array_equal(np.isfinite(found.costs[0]), finite):
            return np.inf, searched
        assert found.num_feasible == np.count_nonzero(finite)
        searched.add(expected.sub_path)
        best = (found.best_cost, expected.best_cost) if np.isfinite(expected.best_cost) else (0, 0)
        for one, two in [
            (found.population, expected.genomes),
            (found.costs[0][finite], expected.costs[finite]),
            (found.best, expected.best),
            best,
        ]:
            largest = max(largest, float(np.abs(np.subtract(one, two)).max(initial=0.0)))
    assert count > 2
    return largest, searched


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"selection": "roulette", "crossover": "uniform"},
        {"selection": "rank", "crossover": "arithmetic", "crossover_rate": 0.8},
        {"crossover": "blx_alpha", "mutation": "gaussian", "tournament_size": 3},
        {"mutation": "uniform_reset", "mutation_scope": "individual", "population_size": 31},
        {"mutation_scope": "individual", "collision": {"swept": "none", "num_positions": 4}},
        {"success": "finite", "num_attempts": 3},
        {"num_generations": 0, "num_attempts": 3},
        {"crossover_rate": 1.0, "mutation_rate": 1.0},
        {"crossover_rate": 0.0, "mutation_rate": 0.0, "num_elites": 0},
    ],
    ids=str,
)
def test_generations_agree_to_rounding(changes: dict[str, Any]) -> None:
    difference, searched = largest_difference(condition(**changes), 0)
    assert difference < ROUNDING
    assert 1 in searched


@pytest.mark.parametrize("stretch", [1, 3])
def test_generations_agree_however_many_are_computed_per_call(
    stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("evoexp.planners.redundant_ga.sub_path.STRETCH", stretch)
    assert largest_difference(condition(stop_cost_sp1=6.0, mutation="gaussian"), 0)[0] < ROUNDING


def test_generations_of_bits_agree_to_rounding() -> None:
    binary = condition("experiment=lavoie_7dof", "ga=lavoie_binary", num_elites=0)
    assert largest_difference(binary, 0)[0] < ROUNDING


def test_both_sub_paths_and_the_arm_of_ten_joints_agree() -> None:
    given = condition("experiment=lavoie_10dof", population_size=150, stop_cost_sp1=6.0)
    difference, searched = largest_difference(given, 1)
    assert difference < ROUNDING
    assert searched == {1, 2}
