"""How unsafe the nodes are that paths pass (Chen & Zalzala 1995, Eq. 3)."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report.kit import ConditionResults, groups, style


def places_table(shown: Sequence[tuple[str, ConditionResults, np.ndarray]]) -> pd.DataFrame:
    """Return how many nodes of every unsafeness the paths of some conditions pass.

    Args:
        shown: (name, condition, unsafeness (along x, along y)).

    Returns:
        Columns position, condition, unsafeness, nodes (mean over the runs), runs.
    """
    rows: list[tuple[object, ...]] = []
    for position, (name, condition, unsafeness) in enumerate(shown):
        paths = [values.reshape(-1, 2).astype(int) for values in condition.solutions.values()]
        passed = np.concatenate([unsafeness[path[:, 0], path[:, 1]] for path in paths])
        for value in np.unique(unsafeness):
            count = float(np.count_nonzero(passed == value)) / len(paths)
            rows.append((position, name, float(value), count, len(paths)))
    return pd.DataFrame(rows, columns=["position", "condition", "unsafeness", "nodes", "runs"])


def draw_places(table: pd.DataFrame) -> Figure:
    """Draw one bar per unsafeness and condition."""
    figure, (axes,) = style.row_of_panels(2.7, 1)
    values = sorted(table.loc[table["nodes"] > 0.0, "unsafeness"].unique())
    count = table["position"].nunique()
    width = 0.8 / count
    for k, (position, rows) in enumerate(groups(table, "position")):
        own = rows.set_index("unsafeness")["nodes"].reindex(values)
        x = np.arange(len(values)) + width * (k - 0.5 * (count - 1))
        label = f"{rows['condition'].iloc[0]} (n = {rows['runs'].iloc[0]})"
        axes.bar(x, own, width=width, color=style.condition_colour(int(position)), label=label)
    axes.set_xticks(np.arange(len(values)), [f"{value:g}" for value in values])
    axes.set(
        xlabel="unsafeness Sᵢ of a node (1: far from everything)", ylabel="nodes per path, mean"
    )
    axes.grid(visible=False, axis="x")
    style.legend_below(figure, axes, min(count, 4))
    return figure
