"""The pages on Curkovic et al. 2013: what they hold, and the tables behind their figures."""

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from evoexp.configuration import compose
from evoexp.papers.curkovic import compared_settings, hall_shares, link_motions, measures
from evoexp.papers.curkovic.figures import (
    link_intersection,
    motion_curves,
    pareto_fronts,
    robot_motions,
)
from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.page_file import read_page_file
from evoexp.report.pages.page_parts import Page
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.comparisons import FamilyComparison, compare, compare_families
from evoexp.report.statistics.judging import Judge
from evoexp.store.log_reader import read_log
from report_samples import can_be_drawn, figure_stems, page_settings, smoke_report, smoke_results

RULES = read_page_file("evoexp.papers.curkovic").rules


def page(outputs: Path, name: str, figures: str | None = None) -> Page:
    return page_of(smoke_results(outputs, name), page_settings(name, figures))


def compared(results: Results) -> tuple[FamilyComparison, ...]:
    """Return all comparisons of a sweep, to a cost of 12."""
    families = compared_settings.families(results)
    quantities = compared_settings.sweep_measures(results, 12.0)
    return compare_families(families, quantities, page_settings("curkovic_mutation"))


def drawing(found: Page, stem: str) -> pd.DataFrame:
    """Draw one figure of a page; return its table."""
    (one,) = (drawing for drawing in found.drawings if drawing.stem == stem)
    table = one.table()
    assert can_be_drawn(table, one.draw)
    return table


@pytest.mark.matrix
def test_fronts_are_what_no_other_individual_dominates(outputs: Path) -> None:
    directory = smoke_report(outputs, "curkovic_pareto")
    table = pd.read_csv(directory / "fig_5_fronts.csv")
    assert len(table) == 2 * 100
    for _, rows in table.groupby("population"):
        values = rows[list(pareto_fronts.CRITERIA)].to_numpy()
        dominated = [
            any((other <= own).all() and (other < own).any() for other in values) for own in values
        ]
        assert list(~np.array(dominated)) == list(rows["non_dominated"])
    results = smoke_results(outputs, "curkovic_pareto")
    fronts = read_log(results.conditions[0].run.log_path(1)).fronts
    assert [(front.generation, front.population) for front in fronts] == [(10, 0), (10, 1)]
    text = (directory / "index.md").read_text()
    assert "individuals on the front of robot 2's population" in text
    assert "larger than the hall of fame may be (15 of 100)" in text


@pytest.mark.matrix
def test_motions_of_two_robots_are_figures_7_to_9(outputs: Path) -> None:
    directory = smoke_report(outputs, "curkovic_motion")
    names = {
        f"fig_{k}_{what}_{c}"
        for k, what in ((8, "motion"), (9, "joints"))
        for c in ("1_straight", "2_cubic_spline")
    }
    assert figure_stems(directory) == names | {"fig_7_intersection", "distances", "convergence"}
    text = (directory / "index.md").read_text()
    assert "Eq. 2 allows steps of 5.73 and 11.46 deg (printed: 11.5 and 23)" in text
    assert "executed curve leaves [0, π] | straight: 0 of 2; cubic spline:" in text
    assert "a link is faster than Eq. 2 allows | straight: 2 of 2; cubic spline: 2 of 2" in text
    assert text.count("not judged (budget smoke)") == 4
    joints = pd.read_csv(directory / "fig_9_joints_2_cubic_spline.csv")
    ends = joints[joints["instant"] == 0.0]
    assert list(ends["angle_deg"]) == [150.0, 60.0, 150.0, 180.0]
    assert (ends["turn_deg"] == 0.0).all()  # the spline starts at rest
    assert list(ends["limit_deg"].round(2)) == [5.73, 11.46] * 2


def test_the_intersection_lies_on_both_vectors(outputs: Path) -> None:
    condition = smoke_results(outputs, "curkovic_motion").conditions[0]
    table = link_intersection.intersection_table(condition).set_index("element")
    point = table.loc["point", ["x", "y"]].to_numpy(float)
    for vector, share in (("b", "mu"), ("d", "nu")):
        start, end = (
            table.loc[vector, ["x", "y"]].to_numpy(float),
            table.loc[vector, ["x_end", "y_end"]].to_numpy(float),
        )
        np.testing.assert_allclose(point, start + table[share].iloc[0] * (end - start), atol=1e-8)
        assert 0.0 <= table[share].iloc[0] <= 1.0
    assert table["crossing"].all()
    along = table.loc["a", ["x_end", "y_end"]].to_numpy(float)
    angle = np.radians(table.loc["a", "angle_deg"])
    np.testing.assert_allclose(along, 0.25 * np.array([np.cos(angle), np.sin(angle)]), atol=1e-9)


def test_a_trail_begins_at_the_start_and_ends_at_the_goal(outputs: Path) -> None:
    condition = smoke_results(outputs, "curkovic_motion").conditions[0]
    table = robot_motions.motion_table(condition)
    path = table[(table["element"] == "path") & (table["replicate"] == condition.best_replicate)]
    problem = condition.prepared.problem
    for robot, rows in path.groupby("robot"):
        for row, q in ((rows.iloc[0], problem.start[robot]), (rows.iloc[-1], problem.goal[robot])):
            tip = np.array(problem.collision.arms[robot].base) + 0.25 * np.array(
                [np.cos(q).sum(), np.sin(q).sum()]
            )
            assert (row["x_end"], row["y_end"]) == pytest.approx(tuple(tip), abs=1e-9)
    assert (table["element"] == "contact").sum() == condition.verdicts.refuted
    postures = table[table["element"] == "posture"]
    assert len(postures) == 2 * 2 * (5 * robot_motions.POSTURES + 1)


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
    assert (
        sum("by the exact verdict on the whole motion" in claim.text for claim in found.claims) == 2
    )
    table = drawing(found, f"{stem}_2_5_substeps")
    assert set(table.loc[table["element"] == "path", "robot"]) == set(range(robots))
    assert (table["element"] == "obstacle").any() == (robots == 2)
    assert set(drawing(found, "joints_1_configurations_only")["robot"]) == set(range(robots))
    distances = drawing(found, "distances")
    for (position, series), rows in distances.groupby(["position", "series"]):
        condition = smoke_results(outputs, name).conditions[position]
        least = condition.column("clearance")
        if series == motion_curves.BEST:
            least = least[[condition.best_replicate]]
        if series != motion_curves.STRAIGHT:
            assert rows["distance"].min() >= least.min() - 1e-6  # sampled
        assert set(rows["replicates"]) == {2}
    lowest, best, highest = (
        distances.loc[distances["series"] == series, "distance"].to_numpy()
        for series in (motion_curves.LOWEST, motion_curves.BEST, motion_curves.HIGHEST)
    )
    assert (lowest <= best).all()
    assert (best <= highest).all()


@pytest.mark.matrix
def test_three_radii_are_figure_11(outputs: Path) -> None:
    found = page(outputs, "curkovic_safety")
    table = drawing(found, "fig_11_safety")
    assert sorted(table["tcp_radius"].unique()) == [0.01, 0.025, 0.04]
    assert sorted(table["collision_substeps"].unique()) == [1, 5]
    assert table.groupby(["condition", "robot"])["at_configuration"].sum().eq(6).all()
    assert (
        sum(
            claim.text.startswith("A larger radius forces the robots further apart")
            for claim in found.claims
        )
        == 2
    )
    sticking = "radius 0.01 m; radius 0.01 m, configurations only"
    assert [finding for what, finding in found.checks if "sticks out" in what] == [sticking]
    trail = drawing(found, "motion_3_radius_0_04_m")
    radii = trail[trail["element"] == "configuration"].groupby("link")["radius"].unique()
    assert [list(values) for values in radii] == [[0.02], [0.02], [0.04]]
    condition = smoke_results(outputs, "curkovic_safety").conditions[0]
    lines = link_motions.tool_distance(condition)
    assert (lines >= condition.column("clearance")).all()  # bodies are thicker than lines


@pytest.mark.matrix
def test_a_hall_is_judged_against_elites_in_every_corner(outputs: Path) -> None:
    found = page(outputs, "curkovic_hall")
    corners = ("one-sided, Eq. 10", "one-sided, constant", "symmetric, Eq. 10")
    corners += ("symmetric, constant",)
    names = [claim.name for claim in found.claims]
    assert {name: names.count(name) for name in set(names)} == {
        "hall_helps": 12,
        "hall_beyond_elites": 12,
        "distinct_genomes": 12,
        "frozen_hall": 3,
    }
    assert {claim.text.partition(": ")[0] for claim in found.claims} == set(corners)
    assert {claim.verdict for claim in found.claims} == {"not judged (budget smoke)"}
    table = found.tables[0]
    assert [(row[0], row[2]) for row in table.rows[:2]] == [
        (corners[0], "genome"),
        (corners[0], "index"),
    ]
    assert len(table.rows) == 4 * 4 * 2
    shares = drawing(found, "elitism")
    assert list(shares["corner"].unique()) == list(corners)
    effort = drawing(found, "effort")
    assert sorted(effort["position"].unique()) == list(range(8))  # as many colours as there are
    assert effort.groupby("panel")["name"].nunique().tolist() == [8, 5, 5, 5]
    costs = drawing(found, "costs")
    assert len(costs) == 23 * 2
    assert len(drawing(found, "convergence")) == len(effort)


@pytest.mark.matrix
def test_headline_claims_are_judged_under_every_variation(outputs: Path) -> None:
    found = page(outputs, "curkovic_assumptions")
    effects, assumed = found.tables
    conditions = [row[0] for row in effects.rows]
    assert conditions[0] == "V"
    assert all(label.startswith("V") for label in conditions)
    assert len(conditions) == 11  # without both numbers of generations, which are capped
    judged = [claim.name for claim in found.claims[:6]]
    assert judged[1::2] == ["survives"] * 3
    assert judged[::2] == ["faster", "hall_beyond_elites", "free_motion"]
    varied = {row[0]: row[4] for row in assumed.rows}
    assert varied["`ga.population_size`"] == "V, 50 individuals; V, 200 individuals"
    twins = [claim.evidence for claim in found.claims if claim.name != "survives"]
    assert not any("nothing to compare" in told for told in twins)


def condition_of(outputs: Path, costs: np.ndarray, refuted: np.ndarray) -> ConditionResults:
    """Return stored runs with other costs and verdicts."""
    own = smoke_results(outputs, "curkovic_motion").conditions[0]
    index = pd.RangeIndex(len(costs))
    verdict = pd.array(~refuted, dtype="boolean")
    columns = {"best_cost": costs, "certified": verdict, "solved": True}
    return dataclasses.replace(own, summaries=pd.DataFrame(columns, index=index))


def test_a_refuted_run_counts_as_worse_than_any(outputs: Path) -> None:
    costs, refuted = np.array([3.0, 1.0, 2.0]), np.array([False, True, False])
    some = condition_of(outputs, costs, refuted)
    assert measures.certified_cost(some).tolist() == [3.0, np.inf, 2.0]
    assert measures.exemplar(some) == 2  # the cheapest one that is not refuted
    none = condition_of(outputs, costs, np.array([True] * 3))
    assert measures.exemplar(none) == 1
    assert np.isnan(hall_shares.not_refuted(none)).all()


def test_shares_of_a_gain_are_what_medians_say(outputs: Path) -> None:
    rng, false = np.random.default_rng(0), np.zeros(40, dtype=bool)
    levels = {"nothing": 10.0, "elites": 9.0, "hall": 8.0}
    runs = {
        name: condition_of(outputs, level + 0.1 * rng.random(40), false)
        for name, level in levels.items()
    }
    corner = hall_shares.Corner("", runs["nothing"], (runs["elites"],), runs["hall"], None, ())
    measure, settings = hall_shares.gains(9.0)[0], page_settings("curkovic_hall")
    found = hall_shares.share(corner, measure, runs["elites"], runs["hall"], settings)
    medians = {name: float(np.median(c.column("best_cost"))) for name, c in runs.items()}
    expected = (medians["nothing"] - medians["elites"]) / (medians["nothing"] - medians["hall"])
    assert found.value == pytest.approx(expected)
    assert found.interval.low < expected < found.interval.high
    assert found.interval.high - found.interval.low < 0.1
    assert found.n == (40, 40, 40)
    # a hall that gains nothing leaves no share
    worse = corner._replace(nothing=runs["hall"], hall=runs["nothing"])
    nobody = hall_shares.share(worse, measure, runs["elites"], worse.hall, settings)
    assert np.isnan([nobody.value, *nobody.interval]).all()


def test_the_depth_of_the_hall_is_judged_once_per_measure(outputs: Path) -> None:
    found = page(outputs, "curkovic_hall_depth")
    assert len(found.claims) == 3
    assert all(len(rows) == 7 for _, rows in found.comparisons)
    assert all(
        claim.text.startswith("A hall of at most 15 % of the population is the best")
        for claim in found.claims
    )


def test_mutation_rates_are_compared_within_a_reading(outputs: Path) -> None:
    results = smoke_results(outputs, "curkovic_mutation")
    one, two = compared_settings.families(results)
    assert [other.label for _, other in one.pairs] == [
        f"constant {rate}" for rate in ("0.1", "0.3", "0.6", "1")
    ]
    assert {first.label for first, _ in two.pairs} == {"Eq. 10, symmetric"}
    assert all(other.label.endswith("symmetric") for _, other in two.pairs)
    judge = judging.judge(results, page_settings("curkovic_mutation"), RULES)
    judged = compared_settings.of_sweep(judge, results, compared(results))
    assert [claim.text.rsplit("; ", 1)[1] for claim in judged] == [
        "Eq. 9 as printed",
        "Eq. 9 read as symmetric",
    ] * 3


def test_verdicts_follow_the_rows_of_a_sweep(outputs: Path) -> None:
    results = smoke_results(outputs, "curkovic_mutation")
    low, high = np.arange(12.0), np.arange(12.0) + 20.0
    judge, found = Judge("", page_settings("curkovic_mutation"), RULES), []
    for first, second in ((low, high), (high, low), (low, low)):
        rows = tuple(compare(f"constant {k}", first, second, True, 0.95) for k in range(3))
        (first_one, *_) = compared(results)
        (judged,) = compared_settings.of_sweep(judge, results, [first_one._replace(rows=rows)])
        found.append(judged.verdict)
        assert "constant 2 (A12" in judged.evidence
    assert found == [judging.REPRODUCED, judging.CONTRADICTED, judging.UNDECIDED]


def test_what_is_tested_between_configurations_is_paired_with_its_twin(outputs: Path) -> None:
    results = smoke_results(outputs, "curkovic_stationary")
    (twins,) = compared_settings.families(results)
    assert [(a.label, b.label) for a, b in twins.pairs] == [("configurations only", "5 substeps")]
    found = page(outputs, "curkovic_stationary", "curkovic_sweep")
    assert found.claims == ()
    assert any(
        heading.startswith("solved motion collides between") for heading, _ in found.comparisons
    )
    both = results._replace(conditions=results.conditions[::-1])  # whatever comes first
    assert compared_settings.families(both)[0].pairs[0][1].label == "5 substeps"


def test_curves_show_three_defects(outputs: Path) -> None:
    found = page(outputs, "curkovic_motion", "curkovic_sweep")
    table = drawing(found, "defects")
    assert list(table["defect"].unique()) == [
        "collide in between",
        "leave [0, π]",
        "too fast (Eq. 2)",
    ]
    assert (table["lower"] <= table["share"]).all()
    assert (table["share"] <= table["upper"]).all()
    assert (table["failing"] <= table["solved"]).all()
    costs = drawing(found, "costs")
    assert set(costs["condition"]) == {"straight", "cubic spline"}
    assert len(drawing(found, "effects")) == 3


def test_effort_to_a_threshold_counts_runs_that_never_get_there(outputs: Path) -> None:
    condition = smoke_results(outputs, "curkovic_population").conditions[0]
    costs = condition.generations.pivot(index="replicate", columns="index", values="best_cost")
    threshold = float(costs[10].mean())  # one of the two replicates gets there
    reached = (costs <= threshold).to_numpy()
    expected = np.where(reached.any(axis=1), reached.argmax(axis=1), np.inf)
    np.testing.assert_array_equal(measures.generations_to(condition, threshold), expected)
    evaluations = measures.evaluations_to(condition, threshold)
    np.testing.assert_array_equal(evaluations, 200.0 * (expected + 1.0))
    spent = (
        np.where(np.isfinite(evaluations), evaluations, 2200.0).sum()
        / np.isfinite(evaluations).sum()
    )
    assert measures.expected_evaluations(condition, threshold) == spent
    assert measures.expected_evaluations(condition, 0.0) == np.inf
    assert measures.lower_bound(condition) <= costs.to_numpy().min()


def test_claims_are_judged_only_on_the_papers_own_settings(outputs: Path) -> None:
    found = smoke_results(outputs, "curkovic_pareto")
    (paper,) = compose.expand(["experiment=curkovic_pareto"])[0].conditions
    judged = dataclasses.replace(found.conditions[0], condition=paper.condition, planned=20)

    def reason(condition: ConditionResults, budget: str = "paper") -> str:
        return judging.not_judged(found._replace(budget=budget, conditions=(condition,)))

    assert reason(judged) == ""
    assert reason(dataclasses.replace(judged, condition=paper.condition._replace(seed=5))) == ""
    assert reason(judged, "quick") == "budget quick"
    assert reason(dataclasses.replace(judged, planned=3)) == "fewer replicates than planned"
    assert reason(dataclasses.replace(found.conditions[0], planned=20)) == "settings overridden"


def test_rates_are_counted_among_solved_motions(outputs: Path) -> None:
    condition = smoke_results(outputs, "curkovic_motion").conditions[1]
    refuted, leaves, fast = measures.defects(condition)
    assert refuted == (
        condition.verdicts.solved_refuted,
        condition.solved,
    )
    far = [
        link_motions.sampled(link_motions.executed(condition.prepared, solution), 500).links
        for solution in condition.solutions.values()
    ]
    assert leaves.having == sum(bool((q < -1e-6).any() or (q > 180.0 + 1e-6).any()) for q in far)
    assert fast.having == sum(times > 1.0 for times in measures.times_over_limit(condition))
    assert refuted.interval(0.95).low <= refuted.share <= refuted.interval(0.95).high
