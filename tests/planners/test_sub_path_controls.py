"""Draws, and the damped pseudoinverse, in the loop of Lavoie & Boudreau 2001: by plain steps."""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.errors import SettingError
from planners.runs import ran
from references import lavoie_numpy

ARMS = "lavoie_7dof", "lavoie_10dof"
SMALL = "ga.population_size=60", "ga.num_generations=3", "planner.num_attempts=2"
NEVER = "planner.stop_cost_sp1=100", "planner.stop_cost_sp2=1e-9"  # SP2 is searched to its end


def condition(*words: str, arm: str = ARMS[0]) -> Condition:
    return composed(f"experiment={arm}", "control=inverse_kinematics", *words)


def to_target(scene: lavoie_numpy.Scene, q: np.ndarray, sub_path: int) -> np.ndarray:
    """Return the way from the tips of postures (joints, …) to a target, (…, 2)."""
    angles = scene.turned + np.cumsum(q, axis=0)
    tips = [scene.base[k] + scene.lengths @ f(angles) for k, f in enumerate((np.cos, np.sin))]
    return scene.targets[sub_path] - np.stack(tips, axis=-1)


def descended(scene: lavoie_numpy.Scene, q: np.ndarray, sub_path: int) -> np.ndarray:
    """Step by Jᵀ (J Jᵀ + λ)⁻¹ e, the Jacobian by differences."""
    reach, step = scene.lengths.sum(), 1e-6 * np.eye(len(q))
    for _ in range(200):
        error = to_target(scene, q, sub_path)
        if np.linalg.norm(error) <= 1e-9 * reach:
            break
        apart = to_target(scene, q[:, None] - step, sub_path)
        apart -= to_target(scene, q[:, None] + step, sub_path)
        jacobian = apart.T / 2e-6
        square = jacobian @ jacobian.T + 1e-3 * reach**2 * np.eye(2)
        q = q + jacobian.T @ np.linalg.solve(square, error)
        q = np.clip(q, scene.low.ravel(), scene.high.ravel())
    return q


@pytest.mark.parametrize("arm", ARMS)
def test_individuals_are_the_postures_that_plain_steps_end_at(arm: str) -> None:
    """Between the start of the sub-path, whose descent comes first, and uniform postures."""
    chosen = condition(*SMALL, *NEVER, arm=arm)
    records, rng = ran(chosen, 5).records, np.random.default_rng(5)
    control: Any = chosen.planner
    scene = lavoie_numpy.Scene(chosen._replace(planner=control.planner))
    start, num_arrived = scene.start, 0
    assert [int(record.terms["sub_path"]) for record in records] == [1, 2, 2, 2, 2] * 2
    for index, record in enumerate(records):
        sub_path, count = int(record.terms["sub_path"]) - 1, record.population.shape[1]
        start = start if sub_path else scene.start
        drawn = rng.random((len(start), count))
        drawn = scene.low + (scene.high - scene.low) * drawn
        costs = scene.costs(sub_path, start, record.population)
        np.testing.assert_allclose(record.costs[0], costs, atol=1e-9)
        off = np.linalg.norm(to_target(scene, record.population, sub_path), axis=-1)
        arrived = off <= 1.001e-9 * scene.lengths.sum()
        num_arrived += arrived.sum()
        for k in (0, 1, count // 2, count - 1):
            share = k / (count - 1)
            plain = descended(scene, start + share * (drawn[:, k] - start), sub_path)
            if arrived[k]:
                np.testing.assert_allclose(record.population[:, k], plain, atol=1e-5)
        assert arrived[0]
        if sub_path == 0:
            start = record.population[:, np.argmin(record.costs)]
        assert record.evaluations == sum(r.population.shape[1] for r in records[: index + 1])
    assert num_arrived > 0.9 * records[-1].evaluations


@pytest.mark.parametrize("arm", ARMS)
def test_both_arms_are_brought_there_in_few_generations_again_and_again(arm: str) -> None:
    runs = [ran(condition("ga.population_size=200", arm=arm), 1) for _ in range(2)]
    last, again = (run.last for run in runs)
    assert last.solved and last.index < 10
    assert last.best_cost < 2.0
    assert runs[0].planner.departures(runs[0].problem, last.best) == []
    assert last.best.tobytes() == again.best.tobytes() and last.state == again.state


def test_bits_and_another_planner_are_refused_in_one_line() -> None:
    must = (
        "ga: must be a real_genetic, whose genes are joint angles, was [^\n]*binary_genetic[^\n]*$"
    )
    with pytest.raises(SettingError, match=must):
        condition("ga=lavoie_binary").prepare()
    must = "planner: must be redundant_ga, whose sub-paths inverse_kinematics draws, was [^\n]*$"
    with pytest.raises(SettingError, match=must):
        composed("experiment=chen_path", "control=inverse_kinematics")


def drawn(*overrides: str, experiment: str = "lavoie_7dof") -> Condition:
    small = ("ga.population_size=60", "ga.num_generations=8", "planner.num_attempts=3")
    return composed(f"experiment={experiment}", "control=sequential_search", *small, *overrides)


@pytest.mark.parametrize("stretch", [1, 3, 8])
@pytest.mark.parametrize(
    ("words", "solved"),
    [
        ("planner.stop_cost_sp1=16 planner.stop_cost_sp2=12", True),
        ("planner.stop_cost_sp1=9 planner.stop_cost_sp2=3", False),
        ("ga=lavoie_binary planner.stop_cost_sp1=16 ga.num_elites=3", False),
    ],
)
def test_it_draws_what_a_plain_loop_draws(
    words: str, solved: bool, stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many populations are drawn per call."""
    monkeypatch.setattr("evoexp.planners.redundant_ga.sub_path.STRETCH", stretch)
    given = drawn(*words.split())
    own: Any = given.planner
    records = ran(given, 1).records
    slow = given._replace(planner=own.planner)
    expected = list(lavoie_numpy.evolve(slow, np.random.default_rng(1), evolves=False))
    last = records[-1]
    assert last.solved == solved
    assert last.terms["attempts"] == expected[-1].attempt
    assert last.evaluations == sum(len(each.costs) for each in expected)
    assert last.best_cost == pytest.approx(expected[-1].best_cost, abs=1e-9)
    lowest = [record.costs.min() for record in records]
    np.testing.assert_allclose(lowest, [each.costs.min() for each in expected], atol=1e-9)


def test_without_offspring_nothing_is_drawn_after_the_first_population() -> None:
    records = ran(drawn("ga.num_elites=60")).records
    searches = {(record.terms["attempts"], record.terms["sub_path"]) for record in records}
    assert records[-1].evaluations == 60 * len(searches)
