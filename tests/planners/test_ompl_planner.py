"""Planners of OMPL on our edges: free paths, seeds, distribution beside our own RRT-Connect."""

import importlib.util
import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

from composed import composed
from evoexp.cli import main
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations
from matrix import num_cases

geometric = pytest.importorskip("ompl.geometric", reason="an extra")
OMPL = ("planner=ompl", "ga=ompl", "ga.num_generations=20")
ANYTIME = ("RRTstar", "InformedRRTstar", "BITstar", "PRMstar")


def condition(*words: str, label: str = "rana_planar") -> Condition:
    return composed("experiment=rrt_connect", *words, label=label)


def ran(chosen: Condition, seed: int) -> tuple[Any, Any, list[Any]]:
    planner, problem = chosen.prepare()
    return planner, problem, list(generations(planner.evolve(problem, np.random.default_rng(seed))))


def of(algorithm: str, *words: str, shortcuts: int = 200) -> Condition:
    num = shortcuts if algorithm == "RRTConnect" else 0
    chosen = f"planner.algorithm={algorithm}", f"planner.num_shortcuts={num}"
    return condition(*OMPL, *chosen, *words)


@pytest.mark.parametrize("algorithm", ["RRTConnect", *ANYTIME])
def test_paths_are_free_between_start_and_goal_and_become_shorter(algorithm: str) -> None:
    planner, problem, records = ran(of(algorithm), 3)
    costs = [record.best_cost for record in records]
    assert all(later <= earlier for earlier, later in itertools.pairwise(costs))
    queries = [record.collision_queries for record in records]
    least = 0 if algorithm == "PRMstar" else 1  # a milestone of a roadmap may take several chunks
    assert all(later - earlier >= least for earlier, later in itertools.pairwise(queries))
    last = records[-1]
    if not last.solved:
        assert algorithm in ("RRTstar", "InformedRRTstar")
        assert planner.motion(problem, last.best) is None
        return
    path = last.best.reshape(-1, 4)
    assert np.array_equal(path[[0, -1]], [problem.start, problem.goal])
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert last.best_cost == pytest.approx(steps.sum())
    assert planner.evaluate(problem, last.best)["collisions"] == 0.0
    assert judge_motion(planner, problem, planner.motion(problem, last.best)).certified is not None


@pytest.mark.parametrize("algorithm", ["RRTConnect", "BITstar", "PRMstar"])
def test_a_seed_is_the_same_run_whatever_ran_before(algorithm: str) -> None:
    chosen = of(algorithm)
    assert chosen.reproducibility == "environment"
    one, other, again = (ran(chosen, seed)[2] for seed in (1, 2, 1))
    assert [r.best_cost for r in one] == [r.best_cost for r in again]
    assert [r.collision_queries for r in one] == [r.collision_queries for r in again]
    assert [r.best_cost for r in one] != [r.best_cost for r in other]


def test_our_rrt_connect_is_no_other_than_ompls_in_distribution() -> None:
    """First path and its price of many runs each: OMPL steps alike, and joins trees alike.

    It asks for the ends of edges of the goal's tree twice.
    """
    plain, count = "planner.num_shortcuts=0", num_cases(12, 60)
    ours = [ran(condition(plain, "ga.iterations_per_generation=1"), s)[2][-1] for s in range(count)]
    theirs = [
        ran(of("RRTConnect", "ga.queries_per_generation=500", shortcuts=0), s) for s in range(count)
    ]
    deviation = math.sqrt((2 * count + 1) / 12.0) / count  # of the share, were they the same
    lasts = [records[-1] for _, _, records in theirs]
    assert all(record.stop_reason == "solution" for record in [*ours, *lasts])
    for name in ("best_cost", "collision_queries"):
        one, two = ([getattr(r, name) for r in runs] for runs in (ours, lasts))
        share = mannwhitneyu(one, two).statistic / count**2
        assert share == pytest.approx(0.5, abs=2.8 * deviation), name


def test_algorithms_that_shorten_by_themselves_take_no_shortcuts() -> None:
    with pytest.raises(SettingError, match=r"planner\.num_shortcuts: must be 0: BITstar goes on"):
        condition(*OMPL, "planner.algorithm=BITstar").prepare()


def test_an_unknown_algorithm_is_one_line() -> None:
    with pytest.raises(SettingError, match=r"planner\.algorithm: must be"):
        condition(*OMPL, "planner.algorithm=BitStar")


def test_an_algorithm_that_this_package_lacks_is_one_line() -> None:
    """Python's OMPL 1.7 has AIT*, 2.0 has it not."""
    chosen = of("AITstar")
    if hasattr(geometric, "AITstar"):
        assert ran(chosen, 1)[2][-1].solved
        return
    with pytest.raises(SettingError, match=r"planner\.algorithm: must be .* no AITstar in Python"):
        chosen.prepare()


@pytest.mark.parametrize("algorithm", ["RRTConnect", "BITstar", "PRMstar"])
def test_by_proof_every_answer_is_proven(algorithm: str) -> None:
    coarse = "collision.collision_substeps=1", "planner.range=60", "ga.queries_per_generation=100"
    refuted = 0
    for acceptance in ("model", "certified"):
        chosen = of(algorithm, *coarse, f"planner.acceptance={acceptance}")
        for seed in range(3):
            planner, problem, records = ran(chosen, seed)
            for record in (each for each in records if each.solved):
                found = judge_motion(planner, problem, planner.motion(problem, record.best))
                assert found.certified or acceptance == "model"
                refuted += found.certified is False
            asked = records[-1].terms.get("certificates", 0.0)
            assert (asked > 0.0) == (acceptance == "certified")
    assert refuted > 0 or algorithm == "PRMstar"  # whose paths stay clear of both arms here


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(SettingError, match=r"needs pip install 'evoexp\[baselines\]'"):
        of("RRTConnect", "seed=77").prepare()


def test_rows_that_need_the_package_are_skipped_with_a_note(
    monkeypatch: pytest.MonkeyPatch, capsys: Any, tmp_path: Path
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    given = ["experiment=arena_ompl", "budget=smoke", "num_replicates=1", "--no-report"]
    only = ["--only", "rana_planar · RRT-Connect,rana_planar · BIT* (OMPL)"]
    assert main(["run", *given, *only]) == 0
    said = capsys.readouterr().out
    assert "skipped: rana_planar · BIT* (OMPL): ompl needs pip install 'evoexp[baselines]'" in said
    assert len(list((tmp_path / "runs").iterdir())) == 1
    assert main(["run", *given, "--only", "rana_planar · BIT* (OMPL)"]) == 2
    assert "evoexp: planner: must be one that is installed: ompl needs" in capsys.readouterr().err
