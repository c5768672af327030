import copy

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from evoexp.papers.rana import motions
from evoexp.papers.rana.figures import planar_models, planar_motion
from evoexp.report.figures import convergence, style
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import Results


def texts(figure: Figure) -> list[str]:
    """Return every word that a figure shows, its legends included."""
    found = [
        text.get_text()
        for axes in figure.axes
        for text in (axes.xaxis.label, axes.yaxis.label, *axes.texts)
    ]
    found += [axes.get_title(loc=place) for axes in figure.axes for place in ("left", "center")]
    return found + [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def curves(condition: str, position: int, evaluations: float) -> pd.DataFrame:
    parts = []
    for quantity in convergence.NAMES.values():
        generation = np.arange(6)
        median = 100.0 + generation * (position + 1.0)
        columns = {
            "condition": condition,
            "position": position,
            "quantity": quantity,
            "generation": generation,
            "evaluations": evaluations * (generation + 1),
            "median": median,
            "lower": median - 5.0,
            "upper": median + 5.0,
            "replicates": [4, 4, 4, 3, 3, 3],
        }
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)


@pytest.mark.parametrize("draw", [convergence.draw_cost, convergence.draw_fitness])
def test_convergence_shows_medians_bands_and_counts(draw: object) -> None:
    table = pd.concat([curves("GA", 0, 50.0), curves("random", 1, 50.0)])
    figure = draw(table)  # type: ignore[operator]
    axes = figure.axes[0]
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) == 6]
    np.testing.assert_array_equal(lines[0].get_ydata(), 100.0 + np.arange(6))
    assert len(lines) == 4
    assert {to_hex(line.get_color()).upper() for line in lines} == set(style.CONDITION_COLOURS[:2])
    assert "GA, best so far (n = 3…4)" in texts(figure)
    assert axes.get_xlabel() == "generation"
    above = axes.child_axes[0]
    assert above.get_xlabel() == "evaluations"
    assert above._functions[0](5.0) == pytest.approx(300.0)


def test_conditions_of_other_effort_share_an_axis_of_evaluations() -> None:
    figure = convergence.draw_cost(pd.concat([curves("small", 0, 20.0), curves("large", 1, 50.0)]))
    axes = figure.axes[0]
    assert axes.get_xlabel() == "evaluations"
    assert axes.get_xlim()[1] == 300.0


def test_convergence_of_infinite_costs_and_of_one_generation() -> None:
    table = curves("GA", 0, 50.0)
    table.loc[table["generation"] < 2, ["median", "lower", "upper"]] = np.inf
    single = curves("GA", 0, 50.0).query("generation == 0")
    for data in (table, single):
        for draw in (convergence.draw_cost, convergence.draw_fitness):
            images = style.drawn(lambda data=data, draw=draw: draw(data), ("png",), 50)  # type: ignore[misc]
            assert images["png"].startswith(b"\x89PNG")


def test_fitness_is_the_papers(results: Results) -> None:
    costs, fitness = convergence.cost_table(results), convergence.fitness_table(results)
    np.testing.assert_allclose(fitness["median"], 500.0 - costs["median"])
    np.testing.assert_allclose(
        fitness["upper"] - fitness["lower"], costs["upper"] - costs["lower"], atol=1e-9
    )
    best = fitness[
        (fitness["condition"] == "via-point GA") & (fitness["quantity"] == "best so far")
    ]
    assert list(best["generation"]) == [0, 1, 2, 3, 4]
    assert best["median"].is_monotonic_increasing


def test_arms_stand_at_start_and_goal_of_table_2(results: Results) -> None:
    table = planar_models.arms_table(results.conditions[0])
    first = table[(table["posture"] == "start") & (table["joint"] == 0)]
    assert list(first["angle_deg"]) == [45.0, 225.0]
    assert list(first["reference_deg"]) == [0.0, -360.0] or list(
        first["reference_deg"] % 360.0
    ) == [0.0, 0.0]
    np.testing.assert_allclose(first[["x", "y"]], [[0.0, 0.0], [0.0, 8.0]])
    length = np.hypot(table["x_end"] - table["x"], table["y_end"] - table["y"])
    np.testing.assert_allclose(length, 4.0)
    assert {"θ₁ = 45°", "θ₂ = 225°", "α₁ = 225°", "x [unit]"} <= set(
        texts(planar_models.draw_arms(table))
    )


def test_via_points_are_those_of_the_solution(results: Results) -> None:
    condition = results.conditions[0]
    table = planar_models.via_points_table(condition)
    final = table[table["stage"] == "best at the end"]
    flat = final[["joint_1_deg", "joint_2_deg"]].to_numpy().ravel()
    np.testing.assert_array_equal(flat, condition.solutions[condition.best_replicate])
    figure = planar_models.draw_via_points(table)
    assert {"θ₁ [deg]", "α₂ [deg]", "0", "20", "arm 2"} <= set(texts(figure))


def test_circles_show_the_least_distance(results: Results) -> None:
    condition = results.conditions[0]
    table = planar_models.circles_table(condition)
    assert (table["element"] == "circle").sum() == 18
    row = table[table["element"] == "centres"].iloc[0]
    q = motion_geometry.configurations(
        condition.prepared, condition.solutions[condition.best_replicate]
    )
    assert row["distance"] == pytest.approx(
        condition.prepared.problem.centre_distances(q).min(), abs=1e-9
    )
    assert np.hypot(row["x_end"] - row["x"], row["y_end"] - row["y"]) == pytest.approx(
        row["distance"]
    )
    bodies = table[table["element"] == "bodies"].iloc[0]
    assert bodies["distance"] <= row["distance"] + 1e-9
    words = texts(planar_models.draw_circles(table))
    assert f"least distance of circle centres: {row['distance']:.3f} unit" in words


def test_snapshots_cut_the_motion_into_stages(results: Results) -> None:
    table = planar_motion.snapshots_table(results.conditions[0])
    stages = table.groupby("stage")[["first", "last"]].first().to_numpy().tolist()
    assert stages == [[0, 4], [4, 8], [8, 12], [12, 16], [16, 20], [0, 20]]
    whole = table[table["stage"] == 5]
    assert len(whole) == 21 * 4
    start = whole[(whole["instant"] == 0) & (whole["arm"] == 0) & (whole["link"] == 1)].iloc[0]
    assert (start["x_end"], start["y_end"]) == pytest.approx(
        (4.0 * np.sqrt(0.5), 4.0 * np.sqrt(0.5) - 4.0)
    )
    figure = planar_motion.draw_snapshots(table)
    assert {"instants 0–4", "all instants 0–20", "arm 1", "arm 2", "y [unit]"} <= set(texts(figure))


def test_paths_of_all_replicates(results: Results) -> None:
    table = planar_motion.paths_table(results.conditions[0])
    assert sorted(table["replicate"].unique()) == [-1, 0, 1]
    ends = table[(table["arm"] == 0) & (table["instant"] == 20)]
    np.testing.assert_allclose(ends[["joint_1_deg", "joint_2_deg"]], [[135.0, 135.0]] * 3)
    assert "all replicates (n = 2)" in texts(planar_motion.draw_paths(table))


def test_of_many_replicates_some_paths_are_drawn(
    results: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    condition = copy.copy(results.conditions[0])
    first, second = condition.solutions.values()
    vars(condition)["solutions"] = {0: first, 1: second, 2: first, 3: second}
    monkeypatch.setattr(motions, "MOST_PATHS", 2)
    table = planar_motion.paths_table(condition)
    assert sorted(table["replicate"].unique()) == [-1, 0, 1]
    assert "2 of 4 replicates" in texts(planar_motion.draw_paths(table))
    monkeypatch.setattr(motions, "MOST_PATHS", 4)
    everything = planar_motion.paths_table(condition)
    assert "all replicates (n = 4)" in texts(planar_motion.draw_paths(everything))


def test_distances_are_best_and_envelope(results: Results) -> None:
    condition = results.conditions[0]
    sampled = planar_motion.sampled_distances(condition, 4)
    assert len(sampled) == 4 * 81  # straight line, best replicate, lowest and highest of all
    table = planar_motion.distances_table(condition, sampled)
    sets = {
        key: rows.set_index("instant")["distance"]
        for key, rows in table.groupby(["measure", "series"])
    }
    for measure in (planar_motion.CENTRES, planar_motion.LINKS):
        best, low, high = (
            sets[measure, s]
            for s in (planar_motion.BEST, planar_motion.LOWEST, planar_motion.HIGHEST)
        )
        assert (low <= best).all()
        assert (best <= high).all()
        at = sets[measure, planar_motion.AT_VIA_POINTS]
        assert list(at.index) == list(range(21))
        np.testing.assert_array_equal(at, best[at.index])
    centres, links = (
        sets[m, planar_motion.STRAIGHT] for m in (planar_motion.CENTRES, planar_motion.LINKS)
    )
    assert (links <= centres + 1e-9).all()  # circles sit on the links
    assert links.min() == 0.0
    words = texts(planar_motion.draw_distances(table))
    assert {
        "below the required distance: 1 unit between arms",
        "least distance [unit]",
        planar_motion.AT_VIA_POINTS,
    } <= set(words)


def test_a_figure_has_the_same_bytes_each_time_whatever_the_users_style() -> None:
    import matplotlib as mpl

    table = curves("GA", 0, 50.0)
    first = style.drawn(lambda: convergence.draw_cost(table), ("svg", "png", "pdf"), 60)
    with mpl.rc_context({"font.size": 20.0, "lines.linewidth": 9.0}):
        again = style.drawn(lambda: convergence.draw_cost(table), ("svg", "png", "pdf"), 60)
        assert mpl.rcParams["font.size"] == 20.0
    assert first == again
    assert b"<dc:date>" not in first["svg"]


def test_colours_repeat_only_after_all_are_used() -> None:
    assert len({style.arm_colour(k) for k in range(6)}) == 6
    assert style.arm_colour(6) == style.arm_colour(0)
    assert len({style.condition_colour(k) for k in range(8)}) == 8
    assert style.joint_symbol(1, 11) == "α₁₂"
    assert style.joint_symbol(7, 0) == "q8,₁"
