"""Runs by planner and problem: names out of labels, and curves problem by problem."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evoexp.report.figures import style
from evoexp.report.figures.effort_curves import (
    draw_shares_by_problem,
    problem_share_table,
    share_table,
)
from evoexp.report.results.planner_runs import PlannerRuns, of_results
from evoexp.report.results.stored_results import Results, gather
from report_samples import expand


@pytest.fixture
def both(stored: Path) -> Results:
    """Return two problems with two planners and one, by labels that tell both."""
    planar, arms = expand("rana_planar"), expand("rana_three_arms", "scenario=rana_three_arms")
    (first, ga), (second, search) = planar.conditions[:2]
    assert (first, second) == ("via-point GA", "random search")
    labels = [("small: two arms · GA", ga), ("small: two arms · draws", search)]
    labels += [("small: three arms · GA", arms.conditions[0][1])]
    return gather(stored, labels, None, "", "", "")


def names(runs: list[PlannerRuns]) -> list[tuple[str, str]]:
    return [(own.planner, own.problem.name) for own in runs]


def test_labels_that_tell_problem_and_planner_name_both(both: Results) -> None:
    want = [("GA", "two arms"), ("draws", "two arms"), ("GA", "three arms")]
    assert names(of_results(both.evolved)) == want


def test_a_problem_whose_labels_share_nothing_is_named_by_its_scenario(both: Results) -> None:
    labels = iter(("plain", "with draws", "three arms: three arms"))
    other = [replace(c, label=next(labels)) for c in both.evolved]
    scenario = both.evolved[0].condition.scenario.component
    assert names(of_results(other)) == [
        ("via_point_ga", scenario),
        ("random_search", scenario),
        ("via_point_ga", "three arms"),
    ]
    alike = [replace(c, label=label) for c, label in zip(other, "aba", strict=True)]
    robots = {c.condition.robot.component for c in alike}
    assert {name for _, name in names(of_results(alike))} == (
        {f"{scenario}, {robot}" for robot in robots}
        if len(robots) > 1
        else {f"{scenario}, {min(robots)} 1", f"{scenario}, {min(robots)} 2"}
    )


def test_a_name_that_stands_for_two_components_names_no_planner(both: Results) -> None:
    other = [
        replace(c, label=c.label.replace("draws", "B").replace("arms · GA", "arms · B"))
        if c.label != "small: two arms · GA"
        else c
        for c in both.evolved
    ]
    found = [planner for planner, _ in names(of_results(other))]
    assert found == ["via_point_ga", "random_search", "via_point_ga"]


def test_a_problem_of_several_planners_is_named_by_its_option_or_component(
    results: Results,
) -> None:
    found = names(of_results(results.evolved))
    assert [planner for planner, _ in found] == [c.label for c in results.evolved]
    assert {problem for _, problem in found} == {results.evolved[0].condition.scenario.component}


def test_runs_keep_the_order_the_seeds_and_the_effort(results: Results) -> None:
    for own, condition in zip(of_results(results.evolved), results.evolved, strict=True):
        assert own.replicates == tuple(condition.summaries.index)
        assert np.array_equal(own.spent, condition.column("collision_queries"))
        assert own.label == condition.label


def test_shares_of_all_problems_are_the_mean_of_those_of_each(both: Results) -> None:
    runs = of_results(both.evolved)
    table = problem_share_table(runs)
    axis = table["collision_queries"].astype(float).unique()
    pooled = share_table(runs, axis)
    for planner in table["planner"].unique():
        own = table[table["planner"] == planner]
        weighted = own["share"].astype(float) * own["targets"]
        together = weighted.groupby(own["collision_queries"].astype(float)).sum()
        total = own.groupby("problem")["targets"].first().sum()
        shown = pooled[pooled["planner"] == planner]["share"].astype(float)
        assert np.allclose(together.to_numpy() / total, shown)
    figure = draw_shares_by_problem(table)
    assert [axes.get_title(loc="left") or axes.get_title() for axes in figure.axes] == list(
        table["problem"].unique()
    )
    assert len({axes.get_xlim() for axes in figure.axes}) == 1


def test_many_curves_have_six_colours_and_then_other_lines() -> None:
    looks = [style.curve_look(k) for k in range(24)]
    assert len({look["color"] for look in looks}) == 6
    assert len({str(look) for look in looks}) == 24
    assert all(look["linestyle"] == "-" for look in looks[:6])


def test_long_names_lose_their_middle() -> None:
    assert style.shortened("a" * 10, 10) == "a" * 10
    assert style.shortened("abcdefghij", 7) == "abc…hij"
    assert all(len(style.shortened("x" * 40, most)) == most for most in range(3, 12))
