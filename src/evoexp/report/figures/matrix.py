"""A matrix of effect sizes: each condition against each of the others."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report.figures import records, style
from evoexp.report.statistics.comparisons import Comparison

SIZE = 0.44  # [inch] of a cell
LONGEST = 28  # characters of a name beside the matrix
BESIDE = 1.4  # [inch] of the colour bar with its words, and of gaps
NARROWEST = 3.2  # [inch] of the figure
BAR = 0.14  # [inch] width of the colour bar
LUMINANCE = (0.2126, 0.7152, 0.0722)  # of red, green and blue (ITU-R BT.709)
DARK = 0.46  # [-] luminance below which a cell is dark


def matrix_table(
    compared_pairs: Sequence[tuple[tuple[str, str], Comparison]], significance: float
) -> pd.DataFrame:
    """Return how often one condition of each labelled pair is better, seen from either side."""
    found = []
    for (first, second), row in compared_pairs:
        low, high = row.better.interval
        a12, p, (one, two) = row.better.a12, row.p_adjusted, row.sizes
        found.append((first, second, a12, low, high, p, one, two))
        found.append((second, first, 1.0 - a12, 1.0 - high, 1.0 - low, p, two, one))
    names = ["condition", "other", "a12", "lower", "upper", "p_adjusted", "runs", "runs_other"]
    return pd.DataFrame(found, columns=names).assign(significance=significance)


def draw_matrix(table: pd.DataFrame) -> Figure:
    """Draw one cell per pair: A12 of the row's condition being better than the column's."""
    labels, significance = list(dict.fromkeys(table["condition"])), table["significance"].iloc[0]
    count = len(labels)
    cells = table.assign(**{name: table[name].map(labels.index) for name in ("condition", "other")})
    a12 = cells.pivot(index="condition", columns="other", values="a12").to_numpy()
    names = [f"{k}  {style.shortened(label, LONGEST)}" for k, label in enumerate(labels, 1)]
    figure = style.figure(SIZE * count + 0.7, NARROWEST)
    axes = figure.subplots()
    image = axes.imshow(a12, cmap="RdBu", vmin=0.0, vmax=1.0)
    # numbers, white in dark cells
    for row in records(cells):
        dark = np.dot(LUMINANCE, image.to_rgba(row.a12)[:3]) < DARK
        look: dict[str, Any] = {"color": "white" if dark else "black", "fontsize": 7}
        look["weight"] = "bold" if row.p_adjusted < significance else "normal"
        place = row.other, row.condition
        axes.annotate(f"{row.a12:.2f}", place, ha="center", va="center", **look)
    axes.set_xticks(range(count), [str(k + 1) for k in range(count)])
    axes.set_yticks(range(count), names)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.set_xlabel(f"bold: adjusted p < {significance:g}")
    # the figure as wide as its names need, and its colour bar beside it
    longest = max(name.get_window_extent().width for name in axes.get_yticklabels()) / figure.dpi
    width = max(NARROWEST, SIZE * count + longest + BESIDE)
    figure.set_figwidth(width)
    bar: dict[str, Any] = {"fraction": BAR / width, "aspect": SIZE * count / BAR}
    figure.colorbar(image, ax=axes, label="A12: the row is better", ticks=[0.0, 0.5, 1.0], **bar)
    return figure
