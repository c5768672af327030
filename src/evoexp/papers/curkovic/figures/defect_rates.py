"""How many motions of every condition have a defect, with intervals."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from evoexp.report import style
from evoexp.report.rows import groups


def rates_table(rows: Sequence[tuple[str, int, str, int, int, float, float]]) -> pd.DataFrame:
    """Return shares of motions.

    Args:
        rows: (defect, position, condition, failing motions, solved motions, lower and upper end of
            the interval).

    Returns:
        Columns defect, position, condition, failing, solved, share, lower, upper.
    """
    table = pd.DataFrame(
        rows, columns=["defect", "position", "condition", "failing", "solved", "lower", "upper"]
    )
    return table.assign(share=table["failing"] / table["solved"].clip(lower=1))


def draw_rates(table: pd.DataFrame) -> Figure:
    """Draw one panel per defect, one row per condition."""
    defects = list(dict.fromkeys(table["defect"]))
    labels = dict(zip(table["position"], table["condition"], strict=True))
    rows_of = {position: row for row, position in enumerate(sorted(labels))}
    figure = style.figure(0.26 * len(labels) + 1.0)
    panels = figure.subplots(1, len(defects), sharex=True, sharey=True, squeeze=False)[0]
    for axes, defect in zip(panels, defects, strict=True):
        for position, rows in groups(table[table["defect"] == defect], "position"):
            colour, y = style.condition_colour(int(position)), rows_of[position]
            axes.hlines(y, rows["lower"], rows["upper"], color=colour, linewidth=1.6)
            axes.plot(rows["share"], [y], "o", color=colour, markersize=5)
            text = f"{rows['failing'].iloc[0]}/{rows['solved'].iloc[0]}"
            axes.annotate(
                text,
                (1.0, y),
                xycoords=axes.get_yaxis_transform(),
                fontsize=6.5,
                va="center",
                ha="left",
            )
        axes.set_xlim(-0.03, 1.03)
        axes.set_xlabel("share of solved motions")
        axes.set_title(defect, fontsize=7.5)
    panels[0].set_yticks(list(rows_of.values()), [labels[position] for position in rows_of])
    panels[0].set_ylim(len(labels) - 0.5, -0.5)
    return figure
