"""A matrix of effect sizes: each condition against each other one."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report import style
from evoexp.report.claims import Comparison
from evoexp.report.rows import records

SIZE = 0.44  # [inch] of a cell
LONGEST = 28  # characters of a name beside the matrix


def matrix_table(
    pairs: Sequence[tuple[str, str]], rows: Sequence[Comparison], significance: float
) -> pd.DataFrame:
    """Return how often one condition of each pair is better, seen from either side.

    Args:
        pairs: Labels (first, second).
        rows: Their comparisons.
        significance: Below this adjusted p-value a difference counts.

    Returns:
        Columns condition, other, a12 (of the condition being better), lower, upper, p_adjusted,
        seeds, significance.
    """
    found = []
    for (first, second), row in zip(pairs, rows, strict=True):
        low, high = row.better.interval
        told = (row.p_adjusted, row.num_seeds)
        found.append((first, second, row.better.a12, low, high, *told))
        found.append((second, first, 1.0 - row.better.a12, 1.0 - high, 1.0 - low, *told))
    names = ["condition", "other", "a12", "lower", "upper", "p_adjusted", "seeds"]
    return pd.DataFrame(found, columns=names).assign(significance=significance)


def draw_matrix(table: pd.DataFrame) -> Figure:
    """Draw one cell per pair: A12 of the row's condition being better than the column's."""
    labels = list(dict.fromkeys(table["condition"]))
    count = len(labels)
    places = {label: k for k, label in enumerate(labels)}
    cells = np.full((count, count), np.nan)
    figure = style.figure(SIZE * count + 1.9)
    axes = figure.subplots()
    for row in records(table):
        y, x = places[row.condition], places[row.other]
        cells[y, x] = row.a12
        clear = row.p_adjusted < row.significance
        look: dict[str, Any] = {"weight": "bold"} if clear else {"color": style.NEUTRAL}
        axes.annotate(f"{row.a12:.2f}", (x, y), ha="center", va="center", fontsize=7, **look)
    image = axes.imshow(cells, cmap="RdBu", vmin=0.0, vmax=1.0, alpha=0.6)
    figure.colorbar(image, ax=axes, label="A12: the row's condition is better", shrink=0.8)
    names = [label if len(label) <= LONGEST else f"{label[: LONGEST - 1]}…" for label in labels]
    axes.set_xticks(range(count), names, rotation=40, ha="right")
    axes.set_yticks(range(count), names)
    axes.grid(visible=False)
    axes.set_xlabel(f"bold: adjusted p < {table['significance'].iloc[0]:g}")
    return figure
