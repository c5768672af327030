"""The figures that sweeps share: boxes of all runs, shares on one scale, many conditions."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from evoexp.report.figures import convergence, effects, matrix, shares, style
from evoexp.report.figures.boxes import draw_box
from evoexp.report.statistics.inference import Proportion


def values(*runs: tuple[str, list[float]]) -> pd.DataFrame:
    parts = [
        pd.DataFrame(
            {
                "quantity": "evaluations",
                "position": position,
                "condition": label,
                "replicate": range(len(found)),
                "value": np.array(found, dtype=np.float64),
                "failed": 0,
            }
        )
        for position, (label, found) in enumerate(runs)
    ]
    return pd.concat(parts, ignore_index=True)


def medians(axes: object, width: float = 2.0) -> list[float]:
    """Return where the medians of the boxes are drawn, from left to right or top to bottom."""
    lines = [line for line in axes.get_lines() if line.get_linewidth() == width]  # type: ignore[attr-defined]
    return [float(line.get_xdata()[0]) for line in lines]


def test_runs_that_never_get_there_count_in_the_box() -> None:
    """Of 2, 4, 6, never, never the median is 6; of the three successful runs alone it is 4."""
    figure = effects.draw_values(
        values(("all", [2.0, 3.0, 4.0, 5.0, 6.0]), ("few", [2.0, 4.0, 6.0, np.inf, np.inf]))
    )
    axes = figure.axes[0]
    never = 6.0 + effects.BEYOND * 4.0
    assert medians(axes) == [4.0, 6.0]
    words = [text.get_text() for text in axes.texts]
    assert words == ["5 of 5", "3 of 5"]
    assert axes.get_xticklabels()[-1].get_text() == "never"
    assert axes.get_xticks()[-1] == pytest.approx(never)
    assert max(axes.get_xticks()[:-1]) <= 6.0


def test_a_median_may_be_never() -> None:
    figure = effects.draw_values(values(("none", [np.inf] * 4), ("one", [1.0, *[np.inf] * 3])))
    never = 1.0 + effects.BEYOND
    assert medians(figure.axes[0]) == [pytest.approx(never)] * 2
    only = effects.draw_values(values(("none", [np.inf] * 4)))
    assert medians(only.axes[0]) == [1.0]


def test_without_such_runs_nothing_is_said_of_them() -> None:
    axes = effects.draw_values(values(("all", [2.0, 3.0, 4.0]))).axes[0]
    assert not axes.texts
    assert "never" not in [label.get_text() for label in axes.get_xticklabels()]


def test_a_box_is_tukeys() -> None:
    """Against matplotlib's own statistics, for many values and for few."""
    from matplotlib import cbook

    rng = np.random.default_rng(3)
    for size in (5, 30, 200):
        found = rng.standard_t(2, size)
        axes = style.figure(2.0).subplots()
        draw_box(axes, 0.0, found, "#000000")
        (expected,) = cbook.boxplot_stats(found)
        drawn = np.concatenate([np.ravel(line.get_xdata()) for line in axes.get_lines()])
        for name in ("q1", "med", "q3", "whislo", "whishi"):
            assert np.isclose(drawn, expected[name]).any(), name


def test_panels_of_shares_have_one_scale() -> None:
    rows = [
        ("high", 0, "a", Proportion(180, 200)),
        ("high", 1, "b", Proportion(200, 200)),
        ("low", 0, "a", Proportion(4, 200)),
        ("low", 1, "b", Proportion(0, 0)),
    ]
    panels = shares.draw_shares(shares.shares_table(rows, {}, 0.95)).axes
    (one, two), (three, four) = (axes.get_xlim() for axes in panels)
    assert two - one == pytest.approx(four - three)
    assert one < 100 * Proportion(180, 200).interval(0.95).low
    assert (two > 100.0, three < 0.0) == (True, True)
    wide = [*rows, ("low", 2, "c", Proportion(150, 200))]
    panels = shares.draw_shares(shares.shares_table(wide, {}, 0.95)).axes
    assert panels[0].get_xlim() == panels[1].get_xlim()


def curves(count: int) -> pd.DataFrame:
    found = [
        pd.DataFrame(
            {
                "condition": f"condition {k}",
                "position": k,
                "quantity": convergence.NAMES["best_cost"],
                "generation": range(3),
                "evaluations": [10.0, 20.0, 30.0],
                "median": [3.0 + k, 2.0 + k, 1.0 + k],
                "replicates": 4,
            }
        )
        for k in range(count)
    ]
    return pd.concat(found, ignore_index=True)


@pytest.mark.parametrize("count", [3, 8, 9, 20])
def test_no_two_conditions_of_a_panel_share_a_colour(count: int) -> None:
    figure = convergence.draw_best(curves(count))
    named: list[str] = []
    for axes in figure.axes:
        own = [line for line in axes.get_lines() if not str(line.get_label()).startswith("_")]
        assert len({to_hex(line.get_color()) for line in own}) == len(own)
        assert len(axes.get_lines()) == count, "the others are there, in grey"
        named += [str(line.get_label()) for line in own]
    assert {f"condition {k} (n = 4)" for k in range(count)} == set(named)


def test_rows_of_more_conditions_than_colours_have_no_colours_of_others() -> None:
    assert [style.row_colour(k, 8) for k in range(8)] == list(style.CONDITION_COLOURS)
    assert [style.row_colour(k, 9) for k in (0, 1, 8)] == [
        style.CONDITION_COLOURS[0],
        style.NEUTRAL,
        style.NEUTRAL,
    ]


@pytest.mark.parametrize(("length", "columns"), [(4, 6), (38, 2), (90, 1)])
def test_a_legend_takes_as_many_columns_as_fit(length: int, columns: int) -> None:
    figure = style.figure(3.0)
    axes = figure.subplots()
    for k in range(6):
        axes.plot([0.0, 1.0], [0.0, k], label=f"{'w' * (length // 2)}{'i' * (length // 2 - 1)}{k}")
    style.legend_below(figure, [axes], 6)
    (legend,) = figure.legends
    assert len(legend.get_texts()) == 6
    figure.draw_without_rendering()
    assert len({round(text.get_window_extent().x0) for text in legend.get_texts()}) == columns
    assert legend.get_window_extent().width <= figure.bbox.width or columns == 1


@pytest.mark.parametrize(
    ("count", "name"), [(3, "c{}"), (9, "05cccfce1d2{}"), (5, "w" * 40 + "{}")]
)
def test_names_beside_a_matrix_are_not_cut_off(count: int, name: str) -> None:
    labels = [name.format(k) for k in range(count)]
    pairs = [(a, b, 0.6, 0.5, 0.7, 0.2, 20, 20) for a in labels for b in labels if a != b]
    names = ["condition", "other", "a12", "lower", "upper", "p_adjusted", "runs", "runs_other"]
    table = pd.DataFrame(pairs, columns=names).assign(significance=0.05)
    kept: list[Figure] = []

    def draw() -> Figure:
        kept.append(matrix.draw_matrix(table))
        return kept[0]

    style.drawn(draw, ("png",), 100)
    for axes in kept[0].axes:
        for text in (*axes.get_yticklabels(), *axes.get_xticklabels(), axes.yaxis.label):
            box = text.get_window_extent()
            assert box.x0 >= 0.0, text.get_text()
            assert box.x1 <= kept[0].bbox.width
