"""Planners by their proven answers: lengths, efforts and shares against plain counts."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline

from evoexp.errors import NothingStored
from evoexp.paths.motion import Motion, spline_motion
from evoexp.planners.proofs import judge_motion
from evoexp.report.figures.effort_curves import draw_shares, length_table, share_table
from evoexp.report.pages import comparison
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import proven_answers
from evoexp.report.results.planner_runs import MULTIPLES, PlannerRuns, Problem, of_results
from evoexp.report.results.proven_answers import answers_of, motion_length, straight_line
from evoexp.report.results.stored_results import Results, gather
from evoexp.store.log_reader import read_log
from report_samples import expand, store


@pytest.mark.parametrize("seed", range(5))
def test_lengths_are_those_of_many_short_steps(seed: int) -> None:
    q = np.random.default_rng(seed).normal(size=(6, 3))
    smooth = spline_motion(CubicSpline(np.arange(6.0), q))
    for motion in (Motion(q), smooth):
        points = np.array([motion.at(t) for t in np.linspace(0.0, 5.0, 20_001)])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        assert motion_length(motion) == pytest.approx(steps, rel=1e-4)
    assert motion_length(Motion(q)) <= motion_length(smooth) + 1e-9  # through the same points


def test_answers_are_the_logged_improvements_judged(results: Results) -> None:
    for condition in results.with_data:
        found = answers_of([condition])[condition.label]
        assert found.equals(
            answers_of([condition])[condition.label]
        )  # the second time out of the cache
        planner, problem = condition.prepared
        for k, own in found.groupby("replicate"):
            summary, last = condition.summaries.loc[k], own.iloc[-1]
            assert (last["certified"], last["solved"]) == (summary["certified"], summary["solved"])
            assert own["collision_queries"].is_monotonic_increasing
            assert last["collision_queries"] <= summary["collision_queries"]
            motion = planner.motion(problem, condition.solutions[int(str(k))])
            assert motion is not None
            assert last["length"] == motion_length(motion) >= last["straight"] - 1e-9
            assert bool(judge_motion(planner, problem, motion).certified) == last["certified"]


def test_answers_of_many_runs_are_those_of_each(
    results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proven_answers, "cache_root", lambda: tmp_path)  # judged anew
    monkeypatch.setattr(proven_answers, "WORTH_WORKERS", 1)
    together = answers_of(results.evolved)
    assert list(together) == [c.label for c in results.evolved]
    kept = {path.name for path in (tmp_path / "answers").iterdir()}
    assert len(kept) == sum(c.done for c in results.evolved)
    for c in results.evolved:
        logs = {int(k): read_log(c.run.log_path(int(k))) for k in c.summaries.index}
        rows = [
            (k, *row, log.cpu_s[row[0]])
            for k, log in logs.items()
            for row in proven_answers._judged(c.run.log_path(k))
        ]
        assert together[c.label].to_numpy().tolist() == [list(row) for row in rows]
        assert together[c.label].equals(answers_of([c])[c.label])


TABLE = pd.DataFrame(
    {
        "replicate": [0, 0, 0, 2],
        "collision_queries": [10, 20, 30, 15],
        "length": [5.0, 4.0, 2.0, 3.0],
        "straight": [2.0, 2.0, 2.0, 2.0],
        "certified": [True, False, True, True],
    }
)


def test_an_answer_that_is_not_proven_counts_for_nothing() -> None:
    spent = np.array([100.0, 200.0, 300.0])
    runs = PlannerRuns("", Problem("p"), "", TABLE, (0, 1, 2), spent, None)
    effort, reached = runs.first_reached()
    assert (effort.tolist(), reached.tolist()) == ([10.0, 200.0, 15.0], [True, False, True])
    effort, reached = runs.first_reached(4.0)
    assert (effort.tolist(), reached.tolist()) == ([30.0, 200.0, 15.0], [True, False, True])
    assert runs.best_lengths.tolist() == [2.0, np.inf, 3.0]
    assert straight_line(TABLE) == 2.0
    assert np.isnan(straight_line(TABLE.assign(straight=[1.0, 2.0, 2.0, 2.0])))


def test_shares_are_counts_of_targets(results: Results) -> None:
    found = answers_of(results.evolved)
    table = share_table(of_results(results.evolved))
    for condition in results.evolved:
        own, line = found[condition.label], straight_line(found[condition.label])
        curve = table[table["planner"] == condition.label]
        assert curve["targets"].unique().tolist() == [len(MULTIPLES) * condition.done]
        assert curve["share"].is_monotonic_increasing
        for x, share in zip(curve["collision_queries"], curve["share"], strict=True):
            good = own[own["certified"] & (own["collision_queries"] <= x)]
            count = sum(
                bool((good[good["replicate"] == k]["length"] <= target * line).any())
                for k in condition.summaries.index
                for target in MULTIPLES
            )
            assert share == pytest.approx(count / curve["targets"].iloc[0])
    (axes,) = draw_shares(table).axes
    labels = [line.get_label() for line in axes.get_lines()]
    assert [str(label).partition(" (")[0] for label in labels] == [c.label for c in results.evolved]


def test_the_last_median_is_that_of_the_best_lengths(results: Results) -> None:
    runs = of_results(results.evolved)
    table = length_table(runs)
    for own in runs:
        last = table[table["planner"] == own.label].iloc[-1]
        assert last["median"] == pytest.approx(np.median(own.best_lengths))


def test_the_page_tells_every_condition_and_every_pair(
    results: Results, settings: ReportSettings
) -> None:
    page = comparison.page(results, settings)
    assert [row[0] for row in page.tables[1].rows] == [c.label for c in results.evolved]
    assert "Planners are not ranked" in page.tables[0].note  # one problem
    count = len(results.evolved)
    assert len(page.comparisons[0][1]) == count * (count - 1) // 2
    assert [drawing.stem for drawing in page.drawings] == ["targets_reached", "proven_lengths"]


def test_planners_of_several_problems_are_named_by_their_components(
    stored: Path, settings: ReportSettings
) -> None:
    both = [expand("rana_planar"), expand("rana_three_arms", "scenario=rana_three_arms")]
    conditions = [(f"{e.name}: {label}", c) for e in both for label, c in e.conditions]
    results = gather(stored, conditions, None, "", "", "")
    page = comparison.page(results, settings)
    assert [drawing.stem for drawing in page.drawings] == [
        "targets_reached",
        "targets_by_problem",
    ]
    assert [table.heading for table in page.tables] == [
        "Problems",
        "Answers",
        "The same in other coins",
    ]  # no problem has all planners
    names = set(page.drawings[0].table()["planner"])
    assert all(name.startswith(("via_point_ga", "random_search", "multi_start")) for name in names)


def test_answers_that_are_no_motions_are_not_compared(
    tmp_path: Path, settings: ReportSettings
) -> None:
    experiment = expand("chen_landscapes")  # postures
    store(tmp_path, experiment)
    results = gather(tmp_path, experiment.conditions, None, experiment.name, "smoke", "")
    with pytest.raises(NothingStored, match="no stored solution is a motion"):
        comparison.page(results, settings)


def test_effort_in_other_coins(stored: Path, settings: ReportSettings) -> None:
    conditions = list(expand("rana_planar").conditions)
    results = gather(stored, conditions, None, "", "", "")
    rows = comparison.rated(of_results(results.evolved, {}), settings)
    assert len(rows) == len(results.evolved)
    for row, condition in zip(rows, results.evolved, strict=True):
        assert row.body_tests == 9 * 9  # circles on two arms
        if row.proven:
            spent = {"evaluations": 0.0, "cpu_s": 0.0}
            for k in condition.summaries.index:
                whole = condition.summaries.loc[k]
                own = answers_of([condition])[condition.label].query(
                    "replicate == @k and certified"
                )
                last = whole if own.empty else own.iloc[0]
                spent["evaluations"] += last["evaluations"]
                own_s = whole["cpu_s"] - whole["certificate_s"]
                spent["cpu_s"] += own_s if own.empty else last["cpu_s"]
            assert row.evaluations == spent["evaluations"] / row.proven
            assert row.cpu_s == pytest.approx(spent["cpu_s"] / row.proven)
            assert 0.0 < row.cpu_s <= condition.column("cpu_s").sum() / row.proven
        assert row.own_cost.median == np.median(condition.column("best_cost"))
