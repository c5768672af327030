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
from matrix import num_cases
from planners.runs import ran

geometric = pytest.importorskip("ompl.geometric", reason="an extra")


def condition(*words: str) -> Condition:
    return composed("experiment=rrt_connect", *words, label="rana_planar")


def of(algorithm: str, *words: str, shortcuts: int | None = None) -> Condition:
    num = shortcuts if shortcuts is not None else 200 if algorithm == "RRTConnect" else 0
    ompl = "planner=ompl", "ga=ompl", "ga.num_generations=20", f"planner.algorithm={algorithm}"
    return condition(*ompl, f"planner.num_shortcuts={num}", *words)


@pytest.mark.parametrize(
    "algorithm", ["RRTConnect", "RRTstar", "InformedRRTstar", "BITstar", "PRMstar"]
)
def test_paths_are_free_between_start_and_goal_and_become_shorter(algorithm: str) -> None:
    run = ran(of(algorithm), 3)
    planner, problem, records = run
    pairs = list(itertools.pairwise(records))
    assert all(later.best_cost <= earlier.best_cost for earlier, later in pairs)
    least = 0 if algorithm == "PRMstar" else 1  # a milestone of a roadmap may take several chunks
    assert all(b.collision_queries - a.collision_queries >= least for a, b in pairs)
    if not run.last.solved:
        assert algorithm in ("RRTstar", "InformedRRTstar")
        assert planner.motion(problem, run.last.best) is None
        return
    path = run.last.best.reshape(-1, 4)
    assert np.array_equal(path[[0, -1]], [problem.start, problem.goal])
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert run.last.best_cost == pytest.approx(steps.sum())
    assert planner.evaluate(problem, run.last.best)["collisions"] == 0.0
    assert run.verdict().certified is not None


@pytest.mark.parametrize("algorithm", ["RRTConnect", "BITstar", "PRMstar"])
def test_a_seed_is_the_same_run_whatever_ran_before(algorithm: str) -> None:
    chosen = of(algorithm)
    assert chosen.reproducibility == "environment"
    one, other, again = (
        [(r.best_cost, r.collision_queries) for r in ran(chosen, seed).records]
        for seed in (1, 2, 1)
    )
    assert one == again
    assert [cost for cost, _ in one] != [cost for cost, _ in other]


def test_our_rrt_connect_is_no_other_than_ompls_in_distribution() -> None:
    """First path and its price of many runs each: OMPL steps alike, and joins trees alike.

    It asks for the ends of edges of the goal's tree twice.
    """
    count = num_cases(12, 60)
    kinds = (
        condition("planner.num_shortcuts=0", "ga.iterations_per_generation=1"),
        of("RRTConnect", "ga.queries_per_generation=500", shortcuts=0),
    )
    ours, theirs = ([ran(kind, seed).last for seed in range(count)] for kind in kinds)
    assert all(last.stop_reason == "solution" for last in [*ours, *theirs])
    deviation = math.sqrt((2 * count + 1) / 12.0) / count  # of the share, were they the same
    for name in ("best_cost", "collision_queries"):
        one, two = ([getattr(last, name) for last in lasts] for lasts in (ours, theirs))
        share = mannwhitneyu(one, two).statistic / count**2
        assert share == pytest.approx(0.5, abs=2.8 * deviation), name


def test_an_algorithm_that_this_package_lacks_is_one_line() -> None:
    """Python's OMPL 1.7 has AIT*, 2.0 has it not."""
    if hasattr(geometric, "AITstar"):
        assert ran(of("AITstar"), 1).last.solved
        return
    with pytest.raises(SettingError, match=r"planner\.algorithm: must be .* no AITstar in Python"):
        of("AITstar").prepare()


def test_what_cannot_be_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SettingError, match=r"planner\.num_shortcuts: must be 0: BITstar goes on"):
        of("BITstar", shortcuts=200).prepare()
    with pytest.raises(SettingError, match=r"planner\.algorithm: must be"):
        of("BitStar")
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
