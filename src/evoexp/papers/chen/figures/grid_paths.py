"""Paths over a grid: the workspace with its obstacles, and what goes through it.

Chen & Zalzala 1995, Fig. 2.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from evoexp.records import FloatArray
from evoexp.report import style
from evoexp.report.rows import groups

OBSTACLE = "obstacle"
FAINT, MEDIAN, EXACT = "all runs", "run of median cost", "best path known (reference)"


class Line(NamedTuple):
    """A path to draw.

    Attributes:
        kind: What it is; lines of one kind share a place in the legend.
        path: (nodes, 2).
        share: Of the runs, in [0, 1]; its width.
        text: For the legend; empty: the kind.
    """

    kind: str
    path: FloatArray
    share: float = 1.0
    text: str = ""


class Panel(NamedTuple):
    """One workspace.

    Attributes:
        title: Above it.
        unit: Of lengths.
        boxes: (x0, y0, x1, y1) of nodes.
        lines: Drawn in this order.
    """

    title: str
    unit: str
    boxes: Sequence[Sequence[int]]
    lines: Sequence[Line]


def paths_table(panels: Sequence[Panel]) -> pd.DataFrame:
    """Return everything that is drawn.

    Returns:
        Columns panel, unit, kind, text, number (of the line), share, x, y; an obstacle has two
        rows, its corners.
    """
    rows: list[tuple[object, ...]] = []
    for panel in panels:
        head = (panel.title, panel.unit)
        for number, (x0, y0, x1, y1) in enumerate(panel.boxes):
            rows += [(*head, OBSTACLE, "", number, 1.0, x, y) for x, y in ((x0, y0), (x1, y1))]
        for number, line in enumerate(panel.lines):
            rows += [
                (*head, line.kind, line.text, number, line.share, x, y)
                for x, y in line.path.tolist()
            ]
    return pd.DataFrame(
        rows, columns=["panel", "unit", "kind", "text", "number", "share", "x", "y"]
    )


def draw_paths(table: pd.DataFrame) -> Figure:
    """Draw workspaces side by side: all runs faint, one run, the reference."""
    colours = {
        FAINT: "#88aacc",
        MEDIAN: style.CONDITION_COLOURS[0],
        EXACT: style.CONDITION_COLOURS[1],
    }
    styles: dict[str, dict[str, Any]] = {
        FAINT: {"linewidth": 0.5, "alpha": 0.45},
        MEDIAN: {"linewidth": 1.8},
        EXACT: {"linewidth": 1.4, "linestyle": "--"},
    }
    figure, panels = _panels(table, {1: 4.2, 2: 3.6, 3: 2.9}.get(table["panel"].nunique(), 2.4))
    for axes, (_, rows) in zip(panels, groups(table, "panel"), strict=True):
        for (kind, _), line in groups(rows[rows["kind"] != OBSTACLE], ["kind", "number"]):
            axes.plot(line["x"], line["y"], color=colours[str(kind)], **styles[str(kind)])
    kinds = [kind for kind in colours if (table["kind"] == kind).any()]
    handles = [Line2D([], [], color=colours[kind], label=kind, **styles[kind]) for kind in kinds]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def draw_routes(table: pd.DataFrame) -> Figure:
    """Draw one path per route, as wide as it is frequent, with a legend per workspace."""
    names = sorted(
        {str(kind) for kind in table["kind"] if kind != OBSTACLE},
        key=lambda name: (len(name), name),
    )
    figure, panels = _panels(table, 3.1)
    for axes, (_, rows) in zip(panels, groups(table, "panel"), strict=True):
        for (kind, _), line in groups(rows[rows["kind"] != OBSTACLE], ["kind", "number"]):
            colour = style.condition_colour(names.index(str(kind)))
            width = 0.8 + 3.2 * float(line["share"].iloc[0])
            axes.plot(
                line["x"], line["y"], color=colour, linewidth=width, label=line["text"].iloc[0]
            )
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.24), ncols=2, fontsize=6.5)
    return figure


def _panels(table: pd.DataFrame, height: float) -> tuple[Figure, np.ndarray]:
    """Return a figure with one workspace per panel, obstacles drawn."""
    names = list(dict.fromkeys(table["panel"]))
    figure = style.figure(height)
    panels = figure.subplots(1, len(names), squeeze=False, sharey=True)[0]
    for axes, (name, rows) in zip(panels, groups(table, "panel"), strict=True):
        for _, corners in groups(rows[rows["kind"] == OBSTACLE], "number"):
            (x0, x1), (y0, y1) = corners["x"], corners["y"]
            axes.add_patch(
                Rectangle((x0, y0), x1 - x0, y1 - y0, facecolor="#bbbbbb", edgecolor=style.NEUTRAL)
            )
        _ends(axes, rows[rows["kind"] != OBSTACLE])
        style.operational_axes(axes, str(rows["unit"].iloc[0]))
        axes.set_xlim(table["x"].min() - 1.0, table["x"].max() + 1.0)
        axes.set_ylim(table["y"].min() - 1.0, table["y"].max() + 1.0)
        axes.set_title(str(name))
        if axes is not panels[0]:
            axes.set_ylabel("")
    return figure, panels


def _ends(axes: Axes, rows: pd.DataFrame) -> None:
    first, last = rows.iloc[0], rows.iloc[-1]
    axes.plot(first["x"], first["y"], "o", color=style.NEUTRAL, markersize=4, zorder=4)
    axes.plot(last["x"], last["y"], "*", color=style.NEUTRAL, markersize=8, zorder=4)
