"""The pages on Lavoie & Boudreau 2001: what they hold, and the tables behind their figures."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.lavoie import measures
from evoexp.papers.lavoie.figures import reaching_motions, run_distributions
from evoexp.papers.lavoie.figures.reaching_motions import ShownMotion
from evoexp.paths.motion import Motion
from evoexp.planners.proofs import judge_motion
from evoexp.report.figures import shares
from evoexp.report.pages.page_builder import page_of
from evoexp.report.results import motion_geometry, run_measures
from evoexp.report.results.stored_results import ConditionResults, gather
from evoexp.report.statistics.inference import Proportion
from report_samples import (
    can_be_drawn,
    figure_stems,
    page_settings,
    smoke_experiment,
    smoke_report,
    smoke_results,
    store,
)


def blind(outputs: Path) -> ConditionResults:
    """Return runs of arms that ignore obstacles and are content with any solution.

    Most of them touch.
    """
    return smoke_results(
        outputs, "lavoie_7dof", "collision.blind=true", "planner.success=finite"
    ).conditions[0]


def test_no_generation_is_read(outputs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports of thousands of runs live on summaries and solutions."""

    def refuse(*_: object) -> None:
        raise AssertionError("generations were read")

    results = smoke_results(outputs, "lavoie")
    monkeypatch.setattr("evoexp.report.results.stored_results.read_generations", refuse)
    for drawing in page_of(results, page_settings("lavoie")).drawings:
        drawing.table()


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("lavoie_stopping", {"shares", "values", "effects", "stopping"}),
        ("lavoie_coding", {"shares", "values", "effects"}),
        ("lavoie_controls", {"shares", "values", "effects"}),
        ("lavoie_sweeps_positions", {"shares", "values", "effects"}),
    ],
)
def test_sweeps_have_figures_and_a_row_of_shares_per_condition(
    outputs: Path, name: str, expected: set[str]
) -> None:
    directory = smoke_report(outputs, name)
    assert figure_stems(directory) == {*expected, "scene"}
    text = (directory / "index.md").read_text()
    for label, _ in smoke_experiment(name).conditions:
        assert f"| {label}: shares of runs |" in text
    table = pd.read_csv(directory / "shares.csv")
    quantities = ["error below 1", "with a solution", "touch an obstacle"]
    if name == "lavoie_sweeps_positions":
        quantities = ["touch an obstacle", "on SP1", "on SP2"]
    assert list(dict.fromkeys(table["quantity"])) == quantities
    compares_settings = name in ("lavoie_stopping", "lavoie_coding")
    assert ("weak evidence" in text) == compares_settings


@pytest.mark.matrix
def test_headline_claims_are_judged_under_every_other_number(outputs: Path) -> None:
    name = "lavoie_assumptions"
    experiment = smoke_experiment(name)
    store(outputs, experiment)
    results = gather(
        *(outputs, experiment.conditions, experiment.num_replicates, name, experiment.budget, ""),
        experiment.options,
    )
    page = page_of(results, page_settings(name))
    effects, numbers = page.tables
    changed = {str(row[0]): row[1] for row in effects.rows}
    assert list(changed) == [label for label, _ in experiment.conditions]
    assert {label for label, names in changed.items() if names == "as assumed"} == {
        "7-DOF",
        "10-DOF",
    }
    assert changed["10-DOF, long lips"].startswith("`scenario.obstacles[3].center`, ")
    assert "`scenario.box_x`" in changed["narrow box"]
    rows = {str(row[0]): row for row in numbers.rows}
    assert rows["`ga.mutation_power`"][4] == "b = 1; b = 5"
    texts = [claim.text for claim in page.claims]
    assert texts[0] == "7-DOF: a position error below 1 in 93.5 % of runs"
    assert texts[1] == f"{texts[0]} — whatever number is assumed"
    assert len(texts) == 2 * 2 * 3, "arms × (as assumed, survives) × headlines"
    survives = page.claims[1]
    assert survives.n == "13 variations"
    assert len(page.drawings[0].table()) == 3 * len(experiment.conditions)


def test_a_sweep_of_one_condition_is_the_page_itself(outputs: Path) -> None:
    results = smoke_results(outputs, "lavoie")
    alone = results._replace(conditions=results.conditions[:1])
    found = page_of(alone, page_settings("lavoie", "lavoie_sweep"))
    assert "fig_3_error" in {drawing.stem for drawing in found.drawings}


def test_arms_stand_as_the_paper_prints(outputs: Path) -> None:
    results = smoke_results(outputs, "lavoie")
    table = reaching_motions.reaching_table([ShownMotion(c.label, c) for c in results.conditions])
    links = table[table["element"] == reaching_motions.LINK]
    lengths = np.hypot(links["x_end"] - links["x"], links["y_end"] - links["y"])
    np.testing.assert_allclose(lengths[:7], [10, 10, 10, 4, 4, 3, 2], atol=1e-9)
    np.testing.assert_allclose(lengths[7:], [6, 6, 6, 6, 6, 6, 2, 2, 2, 2], atol=1e-9)
    assert (links["sub_path"] == 0).all()
    ellipses = table[table["element"] == reaching_motions.ELLIPSE]
    np.testing.assert_allclose(
        ellipses.iloc[5:, 7:9] - ellipses.iloc[:5, 7:9].to_numpy(), [[-5.0, -15.0]] * 5
    )
    assert list(ellipses["angle_deg"]) == [0.0, 90.0, 0.0, 90.0, 90.0] * 2
    box = table[table["element"] == reaching_motions.BOX].iloc[0]
    assert tuple(box[["x", "x_end", "y", "y_end"]]) == (16.0, 23.0, 2.0, 11.0)
    targets = table[table["element"] == reaching_motions.TARGET]
    assert [tuple(row) for row in targets[["x", "y"]].to_numpy()] == [
        (15, 5),
        (18, 8.5),
        (10, -10),
        (13, -6.5),
    ]
    assert can_be_drawn(table, reaching_motions.draw_reaching)


def test_solutions_show_tested_positions_and_contacts(outputs: Path) -> None:
    condition = blind(outputs)
    replicate, verdict = next(iter(motion_geometry.refuted(condition).items()))
    found = measures.contacts(condition, replicate, verdict)
    table = reaching_motions.reaching_table([ShownMotion("7-DOF", condition, replicate, found)])
    links = table[table["element"] == reaching_motions.LINK]
    instants = sorted(links["instant"].unique())
    np.testing.assert_allclose(instants, np.arange(21) / 10)  # M = 10 positions of each sub-path
    tips = links[links["link"] == 6].set_index("instant")
    q = condition.solutions[replicate].reshape(3, 7)
    for instant, posture in ((1.0, q[1]), (2.0, q[2])):
        *_, (_, _, _, end) = motion_geometry.joint_positions(
            condition.prepared.problem.assembly, posture[:, None] / DEGREE
        )
        np.testing.assert_allclose(
            tips.loc[instant, ["x_end", "y_end"]].to_numpy(float), end[0, :2], atol=1e-9
        )
    contact = table[table["element"] == reaching_motions.CONTACT]
    assert list(contact["instant"]) == pytest.approx([instant for instant, _ in found])
    touching = table[table["element"] == reaching_motions.TOUCHING]
    assert sorted(touching["instant"].unique()) == pytest.approx(sorted(contact["instant"]))
    for row in contact.itertuples():  # a contact lies on a link of the posture in contact
        own = touching[touching["instant"] == row.instant][["x", "y", "x_end", "y_end"]].to_numpy()
        assert min(_to_segment(np.array([row.x, row.y]), line) for line in own) < 1e-4
    box = table[table["element"] == reaching_motions.BOX].iloc[0]
    targets = table[table["element"] == reaching_motions.TARGET]
    _, near = reaching_motions.draw_reaching(table).axes
    (left, right), (low, high) = near.get_xlim(), near.get_ylim()
    assert left < min(box["x"], *targets["x"]) and right > max(box["x_end"], *targets["x"])
    assert low < min(box["y"], *targets["y"]) and high > max(box["y_end"], *targets["y"])


def _to_segment(point: np.ndarray, line: np.ndarray) -> float:
    start, along = line[:2], line[2:] - line[:2]
    share = np.clip((point - start) @ along / (along @ along), 0.0, 1.0)
    return float(np.linalg.norm(point - start - share * along))


def test_either_sub_path_is_judged_by_itself(outputs: Path) -> None:
    condition = blind(outputs)
    prepared = condition.prepared
    expected = []
    for replicate in condition.summaries.index:
        q = prepared.planner.motion(prepared.problem, condition.solutions[replicate]).q
        parts = (Motion(np.ascontiguousarray(q[k : k + 2])) for k in range(2))
        expected.append(
            [
                judge_motion(prepared.planner, prepared.problem, part).certified is False
                for part in parts
            ]
        )
    assert np.array(expected).any()
    found = measures.refuted(condition)
    solved = run_measures.solved(condition)
    assert found.anywhere == Proportion(
        int(np.array(expected)[solved].any(axis=1).sum()), int(solved.sum())
    )
    counts = [found.sp1.having, found.sp2.having]
    assert counts == np.array(expected)[solved].sum(axis=0).tolist()


def test_the_distribution_counts_smaller_errors_only(outputs: Path) -> None:
    results = smoke_results(outputs, "lavoie_7dof")
    errors = np.array([0.5, 0.25, np.inf, 0.25])
    printed = [measures.Percentage(7, 1.0, 935)]
    table = run_distributions.distribution_table(results, lambda _: errors, lambda _: printed, 0.95)
    steps = table[table["series"] == run_distributions.FOUND]
    assert list(steps["error"]) == [0.0, 0.25, 0.5]
    assert list(steps["having"]) == [0, 2, 3]  # the run without a solution is in no step
    assert (steps["total"] == 4).all()
    assert list(steps["share"]) == [0.0, 0.5, 0.75]
    point = table[table["series"] == run_distributions.PRINTED].iloc[0]
    assert (point["error"], point["share"]) == (1.0, 0.935)
    assert point["lower"] < 0.935 < point["upper"]
    figure = run_distributions.draw_distribution(table)
    words = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert words == ["lavoie_7dof (n = 4)", "printed, lavoie_7dof (their n = 1000)"]
    line = next(line for line in figure.axes[0].get_lines() if len(line.get_xdata()) == 4)
    assert np.asarray(line.get_ydata())[-1] == 0.75, "the curve goes on to the right end"


def test_attempts_add_up_to_all_runs(outputs: Path) -> None:
    results = smoke_results(outputs, "lavoie")
    table = run_distributions.attempts_table(results, 0.95)
    assert list(table["attempts"]) == [*range(1, 11)] * 2
    assert list(table.groupby("position")["having"].sum()) == [2, 2]
    means = table.groupby("position")["mean"].first()
    assert list(means) == [c.column("term_attempts").mean() for c in results.conditions]


def test_shares_mark_what_is_printed_and_survive_nothing() -> None:
    rows = [
        ("error below 1", 0, "a", Proportion(3, 4)),
        ("error below 1", 1, "b", Proportion(0, 0)),
    ]
    table = shares.shares_table(rows, {"error below 1": 0.935}, 0.95)
    assert list(table["printed"]) == [0.935, 0.935]
    figure = shares.draw_shares(table)
    (axes,) = figure.axes
    assert [text.get_text().strip() for text in axes.texts] == ["3/4", "0/0"]
    low, high = axes.get_xlim()
    assert low < 100 * table["lower"].iloc[0] < 93.5 < high
    empty = shares.shares_table([("x", 0, "a", Proportion(0, 0))], {}, 0.95)
    assert can_be_drawn(empty, shares.draw_shares)
