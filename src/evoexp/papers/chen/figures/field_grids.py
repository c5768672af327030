"""Potential fields as grids of numbers (Chen & Zalzala 1995, Fig. 1)."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from evoexp.papers.chen.printed_grids import BLOCKED, MISSING, SURPLUS, WRONG
from evoexp.report import style
from evoexp.report.rows import groups

NAMES = {WRONG: "another number is printed (below, small)",
MISSING: "nothing is printed for the node",
         SURPLUS: "a token too many is printed here"}  # fmt: skip
COLOURS = {WRONG: "#CC3311", MISSING: "#EE7733", SURPLUS: "#0077BB"}


def draw_fields(table: pd.DataFrame) -> Figure:
    """Draw one grid per field, with the number of every node, and mark where the print differs.

    Args:
        table: See `printed_grids.compare`; several fields.
    """
    names = list(dict.fromkeys(table["field"]))
    figure = style.figure(7.2 * 0.5 * 1.12, style.WIDTH * (1.0 if len(names) > 1 else 0.55))
    panels = figure.subplots(1, len(names), squeeze=False)[0]
    for axes, (name, rows) in zip(panels, groups(table, "field"), strict=True):
        _draw_field(axes, str(name), rows)
    handles = [Rectangle((0, 0), 1, 1, fill=False, edgecolor=COLOURS[slip], label=text,
    linewidth=1.4)
               for slip, text in NAMES.items() if (table["slip"] == slip).any()]  # fmt: skip
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def draw_maps(table: pd.DataFrame) -> Figure:
    """Draw fields as shaded maps: columns field, x, y, value (NaN where no path can be)."""
    names = list(dict.fromkeys(table["field"]))
    figure = style.figure(3.4)
    panels = figure.subplots(1, len(names), squeeze=False)[0]
    for axes, (name, rows) in zip(panels, groups(table, "field"), strict=True):
        image = rows.pivot_table(index="y", columns="x", values="value", dropna=False).to_numpy(
            dtype=float
        )
        shown = axes.imshow(image, origin="lower", cmap="viridis", interpolation="nearest")
        axes.set_facecolor(style.NEUTRAL)
        bar = figure.colorbar(shown, ax=axes, label="potential [–]", shrink=0.75)
        for axis in (axes.xaxis, axes.yaxis, bar.ax.yaxis):
            axis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
        axes.grid(visible=False)
        axes.set_title(str(name))
        axes.set_xlabel("x [node]")
        axes.set_ylabel("y [node]")
    return figure


def _draw_field(axes: Axes, name: str, rows: pd.DataFrame) -> None:
    count = int(rows["row"].max()) + 1
    width = int(rows.loc[rows["slip"] != SURPLUS, "column"].max()) + 1
    numbers = pd.to_numeric(rows["computed"], errors="coerce")
    greatest = float(np.nanmax(numbers))
    for (row, column, text, given, slip), value in zip(
        rows[["row", "column", "computed", "printed", "slip"]].itertuples(index=False),
        numbers,
        strict=True,
    ):
        y = count - 1 - row
        if slip == SURPLUS:
            at = (column - 0.62, y - 0.46)
            axes.add_patch(
                Rectangle(
                    at, 0.24, 0.92, fill=False, edgecolor=COLOURS[slip], linewidth=1.4, zorder=3
                )
            )
            continue
        shade = style.NEUTRAL if text == BLOCKED else str(0.97 - 0.32 * float(value) / greatest)
        corner = (column - 0.5, y - 0.5)
        axes.add_patch(Rectangle(corner, 1, 1, facecolor=shade, edgecolor="white", linewidth=0.5))
        colour = "white" if text == BLOCKED else "black"
        lifted = y + (0.12 if slip == WRONG else 0.0)
        axes.text(
            column, lifted, text, ha="center", va="center_baseline", fontsize=6.0, color=colour
        )
        if slip:
            inset = (column - 0.46, y - 0.46)
            axes.add_patch(
                Rectangle(
                    inset, 0.92, 0.92, fill=False, edgecolor=COLOURS[slip], linewidth=1.4, zorder=3
                )
            )
        if slip == WRONG:
            axes.text(
                column, y - 0.27, given, ha="center", va="center", fontsize=4.2, color=COLOURS[slip]
            )
    axes.set_xlim(-0.5, width - 0.3)
    axes.set_ylim(-0.5, count - 0.5)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xticks(range(0, width, 5))
    axes.set_yticks(range(0, count, 5))
    axes.set_xlabel("x [node]")
    axes.set_ylabel("y [node]")
    axes.set_title(name)
