"""The pages on Curkovic et al. 2013: their figures, executed motions and their defects."""

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from evoexp.condition import Prepared
from evoexp.configuration import compose
from evoexp.papers.curkovic import claims, measures
from evoexp.papers.curkovic.figures import methods, robot_motions
from evoexp.planners.answers import judge_motion
from evoexp.records import FloatArray
from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.page_parts import Page
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics import judging
from references.link_crossings_numpy import squared_distance
from report_samples import can_be_drawn, expand, page_settings, smoke_results


def page(outputs: Path, name: str, figures: str | None = None) -> Page:
    return page_of(smoke_results(outputs, name), page_settings(name, figures))


def drawing(found: Page, stem: str) -> pd.DataFrame:
    """Draw one figure of a page; return its table."""
    (one,) = (drawing for drawing in found.drawings if drawing.stem == stem)
    table = one.table()
    assert can_be_drawn(table, one.draw)
    return table


@pytest.fixture
def motion(outputs: Path) -> ConditionResults:
    return smoke_results(outputs, "curkovic_motion").conditions[0]


@pytest.mark.matrix
def test_fronts_are_what_no_other_individual_dominates(outputs: Path) -> None:
    table = drawing(page(outputs, "curkovic_pareto"), "fig_5_fronts")
    assert len(table) == 2 * 100
    for _, rows in table.groupby("population"):
        values = rows[list(methods.CRITERIA)].to_numpy()
        no_worse, better = values[:, None] <= values, values[:, None] < values
        dominated = (no_worse.all(axis=2) & better.any(axis=2)).any(axis=0)
        assert list(~dominated) == list(rows["non_dominated"])


def test_the_intersection_lies_on_both_vectors(motion: ConditionResults) -> None:
    table = robot_motions.intersection_table(motion).set_index("element")
    start, end = table[["x", "y"]].astype(float), table[["x_end", "y_end"]].to_numpy(float)
    ends = pd.DataFrame(end, table.index, ["x", "y"])
    for vector, name in (("b", "mu"), ("d", "nu")):
        share = table[name].iloc[0]
        along = ends.loc[vector] - start.loc[vector]
        np.testing.assert_allclose(start.loc["point"], start.loc[vector] + share * along, atol=1e-8)
        assert 0.0 <= share <= 1.0
    assert table["crossing"].all()
    angle = np.radians(table.loc["a", "angle_deg"])
    link = 0.25 * np.array([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(ends.loc["a"], link, atol=1e-9)


def test_a_trail_begins_at_the_start_and_ends_at_the_goal(motion: ConditionResults) -> None:
    table, problem = robot_motions.motion_table(motion), motion.prepared.problem
    path = table[(table["element"] == "path") & (table["replicate"] == motion.best_replicate)]
    for robot, rows in path.groupby("robot"):
        for row, q in ((rows.iloc[0], problem.start[robot]), (rows.iloc[-1], problem.goal[robot])):
            reach = 0.25 * np.array([np.cos(q).sum(), np.sin(q).sum()])
            tip = np.array(problem.collision.arms[robot].base) + reach
            assert (row["x_end"], row["y_end"]) == pytest.approx(tuple(tip), abs=1e-9)
    counts = table["element"].value_counts()
    assert counts.get("contact", 0) == motion.verdicts.refuted
    assert counts["posture"] == 2 * 2 * (5 * robot_motions.POSTURES + 1)


@pytest.mark.examples(1)
@pytest.mark.parametrize(
    ("name", "robots", "stem"),
    [("curkovic_stationary", 2, "fig_10_motion"), ("curkovic_three", 3, "motion")],
)
def test_other_scenes_are_drawn_and_claimed(
    outputs: Path, name: str, robots: int, stem: str
) -> None:
    found = page(outputs, name)
    assert "fig_7_intersection" not in {drawing.stem for drawing in found.drawings}
    verdict = "by the exact verdict on the whole motion"
    assert sum(verdict in claim.text for claim in found.claims) == 2
    table, every = drawing(found, f"{stem}_2_5_substeps"), set(range(robots))
    assert set(table.loc[table["element"] == "path", "robot"]) == every
    assert (table["element"] == "obstacle").any() == (robots == 2)
    assert set(drawing(found, "joints_1_configurations_only")["robot"]) == every
    distances = drawing(found, "distances")
    assert set(distances["replicates"]) == {2}
    series = dict(list(distances.groupby("series")))
    lowest, best, highest = (
        series[each].set_index("position")["distance"]
        for each in (robot_motions.LOWEST, robot_motions.BEST, robot_motions.HIGHEST)
    )
    assert (lowest <= best).all() and (best <= highest).all()
    for position, condition in enumerate(smoke_results(outputs, name).conditions):
        clearances = condition.summaries["clearance"]  # samples are never below it
        assert lowest[position].min() >= clearances.min() - 1e-6
        assert best[position].min() >= clearances[condition.best_replicate] - 1e-6


@pytest.mark.matrix
def test_joints_start_at_rest_with_the_limits_of_equation_2(outputs: Path) -> None:
    joints = drawing(page(outputs, "curkovic_motion"), "fig_9_joints_2_cubic_spline")
    ends = joints[joints["instant"] == 0.0]
    assert list(ends["angle_deg"]) == [150.0, 60.0, 150.0, 180.0]
    assert (ends["turn_deg"] == 0.0).all()
    assert list(ends["limit_deg"].round(2)) == [5.73, 11.46] * 2


@pytest.mark.matrix
def test_the_lines_of_tools_are_further_apart_than_their_bodies(outputs: Path) -> None:
    condition = smoke_results(outputs, "curkovic_safety").conditions[0]
    assert (measures.tool_distance(condition) >= condition.column("clearance")).all()


def changed(own: ConditionResults, costs: np.ndarray, refuted: np.ndarray) -> ConditionResults:
    """Return stored runs with other costs and verdicts."""
    verdict = pd.array(~refuted, dtype="boolean")
    columns = {"best_cost": costs, "certified": verdict, "solved": True}
    summaries = pd.DataFrame(columns, index=pd.RangeIndex(len(costs)))
    return dataclasses.replace(own, summaries=summaries)


def test_a_refuted_run_counts_as_worse_than_any(motion: ConditionResults) -> None:
    costs = np.array([3.0, 1.0, 2.0])
    some = changed(motion, costs, np.array([False, True, False]))
    assert measures.certified_cost(some).tolist() == [3.0, np.inf, 2.0]
    assert measures.exemplar(some) == 2  # the cheapest one that is not refuted
    none = changed(motion, costs, np.array([True] * 3))
    assert measures.exemplar(none) == 1
    assert np.isnan(claims.not_refuted(none)).all()


def test_shares_of_a_gain_are_what_medians_say(motion: ConditionResults) -> None:
    rng, false = np.random.default_rng(0), np.zeros(40, dtype=bool)
    costs = [level + 0.1 * rng.random(40) for level in (10.0, 9.0, 8.0)]
    nothing, elites, hall = (changed(motion, each, false) for each in costs)
    gain, settings = claims.gains(9.0)[0], page_settings("curkovic_hall")
    found = claims.share(gain, (nothing, elites, hall), settings)
    none, some, most = map(np.median, costs)
    assert found.value == pytest.approx((none - some) / (none - most))
    assert found.interval.low < found.value < found.interval.high < found.interval.low + 0.1
    assert found.n == (40, 40, 40)
    # a hall that gains nothing leaves no share
    nobody = claims.share(gain, (hall, elites, nothing), settings)
    assert np.isnan([nobody.value, *nobody.interval]).all()


def test_the_depth_of_the_hall_is_judged_once_per_measure(outputs: Path) -> None:
    found = page(outputs, "curkovic_hall_depth")
    assert all(len(rows) == 7 for _, rows in found.comparisons)
    start = "A hall of at most 15 % of the population is the best"
    assert [claim.text.startswith(start) for claim in found.claims] == [True] * 3


def test_mutation_rates_are_compared_within_a_reading(outputs: Path) -> None:
    results = smoke_results(outputs, "curkovic_mutation")
    one, two = claims.families(results)
    rates = [f"constant {rate}" for rate in ("0.1", "0.3", "0.6", "1")]
    assert [other.label for _, other in one.pairs] == rates
    assert {first.label for first, _ in two.pairs} == {"Eq. 10, symmetric"}
    assert all(other.label.endswith("symmetric") for _, other in two.pairs)
    judged = page(outputs, "curkovic_mutation").claims
    readings = [c.text.rsplit("; ", 1)[1] for c in judged if c.name == "falling_rate"]
    assert readings == ["Eq. 9 as printed", "Eq. 9 read as symmetric"] * 3


def test_what_is_tested_between_configurations_is_paired_with_its_twin(outputs: Path) -> None:
    results = smoke_results(outputs, "curkovic_stationary")
    both = results._replace(conditions=results.conditions[::-1])  # whatever comes first
    for each in (results, both):
        ((one, other),) = claims.families(each)[0].pairs
        assert (one.label, other.label) == ("configurations only", "5 substeps")
    found = page(outputs, "curkovic_stationary", "curkovic_sweep")
    assert found.claims == ()
    headings = [heading for heading, _ in found.comparisons]
    assert any(each.startswith("solved motion collides between") for each in headings)


def test_curves_are_compared_in_their_contacts(outputs: Path) -> None:
    found = page(outputs, "curkovic_motion", "curkovic_sweep")
    assert set(drawing(found, "costs")["condition"]) == {"straight", "cubic spline"}
    assert len(drawing(found, "effects")) == 3


def test_effort_to_a_threshold_counts_runs_that_never_get_there(outputs: Path) -> None:
    condition = smoke_results(outputs, "curkovic_population").conditions[0]
    costs = condition.generations.pivot(index="replicate", columns="index", values="best_cost")
    threshold = float(costs[10].mean())  # one of the two replicates gets there
    reached = (costs <= threshold).to_numpy()
    expected = np.where(reached.any(axis=1), reached.argmax(axis=1), np.inf)
    np.testing.assert_array_equal(measures.generations_to(condition, threshold), expected)
    evaluations = 200.0 * (expected + 1.0)
    np.testing.assert_array_equal(measures.evaluations_to(condition, threshold), evaluations)
    found = np.isfinite(evaluations)
    spent = np.where(found, evaluations, 2200.0).sum() / found.sum()
    assert measures.expected_evaluations(condition, threshold) == spent
    assert measures.expected_evaluations(condition, 0.0) == np.inf
    assert measures.lower_bound(condition) <= costs.to_numpy().min()


def test_claims_are_judged_only_on_the_papers_own_settings(outputs: Path) -> None:
    found = smoke_results(outputs, "curkovic_pareto")
    (own,) = found.conditions
    (paper,) = compose.expand(["experiment=curkovic_pareto"])[0].conditions
    other_seed = paper.condition._replace(seed=5)
    for condition, planned, budget, reason in (
        (paper.condition, 200, "paper", ""),
        (other_seed, 200, "paper", ""),
        (paper.condition, 200, "quick", "budget quick"),
        (paper.condition, 3, "paper", "fewer replicates than planned"),
        (own.condition, 200, "paper", "settings overridden"),
    ):
        judged = dataclasses.replace(own, condition=condition, planned=planned)
        results = found._replace(budget=budget, conditions=(judged,))
        assert judging.not_judged(results) == reason


def test_rates_are_counted_among_solved_motions(outputs: Path) -> None:
    condition = smoke_results(outputs, "curkovic_motion").conditions[1]
    values = measures.PAGE_VALUES
    refuted = values["refuted_motions"](values["touching"](condition))
    leaves = values["leaving_motions"](condition)
    assert refuted == (condition.verdicts.solved_refuted, condition.solved)
    links = [
        measures.sampled(condition.prepared, solution, 500).links
        for solution in condition.solutions.values()
    ]
    assert leaves.having == sum(q.min() < -1e-6 or q.max() > 180.0 + 1e-6 for q in links)
    interval = refuted.interval(0.95)
    assert interval.low <= refuted.share <= interval.high


def prepared(*words: str) -> Prepared:
    experiment = expand("curkovic_methods_b", "ga.population_size=20", *words)
    return experiment.conditions[0].condition.prepare()


@pytest.fixture(scope="module", params=["linear", "cubic"])
def one(request: pytest.FixtureRequest) -> Prepared:
    return prepared(f"planner.interpolation={request.param}")


@pytest.fixture(scope="module")
def linear() -> Prepared:
    return prepared("planner.interpolation=linear")


@pytest.fixture(scope="module")
def solution(one: Prepared) -> FloatArray:
    genes = np.random.default_rng(3).uniform(0.0, 180.0, (2, 6, 2))
    genes[:, 0], genes[:, -1] = np.degrees(one.problem.start), np.degrees(one.problem.goal)
    return genes.ravel()


@pytest.mark.examples(1)
def test_an_executed_motion_passes_its_configurations(one: Prepared, solution: FloatArray) -> None:
    found = measures.sampled(one, solution, 10)
    assert found.links.shape == found.speeds.shape == (51, 2, 2)
    configurations = solution.reshape(2, 6, 2)
    np.testing.assert_allclose(found.links[::10].transpose(1, 0, 2), configurations, atol=1e-9)
    motion = one.planner.motion(one.problem, solution)
    np.testing.assert_allclose(found.q[:, 13], np.degrees(motion.at(1.3)), atol=1e-9)


@pytest.mark.examples(1)
def test_speeds_are_differences_of_angles(one: Prepared, solution: FloatArray) -> None:
    found = measures.sampled(one, solution, 2000)
    off = np.abs(np.diff(found.links, axis=0) * 2000 - found.speeds[:-1]).max()
    # a step of 1/2000 against accelerations of some speeds per instant
    assert off < 0.002 * np.abs(found.speeds).max()
    expected = (np.abs(found.speeds).max(axis=0) / measures.speed_limits(one)).max()
    assert measures.over_limit(one, solution) == pytest.approx(expected, rel=1e-4)


def test_limits_are_those_of_equation_2(linear: Prepared) -> None:
    limits = np.degrees([[0.1, 0.2]] * 2)
    np.testing.assert_allclose(measures.speed_limits(linear), limits)
    steps = np.abs(np.degrees(linear.problem.goal - linear.problem.start)) / 5.0
    line = measures.straight(linear)
    assert measures.over_limit(linear, line) == pytest.approx((steps / limits).max())


@pytest.mark.matrix
def test_a_control_has_the_limits_of_the_planner_beside_it(linear: Prepared) -> None:
    control = measures.speed_limits(prepared("control=random_search"))
    np.testing.assert_array_equal(control, measures.speed_limits(linear))


def test_a_contact_lies_on_both_bodies(linear: Prepared) -> None:
    planner, problem = linear
    line = measures.straight(linear)
    motion = planner.motion(problem, line)
    found = judge_motion(planner, problem, motion)
    assert found.certified is False and found.refuted_at is not None
    point = motion_geometry.contact(linear, line, found.refuted_at, found.refuted_pair)
    q = np.degrees(motion.at(found.refuted_at))[:, None]
    for arm, link, starts, ends in motion_geometry.joint_positions(problem.assembly, q):
        if f"arm_{arm + 1}_link_{link + 1}" in found.refuted_pair.split(" – "):
            assert squared_distance(starts[0, :2], ends[0, :2], np.array(point)) < 1e-12
