"""Planners by their proven answers, and ranks over problems, against printed and plain numbers."""

import csv
import io
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import CubicSpline

from evoexp.errors import NothingStored
from evoexp.paths.motion import Motion, spline_motion
from evoexp.planners.answers import judge_motion
from evoexp.report.figures import effort_curves
from evoexp.report.pages import comparison
from evoexp.report.pages.comparison import Rated, as_csv
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import planner_runs
from evoexp.report.results.stored_results import Results, gather
from evoexp.report.statistics.inference import Interval, Spread
from evoexp.store.log_reader import read_log
from report_samples import expand, made_up_runs, store

SOME = [
    planner_runs.Answer(0, 0, 50, 1000, 9.0, 4.0, True, False),
    planner_runs.Answer(0, 3, 200, 4000, 6.0, 4.0, True, True),
    planner_runs.Answer(0, 7, 400, 8000, 5.0, 4.0, True, True),
    planner_runs.Answer(2, 1, 100, 2000, 7.0, 4.0, False, True),
]


@pytest.fixture
def both(stored: Path) -> Results:
    """Return two problems with two planners and one, by labels that tell both."""
    planar, arms = expand("rana_planar"), expand("rana_three_arms", "scenario=rana_three_arms")
    (_, ga), (_, search) = planar.conditions[:2]
    labels = [("small: two arms · GA", ga), ("small: two arms · draws", search)]
    labels += [("small: three arms · GA", arms.conditions[0][1])]
    return gather(stored, labels, None, "", "", "")


def names(runs: list[planner_runs.PlannerRuns]) -> list[tuple[str, str]]:
    return [(own.planner, own.problem.name) for own in runs]


def test_labels_that_tell_problem_and_planner_name_both(both: Results) -> None:
    want = [("GA", "two arms"), ("draws", "two arms"), ("GA", "three arms")]
    assert names(planner_runs.of_results(both.evolved)) == want


def test_a_problem_whose_labels_share_nothing_is_named_by_its_scenario(both: Results) -> None:
    labels = ("plain", "with draws", "three arms: three arms")
    other = [replace(c, label=label) for c, label in zip(both.evolved, labels, strict=True)]
    assert names(planner_runs.of_results(other)) == [
        ("via_point_ga", "rana_planar"),
        ("random_search", "rana_planar"),
        ("via_point_ga", "three arms"),
    ]
    unlabelled = [
        replace(c, label=label, options=()) for c, label in zip(other, "aba", strict=True)
    ]
    scenario = both.evolved[0].condition.scenario.component
    assert {n for _, n in names(planner_runs.of_results(unlabelled))} == {
        f"{scenario} 1",
        f"{scenario} 2",
    }


def test_a_name_that_stands_for_two_components_names_no_planner(both: Results) -> None:
    labels = ("small: two arms · GA", "small: two arms · B", "small: three arms · B")
    other = [replace(c, label=label) for c, label in zip(both.evolved, labels, strict=True)]
    found = [planner for planner, _ in names(planner_runs.of_results(other))]
    assert found == ["via_point_ga", "random_search", "via_point_ga"]


def test_an_answer_that_is_not_proven_counts_for_nothing() -> None:
    table, spent = planner_runs.answer_table(SOME), np.array([9000.0, 9100.0, 9200.0])
    assert tuple(table.columns) == planner_runs.Answer._fields
    assert list(planner_runs.answer_table([]).dtypes) == list(table.dtypes)
    runs = planner_runs.PlannerRuns(
        "", planner_runs.Problem("p"), "", table, (0, 1, 2), spent, None
    )
    assert runs.best_lengths.tolist() == [5.0, np.inf, 7.0]
    for most, first in ((np.inf, [4000.0, 9100.0, 2000.0]), (5.5, [8000.0, 9100.0, 9200.0])):
        effort, reached = runs.first_reached(most)
        assert effort.tolist() == first
        assert reached.tolist() == [True, False, most > 7.0]
    assert planner_runs.straight_line(table) == 4.0
    assert np.isnan(planner_runs.straight_line(table.assign(straight=[1.0, 2.0, 2.0, 2.0])))


@pytest.mark.parametrize("seed", range(3))
def test_lengths_are_those_of_many_short_steps(seed: int) -> None:
    q = np.random.default_rng(seed).normal(size=(6, 3))
    smooth = spline_motion(CubicSpline(np.arange(6.0), q))
    for motion in (Motion(q), smooth):
        points = np.array([motion.at(t) for t in np.linspace(0.0, 5.0, 20_001)])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        assert planner_runs.motion_length(motion) == pytest.approx(steps, rel=1e-4)


def test_answers_are_the_logged_improvements_judged(
    results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planner_runs, "cache_root", lambda: tmp_path)  # judged anew
    monkeypatch.setattr(planner_runs, "WORTH_WORKERS", 1)
    together = planner_runs.answers_of(results.evolved)
    assert list(together) == [c.label for c in results.evolved]
    assert len([*(tmp_path / "answers").iterdir()]) == sum(c.done for c in results.evolved)
    for condition in results.evolved:
        found, (planner, problem) = together[condition.label], condition.prepared
        assert found.equals(
            planner_runs.answers_of([condition])[condition.label]
        )  # out of the cache
        for k, own in found.groupby("replicate"):
            log, summary = read_log(condition.run.log_path(k)), condition.summaries.loc[k]
            assert own["cpu_s"].tolist() == [log.cpu_s[index] for index in own["generation"]]
            assert own["collision_queries"].is_monotonic_increasing
            last, motion = own.iloc[-1], planner.motion(problem, condition.solutions[k])
            assert last["collision_queries"] <= summary["collision_queries"]
            assert (last["certified"], last["solved"]) == (summary["certified"], summary["solved"])
            assert bool(judge_motion(planner, problem, motion).certified) == last["certified"]
            assert last["length"] == planner_runs.motion_length(motion) >= last["straight"] - 1e-9


def test_shares_are_counts_of_targets_and_the_last_median_is_of_the_best(results: Results) -> None:
    runs = planner_runs.of_results(results.evolved)
    table, lengths = (
        effort_curves.share_table(runs),
        effort_curves.length_table(runs).groupby("planner")["median"].last(),
    )
    for own, condition in zip(runs, results.evolved, strict=True):
        assert lengths[own.label] == pytest.approx(np.median(own.best_lengths))
        answers = own.table[own.table["certified"]]
        targets = np.array(planner_runs.MULTIPLES) * planner_runs.straight_line(own.table)
        curve = table[table["planner"] == own.label]
        assert curve["targets"].unique().tolist() == [len(planner_runs.MULTIPLES) * condition.done]
        for x, share in zip(curve["collision_queries"], curve["share"], strict=True):
            good = answers[answers["collision_queries"] <= x].groupby("replicate")["length"].min()
            count = (good.to_numpy()[:, None] <= targets).sum()
            assert share == pytest.approx(count / curve["targets"].iloc[0])
    labels = [
        str(line.get_label()) for line in effort_curves.draw_shares(table).axes[0].get_lines()
    ]
    assert [label.partition(" (")[0] for label in labels] == [own.label for own in runs]


def test_shares_of_all_problems_are_the_mean_of_those_of_each(both: Results) -> None:
    runs = planner_runs.of_results(both.evolved)
    table = effort_curves.problem_share_table(runs).astype(
        {"collision_queries": float, "share": float}
    )
    pooled = effort_curves.share_table(runs, table["collision_queries"].unique()).groupby("planner")
    for planner, own in table.groupby("planner"):
        weighted = (own["share"] * own["targets"]).groupby(own["collision_queries"]).sum()
        total = own.groupby("problem")["targets"].first().sum()
        shown = pooled.get_group(planner)["share"].astype(float)
        assert np.allclose(weighted.to_numpy() / total, shown)
    axes = effort_curves.draw_shares_by_problem(table).axes
    titles = [each.get_title(loc="left") or each.get_title() for each in axes]
    assert titles == list(table["problem"].unique())
    assert len({each.get_xlim() for each in axes}) == 1


def test_the_page_tells_every_condition_and_every_pair(
    results: Results, settings: ReportSettings
) -> None:
    page, count = comparison.page(results, settings), len(results.evolved)
    assert [row[0] for row in page.tables[1].rows] == [c.label for c in results.evolved]
    assert "Planners are not ranked" in page.tables[0].note  # one problem
    assert len(page.comparisons[0][1]) == count * (count - 1) // 2
    assert [drawing.stem for drawing in page.drawings] == ["targets_reached", "proven_lengths"]


def test_planners_of_several_problems_are_named_by_their_components(
    stored: Path, settings: ReportSettings
) -> None:
    several = [expand("rana_planar"), expand("rana_three_arms", "scenario=rana_three_arms")]
    conditions = [(f"{e.name}: {label}", c) for e in several for label, c in e.conditions]
    page = comparison.page(gather(stored, conditions, None, "", "", ""), settings)
    assert [drawing.stem for drawing in page.drawings] == ["targets_reached", "targets_by_problem"]
    headings = [table.heading for table in page.tables]  # no problem has all planners
    assert headings == ["Problems", "Answers", "Other measures of effort and cost"]
    planners = set(page.drawings[0].table()["planner"])
    assert all(p.startswith(("via_point_ga", "random_search", "multi_start")) for p in planners)


def test_answers_that_are_no_motions_are_not_compared(
    tmp_path: Path, settings: ReportSettings
) -> None:
    experiment = expand("chen_landscapes")  # postures
    store(tmp_path, experiment)
    results = gather(tmp_path, experiment.conditions, None, experiment.name, "smoke", "")
    with pytest.raises(NothingStored, match="no stored solution is a motion"):
        comparison.page(results, settings)


def test_effort_in_other_coins(results: Results, settings: ReportSettings) -> None:
    runs = planner_runs.of_results(results.evolved, {})
    for row, own, condition in zip(
        comparison.rated(runs, settings), runs, results.evolved, strict=True
    ):
        assert row.body_tests == 9 * 9  # circles on two arms
        assert row.own_cost.median == np.median(condition.column("best_cost"))
        whole = condition.summaries.assign(
            cpu_s=condition.summaries["cpu_s"] - condition.summaries["certificate_s"]
        )[["evaluations", "cpu_s"]]
        first = own.table[own.table["certified"]].groupby("replicate")[["evaluations", "cpu_s"]]
        spent = first.first().reindex(whole.index).fillna(whole).sum()
        if row.proven:
            assert row.evaluations == spent["evaluations"] / row.proven
            assert row.cpu_s == pytest.approx(spent["cpu_s"] / row.proven)


def test_csv_has_all_digits() -> None:
    lengths = Spread(4.0 / 3.0, 1.0, 2.0, 4)
    ours = Rated(
        *("p_1: A&B", "[A] & B_1 50%", "p_1", 4, 3, 10.0, 1234.5, Interval(900.25, 2000.125)),
        *(lengths, 1.0, np.nan, 1.0, 0, 4, 20.0, 51.5, 0.25),
    )
    never = Spread(np.inf, np.inf, np.inf, 2)
    given = Rated(
        *("q: C", "C (given)", "q, {a}", 2, 0, np.nan, np.inf, Interval(1e6, np.inf)),
        *(never, np.nan, np.nan, np.nan, 0, 0),
    )
    head, first, second = csv.reader(io.StringIO(as_csv([ours, given]).decode()))
    assert head[:4] == ["planner", "problem", "n", "proven"] and len(set(head)) == 13
    assert first[:4] == ["[A] & B_1 50%", "p_1", "4", "3"]
    numbers = [1234.5, 900.25, 2000.125, 4 / 3, 1.0, 2.0, 24690.0, 51.5, 0.25]
    assert [float(cell) for cell in first[4:]] == numbers
    unknown = ["", "", ""]  # of runs that were given
    assert second == ["C (given)", "q, {a}", "2", "0", "inf", "1000000.0", *["inf"] * 4, *unknown]


AREAS = np.loadtxt(Path(__file__).with_name("demsar_areas.csv"), delimiter=",", encoding="utf-8")
COSTS = st.sampled_from([1.0, 2.0, 3.0, 4.0, np.inf])
TABLES = arrays(np.float64, st.tuples(st.integers(1, 6), st.integers(2, 5)), elements=COSTS)


def stands(lengths: np.ndarray, efforts: np.ndarray | None = None) -> effort_curves.Standing:
    problems = tuple(f"problem {k}" for k in range(len(lengths)))
    planners = tuple(f"planner {k}" for k in range(lengths.shape[1]))
    return effort_curves.Standing(
        planners, problems, (), (), lengths if efforts is None else efforts, lengths
    )


def test_mean_ranks_and_critical_differences_are_demsars() -> None:
    found = stands(1.0 - AREAS)
    assert found.mean_ranks.round(3).tolist() == [3.143, 2.0, 2.893, 1.964]
    assert effort_curves.critical_difference(4, 14, 0.05) == pytest.approx(1.25, abs=0.005)
    assert effort_curves.critical_difference(4, 14, 0.10) == pytest.approx(1.12, abs=0.005)
    # Tab. 5 (a): critical values of the two-tailed Nemenyi test at 0.05
    printed = (1.960, 2.343, 2.569, 2.728, 2.850, 2.949, 3.031, 3.102, 3.164)
    for planners, value in enumerate(printed, 2):
        scale = np.sqrt(planners * (planners + 1) / (6.0 * 14))
        assert effort_curves.critical_difference(planners, 14, 0.05) / scale == pytest.approx(
            value, abs=1.5e-3
        )


def test_friedmans_statistic_is_that_of_the_formula() -> None:
    found = stands(1.0 - AREAS)
    plain = 12 * 14 / (4 * 5) * ((found.mean_ranks**2).sum() - 4 * 5**2 / 4)
    assert plain == pytest.approx(9.28, abs=0.01)  # as printed, without correction for ties
    ties = sum(n**3 - n for row in AREAS for n in np.unique(row, return_counts=True)[1])
    corrected = plain / (1.0 - ties / (14 * 4 * (4**2 - 1)))
    assert effort_curves.friedman(1.0 - AREAS).statistic == pytest.approx(corrected)
    assert effort_curves.friedman(np.full((6, 3), np.inf)) == (0.0, 1.0)
    assert effort_curves.friedman(np.tile([1.0, 2.0, np.inf], (6, 1))).p_value < 0.01


@given(TABLES)
def test_ranks_count_who_is_better(lengths: np.ndarray) -> None:
    better = (lengths[:, None, :] < lengths[:, :, None]).sum(axis=2)
    equal = (lengths[:, None, :] == lengths[:, :, None]).sum(axis=2)
    ranks = better + (equal + 1) / 2
    assert np.array_equal(stands(lengths).mean_ranks, ranks.mean(axis=0))


@given(TABLES)
def test_profiles_count_problems(efforts: np.ndarray) -> None:
    ratios = effort_curves.effort_ratios(efforts)
    for (i, j), effort in np.ndenumerate(efforts):
        assert ratios[i, j] == (np.inf if np.isinf(effort) else effort / efforts[i].min())
    table = effort_curves.profiles_table(stands(efforts))
    for row in table.itertuples():
        own = ratios[:, int(str(row.planner).removeprefix("planner "))]
        assert row.share == sum(ratio <= row.ratio for ratio in own) / len(own)
    last = table.groupby("planner")["share"].last()
    assert last.tolist() == [np.isfinite(own).mean() for own in efforts.T]


@given(st.lists(st.floats(1.0, 6.0), min_size=2, max_size=7), st.floats(0.1, 3.0))
def test_groups_join_all_pairs_that_do_not_differ(ranks: list[float], difference: float) -> None:
    ranks = sorted(ranks)
    groups = effort_curves.alike(ranks, difference)
    for i, j in itertools.combinations(range(len(ranks)), 2):
        joined = any(first <= i and j <= last for first, last in groups)
        assert joined == (ranks[j] - ranks[i] < difference)
    for one, two in itertools.permutations(groups, 2):
        assert not (one[0] >= two[0] and one[1] <= two[1])  # none inside of another


def runs_of(planner: str, problem: str, *lengths: float) -> planner_runs.PlannerRuns:
    """Return runs whose one answer, where there is one, comes at a tenth of the effort."""
    rows = [(k, 10.0, length) for k, length in enumerate(lengths) if np.isfinite(length)]
    return made_up_runs(planner, problem, rows, [100.0] * len(lengths))


def test_a_problem_counts_once_however_many_seeds_it_has() -> None:
    found = effort_curves.standing(
        [
            runs_of("A", "p", 1.0, 2.0, 9.0),
            runs_of("B", "p", *[3.0] * 50),
            runs_of("A", "q", np.inf, np.inf, 1.0),
            runs_of("B", "q", 4.0, 4.0),
            runs_of("A", "only A", 1.0),
        ]
    )
    assert (found.planners, found.problems) == (("A", "B"), ("p", "q"))
    assert found.left_out == ("only A",)
    assert found.lengths.tolist() == [[2.0, 3.0], [np.inf, 4.0]]
    assert found.efforts.tolist() == [[10.0, 10.0], [210.0, 10.0]]
    assert found.mean_ranks.tolist() == [1.5, 1.5]
    assert found.can_be_profiled and not found.can_be_tested


def test_a_planner_of_few_problems_is_not_ranked_and_costs_no_problem() -> None:
    runs = [runs_of(name, problem, 1.0) for problem in "pqrs" for name in "AB"]
    few = [runs_of("few", "p", 1.0), *(runs_of("few", f"own {k}", 1.0) for k in range(9))]
    found = effort_curves.standing([*runs, *few])
    assert (found.planners, found.outsiders) == (("A", "B"), ("few",))
    assert (found.problems, len(found.left_out)) == (tuple("pqrs"), 9)
    half = effort_curves.standing([*runs, runs_of("half", "p", 1.0), runs_of("half", "q", 1.0)])
    assert (half.planners, half.problems) == (("A", "B", "half"), ("p", "q"))
    assert half.left_out == ("r", "s") and not half.outsiders


RANKED = ("performance_profiles", "critical_difference")


def test_the_page_says_why_there_is_no_test_or_no_ranking(settings: ReportSettings) -> None:
    def page_parts(problems: str, planners: str) -> tuple[str, str, list[str]]:
        runs = [runs_of(a, p, float(k + 1)) for p in problems for k, a in enumerate(planners)]
        page = comparison.page(Results("", "", ()), settings, runs)
        notes = {table.heading: table.note for table in page.tables}
        stems = [drawing.stem for drawing in page.drawings if drawing.stem in RANKED]
        return notes["Problems"], notes.get("Ranks over problems", ""), stems

    remark, notes, stems = page_parts("p", "ABC")
    assert "not ranked" in remark and (notes, stems) == ("", [])
    remark, notes, stems = page_parts("pqrs", "ABC")
    assert "not ranked" not in remark and stems == ["performance_profiles"]
    assert "5 problems that all of them ran; here are 3 planners and 4" in notes
    remark, notes, stems = page_parts("pqrst", "ABC")
    assert "not ranked" not in remark and stems == ["performance_profiles", "critical_difference"]
    assert "the planners rank differently" in notes and "unit of a ranking" in notes


def test_figures_name_every_planner() -> None:
    rng = np.random.default_rng(3)
    found = stands(rng.random((8, 7)), rng.random((8, 7)))
    assert found.can_be_tested
    table = effort_curves.critical_difference_table(found, 0.05)
    assert table["mean_rank"].is_monotonic_increasing
    (axes,) = effort_curves.draw_critical_difference(table).axes
    texts = " ".join(text.get_text() for text in axes.texts)
    assert all(name in texts for name in found.planners)
    (axes,) = effort_curves.draw_profiles(effort_curves.profiles_table(found)).axes
    labels = [str(line.get_label()) for line in axes.get_lines()]  # of the ways to names: "_…"
    assert [label for label in labels if not label.startswith("_")] == list(found.planners)
