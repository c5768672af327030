"""Figures: a function that makes a table of stored runs, and one that draws the table."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report.figures import groups, style
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.comparisons import Values


def excess_table(results: Results, excess: Values) -> pd.DataFrame:
    """Return the share of runs whose path is longer than the straight line by less than x."""
    parts = []
    for condition in results.with_data:
        values = np.sort(excess(condition))
        share = np.arange(1, len(values) + 1) / len(values)
        position = results.position(condition.label)
        names = {"position": position, "condition": condition.label}
        parts.append(pd.DataFrame({**names, "excess_percent": values, "share": share}))
    return pd.concat(parts, ignore_index=True)


def draw_excess(table: pd.DataFrame) -> Figure:
    """Draw the shares as steps."""
    figure, (axes,) = style.panels(3.2)
    for (position, condition), rows in groups(table, ["position", "condition"]):
        colour = style.condition_colour(position)
        axes.step(
            rows["excess_percent"], rows["share"], where="post", color=colour, label=condition
        )
    axes.set(xlabel="length above the straight line [%]", ylabel="share of runs", ylim=(0.0, 1.02))
    style.legend_below(figure, [axes], 3)
    return figure
