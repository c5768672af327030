"""Controls on a planner's real coding: each beside an obvious version of itself."""

import importlib.util
from typing import Any

import cmaes
import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.numeric.elementary import standard_normal
from evoexp.planners.baselines.controls import real_vectors
from evoexp.records import generations

HAS_PYMOO = importlib.util.find_spec("pymoo") is not None


def control(name: str, *words: str, experiment: str = "rana_planar") -> Condition:
    given = [f"experiment={experiment}", f"control={name}", *words]
    return composed(*given)


def evolved(chosen: Condition, seed: int) -> list[Any]:
    planner, problem = chosen.prepare()
    found = generations(planner.evolve(problem, np.random.default_rng(seed)))
    return [each._replace(costs=each.costs.copy()) for each in found]


def test_vectors_are_the_numbers_that_differ_with_the_samples_mean_and_covariance() -> None:
    planner, problem = control("cma_es").prepare()
    drawn = planner.sample(problem, np.random.default_rng(0), 400)
    found = real_vectors(planner.planner, problem, drawn)
    assert found.changes.shape == (4, 21)
    assert np.array_equal(found.changes, np.pad(np.ones((4, 19), bool), ((0, 0), (1, 1))))
    inner = drawn[:, 1:-1].reshape(76, 400)
    distribution = found.distribution()
    assert distribution.mean == pytest.approx(inner.mean(axis=1))
    covariance = np.cov(inner, bias=True)
    scale = np.trace(covariance) / 76
    assert distribution.deviation == pytest.approx(np.sqrt(scale))
    assert np.diag(distribution.covariance) == pytest.approx(np.diag(covariance) / scale)
    apart = ~np.eye(76, dtype=bool)
    assert distribution.covariance[apart] == pytest.approx(0.9 * covariance[apart] / scale)
    again = found.population(inner.T)
    assert np.array_equal(again, drawn)


@pytest.mark.parametrize("improves", [True, False])
def test_cma_es_is_the_package_told_the_planners_costs(improves: bool) -> None:
    chosen = control("cma_es", "ga.num_generations=12", f"control.improves={improves}")
    planner, problem = chosen.prepare()
    rng = np.random.default_rng(5)
    vectors = real_vectors(planner.planner, problem, planner.sample(problem, rng, 1000))
    start = vectors.distribution()
    plain = cmaes.CMA(
        start.mean,
        start.deviation,
        cov=start.covariance,
        seed=int(rng.integers(2**32)),
        population_size=48,
    )
    for record in evolved(chosen, 5):
        asked = [plain.ask() for _ in range(48)]
        strings = np.zeros((4, 21, 48))
        strings[:, 0], strings[:, -1] = problem.start[:, None], problem.goal[:, None]
        for k, vector in enumerate(asked):
            strings[:, 1:-1, k] = vector.reshape(4, 19)
        if improves:
            strings = planner.planner.improve(problem, strings, rng)
        costs = planner.planner.cost(problem, strings).cost
        assert record.costs == pytest.approx(costs)
        plain.tell(list(zip(asked, costs.tolist(), strict=True)))
    assert record.evaluations == 13 * 48


def test_chains_keep_what_a_step_and_a_local_search_make_cheaper() -> None:
    chosen = control(
        "iterated_local_search", "ga.num_generations=9", "control.sigma=1", "control.num_chains=5"
    )
    planner, problem = chosen.prepare()
    rng = np.random.default_rng(4)
    drawn = planner.sample(problem, rng, 1000)
    first, *later = evolved(chosen, 4)
    chains = [
        (cost, s) for cost, s in zip(first.costs, planner.sample(problem, rng, 50).T, strict=True)
    ]
    chains = sorted(chains, key=lambda chain: chain[0])[:5]
    for record in later:
        one, other = rng.integers(1000, size=(2, 48))
        sizes = 0.01 ** rng.random(48) / np.sqrt(2.0)
        tried = [
            chains[k % 5][1].T + s * (drawn[:, :, a] - drawn[:, :, b])
            for k, (s, a, b) in enumerate(zip(sizes, one, other, strict=True))
        ]
        strings = planner.planner.improve(problem, np.stack(tried, axis=-1), rng)
        costs = planner.cost(problem, strings).cost
        assert record.costs == pytest.approx(costs)
        for k in range(5):
            best = min(range(k, 48, 5), key=lambda i: costs[i])
            if costs[best] <= chains[k][0]:
                chains[k] = costs[best], strings[:, :, best].T
        assert record.best_cost == pytest.approx(min(cost for cost, _ in chains))


def test_noisy_trajectories_move_by_their_weighted_mean() -> None:
    chosen = control("stomp", "ga.num_generations=15", "control.sensitivity=7", "control.sigma=0.5")
    planner, problem = chosen.prepare()
    rng = np.random.default_rng(2)
    vectors = real_vectors(planner.planner, problem, planner.sample(problem, rng, 1000))
    start = vectors.distribution()
    root = np.linalg.cholesky(start.covariance) * start.deviation
    middle, sigma = start.mean, 0.5
    for record in evolved(chosen, 2):
        normals = standard_normal(rng, (48, 76))
        noise = [np.zeros(76), *(sigma * (root @ each) for each in normals[1:])]
        strings = vectors.population(np.array([middle + each for each in noise]))
        costs = planner.cost(problem, strings).cost
        assert record.costs == pytest.approx(costs)
        scaled = (costs - costs.min()) / (costs.max() - costs.min())
        weights = np.exp(-7.0 * scaled)
        middle = middle + sum(w * e for w, e in zip(weights, noise, strict=True)) / weights.sum()
        sigma *= 0.99
    assert record.index == 15


@pytest.mark.skipif(not HAS_PYMOO, reason="an extra")
def test_nsga2_is_the_package_told_the_terms_of_the_planner() -> None:
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem

    chosen = control("nsga2", "ga.num_generations=8", "control.num_drawn=300")
    planner, problem = chosen.prepare()
    rng = np.random.default_rng(6)
    drawn = planner.sample(problem, rng, 300)
    inner = drawn[:, 1:-1].reshape(76, 300)
    box = Problem(n_var=76, n_obj=3, xl=inner.min(axis=1), xu=inner.max(axis=1))
    plain = NSGA2(pop_size=48, sampling=inner.T[:48], eliminate_duplicates=False)
    plain.setup(box, termination=("n_gen", 99), seed=int(rng.integers(2**32)), verbose=False)
    cheapest = np.inf
    for record in evolved(chosen, 6):
        asked = plain.ask()
        strings = drawn[:, :, :48].copy()
        strings[:, 1:-1] = asked.get("X").T.reshape(4, 19, 48)
        judged = planner.cost(problem, strings)
        terms = [judged.named_terms(k) for k in range(48)]
        values = [
            [
                t["length_arm_1_deg"] + t["length_arm_2_deg"],
                t["unevenness_arm_1_deg"] + t["unevenness_arm_2_deg"],
                t["collisions"],
            ]
            for t in terms
        ]
        asked.set("F", np.array(values))
        plain.tell(infills=asked)
        assert record.costs == pytest.approx(judged.cost)
        cheapest = min(cheapest, judged.cost.min())
        assert record.best_cost == cheapest
    assert record.index == 8


def test_objectives_are_names_of_terms() -> None:
    must = r"control\.objectives\[1\]: must be the begin of a term .*collisions.*, was 'colisions'"
    with pytest.raises(SettingError, match=must):
        control("nsga2", "control.objectives=[length, colisions]").prepare()
    with pytest.raises(SettingError, match=r"control\.objectives: must be a list of at least 2"):
        control("nsga2", "control.objectives=[length]").prepare()


def test_weights_of_infeasible_and_of_equal_costs() -> None:
    planner = control("stomp").planner
    assert planner.weights(np.array([3.0, np.inf, 3.0])) == pytest.approx([0.5, 0.0, 0.5])
    assert planner.weights(np.full(4, np.inf)) == pytest.approx([0.25] * 4)
    found = planner.weights(np.array([1.0, 2.0]))
    assert found[1] / found[0] == pytest.approx(np.exp(-10.0))


def test_without_a_better_trajectory_the_search_starts_anew() -> None:
    patient = evolved(control("stomp", "ga.num_generations=60", "control.patience=1000"), 3)
    hasty = evolved(control("stomp", "ga.num_generations=60", "control.patience=1"), 3)
    lowest = [each.best_cost for each in patient]
    anew = next(k for k in range(2, 60) if lowest[k] == lowest[k - 1] == lowest[k - 2]) + 1
    same = [np.array_equal(a.costs, b.costs) for a, b in zip(patient, hasty, strict=True)]
    assert same.index(False) == anew
    assert hasty[anew].costs.min() > lowest[anew]
