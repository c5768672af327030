"""Ranks over problems: against printed numbers of Demšar (2006), and against plain counts."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from evoexp.report.figures.effort_curves import (
    critical_difference_table,
    draw_critical_difference,
    draw_profiles,
    profiles_table,
)
from evoexp.report.pages import comparison
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.planner_runs import PlannerRuns
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.problem_ranks import (
    Standing,
    alike,
    critical_difference,
    effort_ratios,
    friedman,
    standing,
)
from report_samples import made_up_runs

AREAS = np.loadtxt(Path(__file__).with_name("demsar_areas.csv"), delimiter=",", encoding="utf-8")
COSTS = st.sampled_from([1.0, 2.0, 3.0, 4.0, np.inf])
TABLES = arrays(np.float64, st.tuples(st.integers(1, 6), st.integers(2, 5)), elements=COSTS)


def stands(lengths: np.ndarray, efforts: np.ndarray | None = None) -> Standing:
    problems = tuple(f"problem {k}" for k in range(len(lengths)))
    planners = tuple(f"planner {k}" for k in range(lengths.shape[1]))
    return Standing(planners, problems, (), (), lengths if efforts is None else efforts, lengths)


def test_mean_ranks_and_critical_differences_are_demsars() -> None:
    found = stands(1.0 - AREAS)
    assert found.mean_ranks.round(3).tolist() == [3.143, 2.0, 2.893, 1.964]
    assert critical_difference(4, 14, 0.05) == pytest.approx(1.25, abs=0.005)
    assert critical_difference(4, 14, 0.10) == pytest.approx(1.12, abs=0.005)
    # Tab. 5 (a): critical values of the two-tailed Nemenyi test at 0.05
    printed = (1.960, 2.343, 2.569, 2.728, 2.850, 2.949, 3.031, 3.102, 3.164)
    for planners, value in enumerate(printed, 2):
        scale = np.sqrt(planners * (planners + 1) / (6.0 * 14))
        assert critical_difference(planners, 14, 0.05) / scale == pytest.approx(value, abs=1.5e-3)


def test_friedmans_statistic_is_that_of_the_formula() -> None:
    found = stands(1.0 - AREAS)
    plain = 12 * 14 / (4 * 5) * ((found.mean_ranks**2).sum() - 4 * 5**2 / 4)
    assert plain == pytest.approx(9.28, abs=0.01)  # as printed, without correction for ties
    ties = sum(n**3 - n for row in AREAS for n in np.unique(row, return_counts=True)[1])
    corrected = plain / (1.0 - ties / (14 * 4 * (4**2 - 1)))
    assert friedman(1.0 - AREAS).statistic == pytest.approx(corrected)
    assert friedman(np.full((6, 3), np.inf)) == (0.0, 1.0)
    assert friedman(np.tile([1.0, 2.0, np.inf], (6, 1))).p_value < 0.01


@given(TABLES)
def test_ranks_count_who_is_better(lengths: np.ndarray) -> None:
    ranks = stands(lengths).ranks
    better = (lengths[:, None, :] < lengths[:, :, None]).sum(axis=2)
    equal = (lengths[:, None, :] == lengths[:, :, None]).sum(axis=2)
    assert np.array_equal(ranks, better + (equal + 1) / 2)


@given(TABLES)
def test_profiles_count_problems(efforts: np.ndarray) -> None:
    ratios = effort_ratios(efforts)
    for (i, j), effort in np.ndenumerate(efforts):
        assert ratios[i, j] == (np.inf if np.isinf(effort) else effort / efforts[i].min())
    table = profiles_table(stands(efforts))
    for row in table.itertuples():
        own = ratios[:, int(str(row.planner).removeprefix("planner "))]
        assert row.share == sum(ratio <= row.ratio for ratio in own) / len(own)
    last = table.groupby("planner")["share"].last()
    assert last.tolist() == [np.isfinite(own).mean() for own in efforts.T]


@given(st.lists(st.floats(1.0, 6.0), min_size=2, max_size=7), st.floats(0.1, 3.0))
def test_groups_join_all_pairs_that_do_not_differ(ranks: list[float], difference: float) -> None:
    ranks = sorted(ranks)
    groups = alike(ranks, difference)
    for i, j in itertools.combinations(range(len(ranks)), 2):
        joined = any(first <= i and j <= last for first, last in groups)
        assert joined == (ranks[j] - ranks[i] < difference)
    for one, two in itertools.permutations(groups, 2):
        assert not (one[0] >= two[0] and one[1] <= two[1])  # none inside of another


def runs_of(planner: str, problem: str, *lengths: float) -> PlannerRuns:
    """Return runs whose one answer, where there is one, comes at a tenth of the effort."""
    rows = [(k, 10.0, length) for k, length in enumerate(lengths) if np.isfinite(length)]
    return made_up_runs(planner, problem, rows, [100.0] * len(lengths))


def test_a_problem_counts_once_however_many_seeds_it_has() -> None:
    found = standing(
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
    found = standing([*runs, *few])
    assert (found.planners, found.outsiders) == (("A", "B"), ("few",))
    assert (found.problems, len(found.left_out)) == (tuple("pqrs"), 9)
    half = standing([*runs, runs_of("half", "p", 1.0), runs_of("half", "q", 1.0)])
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
    assert "5 problems that all of them were run on; here are 3 planners and 4" in notes
    remark, notes, stems = page_parts("pqrst", "ABC")
    assert "not ranked" not in remark and stems == ["performance_profiles", "critical_difference"]
    assert "the planners rank differently" in notes and "unit of a ranking" in notes


def test_figures_name_every_planner() -> None:
    rng = np.random.default_rng(3)
    found = stands(rng.random((8, 7)), rng.random((8, 7)))
    assert found.can_be_tested
    table = critical_difference_table(found, 0.05)
    assert table["mean_rank"].is_monotonic_increasing
    (axes,) = draw_critical_difference(table).axes
    texts = " ".join(text.get_text() for text in axes.texts)
    assert all(name in texts for name in found.planners)
    (axes,) = draw_profiles(profiles_table(found)).axes
    labels = [str(line.get_label()) for line in axes.get_lines()]  # of the ways to names: "_…"
    assert [label for label in labels if not label.startswith("_")] == list(found.planners)
