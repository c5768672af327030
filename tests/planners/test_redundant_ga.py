"""The planner of Lavoie & Boudreau.

Worked values, promises of every run, degenerate cases, messages.
"""

import math

import numpy as np
import pytest

from composed import composed
from evoexp.errors import SettingError
from evoexp.planners.proofs import judge_motion
from evoexp.planners.reaching_tasks import Problem
from evoexp.planners.redundant_ga.planner import RedundantGa
from evoexp.records import FloatArray, generations

SMALL = ("ga.population_size=60", "ga.num_generations=8", "planner.num_attempts=3")
LENGTHS = (10.0, 10.0, 10.0, 4.0, 4.0, 3.0, 2.0)


def prepared(*overrides: str, experiment: str = "lavoie_7dof") -> tuple[RedundantGa, Problem]:
    condition = composed(f"experiment={experiment}", *overrides)
    planner, problem = condition.prepare()
    return planner, problem


def tip(q: FloatArray) -> tuple[float, float]:
    x = y = angle = 0.0
    for length, turn in zip(LENGTHS, q.tolist(), strict=True):
        angle += turn
        x, y = x + length * math.cos(angle), y + length * math.sin(angle)
    return x, y


def test_worked_values_of_the_start_posture() -> None:
    """An arm that stays where it is: no displacement, the errors are the distances of its tip."""
    planner, problem = prepared()
    stay = np.tile(problem.start, 3)
    terms = planner.evaluate(problem, stay)
    x, y = tip(problem.start)
    assert terms["position_error_sp1"] == pytest.approx(math.hypot(x - 15.0, y - 5.0), abs=1e-12)
    assert terms["position_error_sp2"] == pytest.approx(math.hypot(x - 18.0, y - 8.5), abs=1e-12)
    assert terms["joint_displacement_sp1_rad"] == terms["joint_displacement_sp2_rad"] == 0.0
    assert terms["of_sp1"] == terms["position_error_sp1"]
    assert terms["of_sp2"] == np.inf, "the tip is outside the box"
    assert terms["contact_position_sp1"] == 0.0


def test_costs_are_the_papers_formula() -> None:
    planner, problem = prepared("collision.blind=true")
    population = planner.sample(problem, np.random.default_rng(0), 40)
    judged = planner.cost(problem, population)
    for k in range(40):
        one, two = population[:, :, k]
        first = math.dist(tip(one), (15.0, 5.0)) + 0.7 * math.dist(problem.start, one)
        second = math.dist(tip(two), (18.0, 8.5)) + 0.7 * math.dist(one, two)
        x, y = tip(two)
        inside = 16.0 <= x <= 23.0 and 2.0 <= y <= 11.0
        assert judged.terms["of_sp1"][k] == pytest.approx(first, abs=1e-11)
        assert judged.terms["of_sp2"][k] == (pytest.approx(second, abs=1e-11) if inside else np.inf)
        assert judged.cost[k] == (judged.terms["of_sp2"][k] if first < 6.0 else np.inf)
    assert judged.collision_queries == 0


def test_a_collision_costs_inf_and_says_where() -> None:
    planner, problem = prepared()
    through = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # stretched out, across the box
    terms = planner.evaluate(problem, np.concatenate([problem.start, through, through]))
    assert terms["of_sp1"] == np.inf
    assert 1.0 <= terms["contact_position_sp1"] <= 10.0
    assert 1.0 <= terms["contact_link_sp1"] <= 7.0
    assert 1.0 <= terms["contact_obstacle_sp1"] <= 5.0
    assert terms["position_error_sp1"] == pytest.approx(
        math.dist(tip(through), (15.0, 5.0)), abs=1e-12
    )


@pytest.mark.examples(1)
@pytest.mark.parametrize("replicate", range(3))
def test_a_whole_run_keeps_its_promises(replicate: int) -> None:
    planner, problem = prepared()
    condition = composed("experiment=lavoie_7dof")
    best, searches = np.inf, []
    for generation in generations(planner.evolve(problem, condition.rng(replicate))):
        key = (generation.terms["attempts"], generation.terms["sub_path"])
        lowest = float(generation.costs.min())
        if not searches or searches[-1][0] != key:
            searches.append((key, [lowest]))
        else:
            searches[-1][1].append(lowest)
        assert generation.best_cost <= best
        assert generation.best_cost <= generation.best_cost_in_generation
        assert (generation.best_cost_in_generation == lowest) or key[1] == 1.0
        best = generation.best_cost
        low, high = problem.joint_limits.T
        assert (low <= generation.population.T).all()
        assert (high >= generation.population.T).all()
        new = sum(800 + 799 * (len(costs) - 1) for _, costs in searches)
        assert generation.evaluations == new
        assert generation.collision_queries == 10 * new
        assert generation.num_feasible == np.isfinite(generation.costs).sum()
    for (_, path), costs in searches:
        stop = 6.0 if path == 1.0 else 2.0
        assert all(a >= b for a, b in zip(costs, costs[1:], strict=False)), "elites"
        assert len(costs) <= 101
        assert all(cost >= stop for cost in costs[:-1]), "the search ends where it is good enough"
    assert len(searches) <= 20
    assert generation.solved
    assert generation.best_cost < 2.0
    terms = planner.evaluate(problem, generation.best)
    assert terms["of_sp1"] < 6.0
    assert terms["of_sp2"] == generation.best_cost
    assert terms["position_error_sp2"] < 2.0 - 0.7 * terms["joint_displacement_sp2_rad"]
    assert np.array_equal(generation.best[:7], problem.start)
    assert planner.motion(problem, generation.best).q.shape == (3, 7)
    x, y = tip(generation.best[14:])
    assert 16.0 <= x <= 23.0
    assert 2.0 <= y <= 11.0


@pytest.mark.examples(3)
@pytest.mark.parametrize(
    "overrides",
    [
        ("ga.selection=roulette",),
        ("ga.selection=rank",),
        ("ga.crossover=uniform",),
        ("ga.crossover=arithmetic",),
        ("ga.crossover=blx_alpha",),
        ("ga.mutation=gaussian",),
        ("ga.mutation=uniform_reset",),
        ("ga.mutation_scope=individual",),
        ("ga=lavoie_binary",),
        ("planner.success=finite",),
        ("collision.swept=none", "collision.num_positions=1"),
        ("ga.num_elites=0",),
        ("ga.num_elites=60",),
        ("ga.population_size=1", "ga.num_elites=0"),
        ("ga.population_size=2", "ga.num_elites=1"),
        ("ga.num_generations=0",),
        ("ga.crossover_rate=0", "ga.mutation_rate=0"),
        ("ga.crossover_rate=1", "ga.mutation_rate=1"),
        ("scenario.obstacles=[]",),
    ],
    ids=lambda o: " ".join(o),
)
def test_all_settings_run_and_the_best_never_gets_worse(overrides: tuple[str, ...]) -> None:
    given = {text.split("=")[0] for text in overrides}
    planner, problem = prepared(
        *(text for text in SMALL if text.split("=")[0] not in given), *overrides
    )
    best = np.inf
    for generation in generations(planner.evolve(problem, np.random.default_rng(3))):
        assert np.isfinite(generation.population).all()
        assert np.isfinite(generation.best).all()
        assert generation.best_cost <= best
        best = generation.best_cost
        terms = planner.evaluate(problem, generation.best)
        assert all(
            terms[name] == value for name, value in generation.terms.items() if name in terms
        )


def test_a_population_without_one_feasible_member_is_searched_on() -> None:
    """A box far away: nobody ever ends inside, so every plan costs inf.

    And all attempts are made.
    """
    planner, problem = prepared(*SMALL, "scenario.box_x=[60.0,61.0]", "planner.stop_cost_sp1=60")
    *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
    assert last.terms["attempts"] == 3.0
    assert last.best_cost == np.inf
    assert not last.solved
    assert math.isnan(last.mean_cost)
    assert last.index == 3 * (1 + 9) - 1
    terms = planner.evaluate(problem, last.best)
    assert terms["of_sp1"] < 60.0, "the best posture A, where the arm stays"
    assert np.array_equal(last.best[7:14], last.best[14:])


def test_success_by_threshold_and_by_finite_cost() -> None:
    strict, problem = prepared(*SMALL, "planner.stop_cost_sp2=0.001")
    *_, last = generations(strict.evolve(problem, np.random.default_rng(1)))
    assert not last.solved
    assert last.terms["attempts"] == 3.0
    lenient, problem = prepared(*SMALL, "planner.stop_cost_sp2=0.001", "planner.success=finite")
    *_, last = generations(lenient.evolve(problem, np.random.default_rng(1)))
    assert last.solved
    assert math.isfinite(last.best_cost)


def test_blind_arms_are_refuted_and_seeing_ones_mostly_not() -> None:
    verdicts = {}
    for blind in ("true", "false"):
        planner, problem = prepared(f"collision.blind={blind}")
        found = []
        for seed in range(6):
            *_, last = generations(planner.evolve(problem, np.random.default_rng(seed)))
            motion = planner.motion(problem, last.best)
            found.append(judge_motion(planner, problem, motion).certified)
            assert last.solved
        verdicts[blind] = found
    assert verdicts["true"].count(False) >= 4
    assert verdicts["false"].count(True) >= 4


def test_random_search_draws_pairs_of_postures() -> None:
    planner, problem = prepared()
    population = planner.sample(problem, np.random.default_rng(0), 300)
    judged = planner.cost(problem, population)
    assert population.shape == (2, 7, 300)
    assert judged.collision_queries == 2 * 10 * 300
    assert judged.named_terms(4)["of_sp1"] == judged.terms["of_sp1"][4]
    solution = planner.solution(problem, population, 4)
    assert np.array_equal(solution.reshape(3, 7)[1:], population[:, :, 4])
    terms = planner.evaluate(problem, solution)
    assert {name: terms[name] for name in judged.named_terms(4)} == judged.named_terms(4)


def test_the_arm_of_ten_joints_stands_before_the_moved_box() -> None:
    planner, problem = prepared(experiment="lavoie_10dof")
    assert problem.boxes[1].tolist() == [11.0, 18.0, -13.0, -4.0]
    assert problem.collision.obstacles.center[0].tolist() == [14.5, -4.0, 0.0]
    assert planner.shape(problem) == ((10,),) * 3


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            ("scenario=lavoie_10dof_literal", "robot=planar_10r"),
            "scenario.q_start: must be free of collision (link ",
        ),
        (
            ("scenario.q_start=[1.8,1.0]",),
            "scenario.q_start: must be one angle per joint (7), was 2",
        ),
        (
            ("scenario.q_start=[2.2,1,-1,-1,0,0,0]",),
            "scenario.q_start[0]: must be within the joint's limits, 0 to 2.1",
        ),
        (("scenario.box_x=[5,5]",), "box_x: must be [least, greatest]"),
        (("robot.joint_limits=null",), "robot.joint_limits: must be given"),
        (("robot.joint_limits=[[0,1]]",), "joint_limits: must be one pair per link (7), was 1"),
        (("robot=two_planar_2r",), "robot: must be one planar arm in the plane z = 0"),
        (("ga=rana_planar",), "ga: must be a SelectiveSettings"),
        (
            ("scenario=rana_planar",),
            "scenario: must be one that redundant_ga takes (PickAndPlace), was 'arm_motion'",
        ),
        (
            ("planner.success=maybe",),
            "planner.success: must be one of 'threshold' or 'finite', was 'maybe'",
        ),
        (("collision.num_positions=0",), "collision.num_positions: must be at least 1, was 0"),
    ],
)
def test_what_cannot_be_is_refused(overrides: tuple[str, ...], message: str) -> None:
    with pytest.raises(SettingError) as caught:
        prepared(*overrides)
    assert message in str(caught.value)


def test_a_solution_of_another_size_is_refused() -> None:
    planner, problem = prepared()
    with pytest.raises(ValueError, match="a solution has 21 values"):
        planner.evaluate(problem, np.zeros(20))
