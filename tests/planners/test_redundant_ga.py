"""The planner of Lavoie & Boudreau: worked values, degenerate cases, messages."""

import math

import numpy as np
import pytest

from composed import composed
from evoexp.planners.reaching_tasks import Problem
from evoexp.planners.redundant_ga.planner import RedundantGa
from evoexp.records import FloatArray
from planners.runs import evolved

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
