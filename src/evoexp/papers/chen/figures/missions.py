"""A mobile manipulator's whole motion: the way from above, the docking posture from the side."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from evoexp.papers.chen.figures.grid_paths import OBSTACLE, draw_obstacle
from evoexp.records import FloatArray
from evoexp.report.kit import groups, style

PATH, TRAVEL, DOCKED, TARGET, BODY, FORCE = (
    "path",
    "travel posture",
    "docking posture",
    "target",
    "body",
    "force",
)


class Mission(NamedTuple):
    """A motion to draw.

    Attributes:
        title: Of its row: label, run and verdict with commas between.
        unit: Of lengths.
        boxes: Obstacles (x0, y0, x1, y1).
        path: (places, 2) of the platform, the docking place last.
        postures: Name → joints of the arm from its first one to the end-effector, (4, 2): along the
            floor, and height.
        body: Radius and height of the platform.
        target: (2,) of the end-effector: along the floor, and height.
        force: (2,) that acts on it.
    """

    title: str
    unit: str
    boxes: list[tuple[int, ...]]
    path: FloatArray
    postures: dict[str, FloatArray]
    body: tuple[float, float]
    target: FloatArray
    force: tuple[float, float]


def missions_table(shown: list[Mission]) -> pd.DataFrame:
    """Return everything that is drawn.

    Returns:
        Columns row, unit, kind, number, a, b: x and y of the floor; of postures, the body and the
        target place along the floor and height; of the force its components.
    """
    rows: list[tuple[object, ...]] = []
    for one in shown:
        kinds = [
            *((OBSTACLE, k, [box[:2], box[2:]]) for k, box in enumerate(one.boxes)),
            (PATH, 0, one.path.tolist()),
            *((name, 0, joints.tolist()) for name, joints in one.postures.items()),
            (BODY, 0, [one.body]),
            (TARGET, 0, [one.target.tolist()]),
            (FORCE, 0, [one.force]),
        ]
        rows += [(one.title, one.unit, *kind, a, b) for *kind, points in kinds for a, b in points]
    return pd.DataFrame(rows, columns=["row", "unit", "kind", "number", "a", "b"])


def draw_missions(table: pd.DataFrame) -> Figure:
    """Draw one row per motion: from above, and from the side."""
    count = table["row"].nunique()
    figure = style.figure(3.1 * count + 0.3)
    panels = figure.subplots(count, 2, squeeze=False)
    for (above, side), (name, rows) in zip(panels, groups(table, "row"), strict=True):
        _draw_above(above, rows)
        _draw_side(side, rows)
        label, _, told = str(name).partition(", ")
        above.set_title(f"{label}: from above")
        side.set_title(told)
    style.legend_of_all(figure, panels[0], 3)
    return figure


def _draw_above(axes: Axes, rows: pd.DataFrame) -> None:
    """Draw obstacles and the platform's way."""
    for _, corners in groups(rows[rows["kind"] == OBSTACLE], "number"):
        draw_obstacle(axes, corners["a"], corners["b"])
    path = rows.loc[rows["kind"] == PATH, ["a", "b"]].to_numpy()
    look: dict[str, Any] = {"color": style.NEUTRAL}
    axes.plot(*path.T, color=style.CONDITION_COLOURS[0], label="way of the platform")
    axes.plot(*path[0], "o", markersize=4, **look)
    axes.plot(*path[-1], "*", markersize=8, label="docking place", **look)
    style.operational_axes(axes, str(rows["unit"].iloc[0]))
    axes.margins(0.08)


def _draw_side(axes: Axes, rows: pd.DataFrame) -> None:
    """Draw the platform, both postures of the arm, the target and the force."""
    (radius, height), unit = _pair(rows, BODY), str(rows["unit"].iloc[0])
    middle, _ = _pair(rows, DOCKED)
    axes.add_patch(
        Rectangle(
            (middle - radius, 0.0),
            2.0 * radius,
            height,
            facecolor="#dddddd",
            edgecolor=style.NEUTRAL,
        )
    )
    for name, colour, pattern in ((TRAVEL, style.FAINT, "--"), (DOCKED, style.ARM_COLOURS[1], "-")):
        arm: dict[str, Any] = {"marker": "o", "markersize": 3.5, "color": colour, "label": name}
        joints = rows[rows["kind"] == name]
        axes.plot(joints["a"], joints["b"], pattern, **arm)
    (x, z), (fx, fz) = _pair(rows, TARGET), _pair(rows, FORCE)
    axes.plot(
        x,
        z,
        "x",
        label="where the end-effector shall be",
        color=style.NEUTRAL,
        markersize=7,
        zorder=4,
    )
    size = np.hypot(fx, fz) or 1.0
    arrow = {"arrowstyle": "-|>", "color": style.FORBIDDEN}
    tail = x - 0.6 * fx / size, z - 0.6 * fz / size
    axes.annotate("F", (x, z), tail, arrowprops=arrow, ha="center", fontsize=7.5)
    axes.axhline(0.0, color=style.NEUTRAL, linewidth=1.0)
    axes.set(
        adjustable="datalim",
        aspect="equal",
        xlabel=f"x [{unit}]",
        ylabel=f"height z [{unit}]",
    )
    axes.margins(0.1)


def _pair(rows: pd.DataFrame, kind: str) -> tuple[float, float]:
    """Return a and b of the first row of a kind."""
    first, second = rows.loc[rows["kind"] == kind, ["a", "b"]].iloc[0]
    return float(first), float(second)
