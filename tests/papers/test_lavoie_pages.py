"""The pages on Lavoie & Boudreau 2001: what they hold, and the tables behind their figures."""

from pathlib import Path

import numpy as np
import pytest

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.lavoie import figures, measures
from evoexp.papers.lavoie.figures import ShownMotion
from evoexp.paths.motion import Motion
from evoexp.planners.proofs import judge_motion
from evoexp.report.figures import side_by_side
from evoexp.report.pages.page_builder import page_of
from evoexp.report.results import motion_geometry, run_measures
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.inference import Proportion
from references.link_crossings_numpy import squared_distance
from report_samples import (
    can_be_drawn,
    made_up,
    page_settings,
    smoke_experiment,
    smoke_results,
)

LINK, ELLIPSE, BOX = figures.LINK, figures.ELLIPSE, figures.BOX
TARGET, CONTACT = figures.TARGET, figures.CONTACT


@pytest.fixture
def blind(outputs: Path) -> ConditionResults:
    """Return runs of arms that ignore obstacles and take any solution: most of them touch."""
    words = "collision.blind=true", "planner.success=finite"
    return smoke_results(outputs, "lavoie_7dof", *words).conditions[0]


def test_a_sweep_of_one_condition_is_the_page_itself(outputs: Path) -> None:
    results = smoke_results(outputs, "lavoie")
    alone = results._replace(conditions=results.conditions[:1])
    found = page_of(alone, page_settings("lavoie", "lavoie_sweep"))
    assert "fig_3_error" in {drawing.stem for drawing in found.drawings}


def test_arms_stand_as_the_paper_prints(outputs: Path) -> None:
    conditions = smoke_results(outputs, "lavoie").conditions
    table = figures.reaching_table([ShownMotion(c.label, c) for c in conditions])
    rows = dict(list(table.groupby("element")))
    links, ellipses, box = rows[LINK], rows[ELLIPSE], rows[BOX].iloc[0]
    lengths = np.hypot(links["x_end"] - links["x"], links["y_end"] - links["y"])
    printed = [10, 10, 10, 4, 4, 3, 2, 6, 6, 6, 6, 6, 6, 2, 2, 2, 2]
    np.testing.assert_allclose(lengths, printed, atol=1e-9)
    assert (links["sub_path"] == 0).all()
    moved = ellipses.iloc[5:, 7:9] - ellipses.iloc[:5, 7:9].to_numpy()
    np.testing.assert_allclose(moved, [[-5.0, -15.0]] * 5)
    assert list(ellipses["angle_deg"]) == [0.0, 90.0, 0.0, 90.0, 90.0] * 2
    assert tuple(box[["x", "x_end", "y", "y_end"]]) == (16.0, 23.0, 2.0, 11.0)
    targets = rows[TARGET][["x", "y"]].to_numpy()
    assert targets.tolist() == [[15, 5], [18, 8.5], [10, -10], [13, -6.5]]
    assert can_be_drawn(table, figures.draw_reaching)


def test_solutions_show_tested_positions_and_contacts(blind: ConditionResults) -> None:
    replicate, verdict = next(iter(motion_geometry.refuted(blind).items()))
    found = measures.contacts(blind, replicate, verdict)
    table = figures.reaching_table([ShownMotion("7-DOF", blind, replicate, found)])
    rows = dict(list(table.groupby("element")))
    instants = sorted(rows[LINK]["instant"].unique())
    np.testing.assert_allclose(instants, np.arange(21) / 10)  # M = 10 positions of each sub-path
    tips = rows[LINK][rows[LINK]["link"] == 6].set_index("instant")[["x_end", "y_end"]]
    q, assembly = blind.solutions[replicate].reshape(3, 7), blind.prepared.problem.assembly
    for k in (1, 2):
        *_, (_, _, _, end) = motion_geometry.joint_positions(assembly, q[k][:, None] / DEGREE)
        np.testing.assert_allclose(tips.loc[float(k)], end[0, :2], atol=1e-9)
    contact, touching = rows[CONTACT], rows[figures.TOUCHING]
    assert list(contact["instant"]) == pytest.approx([instant for instant, _ in found])
    assert sorted(touching["instant"].unique()) == pytest.approx(sorted(contact["instant"]))
    for row in contact.itertuples():  # a contact lies on a link of the posture in contact
        own = touching[touching["instant"] == row.instant]
        start, end = own[["x", "y"]].to_numpy().T, own[["x_end", "y_end"]].to_numpy().T
        assert squared_distance(start, end, np.array([[row.x], [row.y]])).min() < 1e-8
    box, targets = rows[BOX].iloc[0], rows[TARGET]
    _, near = figures.draw_reaching(table).axes
    for axis, (low, high) in (("x", near.get_xlim()), ("y", near.get_ylim())):
        assert low < min(box[axis], *targets[axis])
        assert high > max(box[f"{axis}_end"], *targets[axis])


def test_either_sub_path_is_judged_by_itself(blind: ConditionResults) -> None:
    planner, problem = blind.prepared
    collides = []
    for solution in blind.solutions.values():
        q = planner.motion(problem, solution).q
        parts = (Motion(np.ascontiguousarray(q[k : k + 2])) for k in range(2))
        verdicts = [judge_motion(planner, problem, part).certified for part in parts]
        collides.append([certified is False for certified in verdicts])
    own = np.array(collides)[run_measures.solved(blind)]
    assert own.any()
    found = measures.refuted(blind)
    assert found.anywhere == Proportion(int(own.any(axis=1).sum()), len(own))
    assert [found.sp1.having, found.sp2.having] == own.sum(axis=0).tolist()


def test_the_distribution_counts_smaller_errors_only(outputs: Path) -> None:
    results = smoke_results(outputs, "lavoie_7dof")
    errors = np.array([0.5, 0.25, np.inf, 0.25])
    printed = [measures.Percentage(7, 1.0, Proportion(935, 1000))]
    table = figures.distribution_table(results, lambda _: errors, lambda _: printed, 0.95)
    steps = table[table["series"] == figures.FOUND]
    rows = steps[["error", "having", "total", "share"]].to_numpy().tolist()
    # the run without a solution is in no step
    assert rows == [[0.0, 0, 4, 0.0], [0.25, 2, 4, 0.5], [0.5, 3, 4, 0.75]]
    point = table[table["series"] == figures.PRINTED].iloc[0]
    assert (point["error"], point["share"]) == (1.0, 0.935)
    assert point["lower"] < 0.935 < point["upper"]
    drawn = figures.draw_distribution(table)
    words = [text.get_text() for legend in drawn.legends for text in legend.get_texts()]
    assert words == ["lavoie_7dof (n = 4)", "printed, lavoie_7dof (their n = 1000)"]
    line = next(line for line in drawn.axes[0].get_lines() if len(line.get_xdata()) == 4)
    assert np.asarray(line.get_ydata())[-1] == 0.75, "the curve goes on to the right end"


def test_attempts_add_up_to_all_runs() -> None:
    experiment = smoke_experiment("lavoie_7dof")
    results = made_up(experiment, lambda _: {"term_attempts": [1.0, 2.0, 1.0, 10.0]})
    assert measures.runs_by_attempts(results.conditions[0]) == "1: 2, 2: 1, 10: 1"


def test_shares_mark_what_is_printed_and_survive_nothing() -> None:
    three, none = Proportion(3, 4), Proportion(0, 0)
    rows = [("error below 1", 0, "a", three), ("error below 1", 1, "b", none)]
    table = side_by_side.shares_table(rows, {"error below 1": 0.935}, 0.95)
    assert list(table["printed"]) == [0.935, 0.935]
    (axes,) = side_by_side.draw_shares(table).axes
    assert [text.get_text().strip() for text in axes.texts] == ["3/4", "0/0"]
    low, high = axes.get_xlim()
    assert low < 100 * table["lower"].iloc[0] < 93.5 < high
    assert can_be_drawn(
        side_by_side.shares_table([("x", 0, "a", none)], {}, 0.95), side_by_side.draw_shares
    )
