"""Search that accepts proven motions only: every answer is one, and nothing else changes."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.proofs import Proofs, judge_motion
from evoexp.planners.via_point_ga.search import settle
from evoexp.records import generations
from evoexp.store.log_reader import read_log


def condition(*words: str, experiment: str = "rana_planar") -> Condition:
    return composed(f"experiment={experiment}", *words)


def evolved(chosen: Condition, seed: int) -> list[Any]:
    planner, problem = chosen.prepare()
    return list(generations(planner.evolve(problem, np.random.default_rng(seed))))


def is_proven(chosen: Condition, solution: Any) -> bool:
    planner, problem = chosen.prepare()
    return judge_motion(planner, problem, planner.motion(problem, solution)).certified is True


def test_the_cheapest_free_strings_are_judged_until_one_is_proven(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    planner, problem = condition("planner.acceptance=certified").prepare()
    proofs, asked = Proofs(planner, problem), []

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


def test_a_verdict_is_asked_for_once() -> None:
    planner, problem = condition("planner.acceptance=certified").prepare()
    solution = planner.solution(problem, planner.sample(problem, np.random.default_rng(0), 1), 0)
    proofs = Proofs(planner, problem)
    assert proofs.is_proven(solution) == proofs.is_proven(solution.copy())
    assert proofs.num_certificates == 1


@pytest.mark.parametrize(
    "control", ["null", "cma_es", "stomp", "random_search", "multi_start", "nsga2"]
)
def test_every_answer_is_proven(control: str) -> None:
    words = f"control={control}", "planner.acceptance=certified", "ga.num_generations=300"
    chosen = condition(*words)
    records = evolved(chosen, 1)
    for before, record in itertools.pairwise(records):
        assert record.best_cost <= before.best_cost
        assert record.solved == math.isfinite(record.best_cost)
        if record.solved and record.best is not before.best:
            assert is_proven(chosen, record.best)
    assert records[-1].solved or control in ("stomp", "nsga2")


def test_what_the_papers_model_lets_through_is_no_answer() -> None:
    """CMA-ES finds motions that are free at all via-points, and touch between them."""
    words = "control=cma_es", "ga.num_generations=300"
    trusting, proving = (
        condition(*words, f"planner.acceptance={each}") for each in ("model", "certified")
    )
    last = evolved(trusting, 0)[-1]
    assert last.solved
    assert not is_proven(trusting, last.best)
    proven = evolved(proving, 0)[-1]
    assert not proven.solved or is_proven(proving, proven.best)
    assert proven.best_cost > last.best_cost


def test_margins_can_be_asked_for() -> None:
    chosen = condition("planner.acceptance=margin", "scenario.security_margin=0.02")
    last = evolved(chosen, 0)[-1]
    planner, problem = chosen.prepare()
    found = judge_motion(planner, problem, planner.motion(problem, last.best))
    assert last.solved
    assert found.certified_margin


def test_covered_bodies_are_proven_too() -> None:
    words = "ga.num_generations=4", "planner.acceptance=certified", "ga.population_size=40"
    chosen = condition(*words, "planner.num_new_trajectories=8", experiment="motionbenchmaker")
    for record in evolved(chosen, 0):
        assert not record.solved or is_proven(chosen, record.best)


@pytest.mark.parametrize("experiment", ["rana_planar", "rrt_connect", "chen_path"])
def test_the_default_is_the_model_and_no_part_of_the_identity(experiment: str) -> None:
    plain, named, proving = (
        condition(*words, experiment=experiment)
        for words in ((), ("planner.acceptance=model",), ("planner.acceptance=certified",))
    )
    assert plain.id == named.id != proving.id
    assert b"acceptance" not in plain.to_json()


def test_the_log_of_a_proven_search_counts_its_certificates(tmp_path: Any) -> None:
    path = tmp_path / "0000.mcap"
    proving = condition("planner.acceptance=certified", "ga.num_generations=400")
    path.write_bytes(run_replicate(proving, 0).content)
    log = read_log(path)
    assert log.summary.certified
    assert log.generations[-1].terms["certificates"] >= 1.0


def test_other_words_are_refused() -> None:
    with pytest.raises(SettingError, match=r"planner\.acceptance: must be"):
        condition("planner.acceptance=proven")
