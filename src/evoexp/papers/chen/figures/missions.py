"""A mobile manipulator's whole motion.

The platform's way from above, the docking posture from the side.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from evoexp.records import FloatArray
from evoexp.report import style
from evoexp.report.rows import groups

PATH, OBSTACLE, TRAVEL, DOCKED, TARGET, BODY = (
    "path",
    "obstacle",
    "travel posture",
    "docking posture",
    "target",
    "body",
)


class Shown(NamedTuple):
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


def missions_table(shown: list[Shown]) -> pd.DataFrame:
    """Return everything that is drawn.

    Returns:
        Columns row, unit, kind, number, a, b: x and y of the floor; of postures, the body and the
        target place along the floor and height; of the force (kind "force") its components.
    """
    rows: list[tuple[object, ...]] = []
    for one in shown:
        head = (one.title, one.unit)
        for number, (x0, y0, x1, y1) in enumerate(one.boxes):
            rows += [(*head, OBSTACLE, number, x0, y0), (*head, OBSTACLE, number, x1, y1)]
        rows += [(*head, PATH, 0, x, y) for x, y in one.path.tolist()]
        for name, joints in one.postures.items():
            rows += [(*head, name, 0, a, b) for a, b in joints.tolist()]
        rows += [
            (*head, BODY, 0, *one.body),
            (*head, TARGET, 0, *one.target.tolist()),
            (*head, "force", 0, *one.force),
        ]
    return pd.DataFrame(rows, columns=["row", "unit", "kind", "number", "a", "b"])


def draw_missions(table: pd.DataFrame) -> Figure:
    """Draw one row per motion: from above, and from the side, which the axes say.

    Titles have little room.
    """
    names = list(dict.fromkeys(table["row"]))
    figure = style.figure(3.1 * len(names) + 0.3)
    panels = figure.subplots(len(names), 2, squeeze=False)
    for (above, side), (name, rows) in zip(panels, groups(table, "row"), strict=True):
        _draw_above(above, rows)
        _draw_side(side, rows)
        label, _, told = str(name).partition(", ")
        above.set_title(f"{label}: from above")
        side.set_title(told)
    handles, labels = panels[0][1].get_legend_handles_labels()
    own, words = panels[0][0].get_legend_handles_labels()
    figure.legend(own + handles, words + labels, loc="outside lower center", ncols=3)
    return figure


def _draw_above(axes: Axes, rows: pd.DataFrame) -> None:
    for _, corners in groups(rows[rows["kind"] == OBSTACLE], "number"):
        (x0, x1), (y0, y1) = corners["a"], corners["b"]
        axes.add_patch(
            Rectangle((x0, y0), x1 - x0, y1 - y0, facecolor="#bbbbbb", edgecolor=style.NEUTRAL)
        )
    path = rows[rows["kind"] == PATH]
    axes.plot(path["a"], path["b"], color=style.CONDITION_COLOURS[0], label="way of the platform")
    axes.plot(path["a"].iloc[0], path["b"].iloc[0], "o", color=style.NEUTRAL, markersize=4)
    axes.plot(
        path["a"].iloc[-1],
        path["b"].iloc[-1],
        "*",
        color=style.NEUTRAL,
        markersize=8,
        label="docking place",
    )
    style.operational_axes(axes, str(rows["unit"].iloc[0]))
    axes.margins(0.08)


def _draw_side(axes: Axes, rows: pd.DataFrame) -> None:
    (radius, height), unit = _pair(rows, BODY), str(rows["unit"].iloc[0])
    middle = float(rows.loc[rows["kind"] == DOCKED, "a"].iloc[0])
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
        joints = rows[rows["kind"] == name]
        axes.plot(
            joints["a"], joints["b"], pattern, marker="o", markersize=3.5, color=colour, label=name
        )
    x, z = _pair(rows, TARGET)
    fx, fz = _pair(rows, "force")
    axes.plot(
        x,
        z,
        "x",
        color=style.NEUTRAL,
        markersize=7,
        zorder=4,
        label="where the end-effector shall be",
    )
    size = np.hypot(fx, fz) or 1.0
    arrow = {"arrowstyle": "-|>", "color": style.FORBIDDEN}
    axes.annotate(
        "F",
        (x, z),
        (x - 0.6 * fx / size, z - 0.6 * fz / size),
        arrowprops=arrow,
        ha="center",
        fontsize=7.5,
    )
    axes.axhline(0.0, color=style.NEUTRAL, linewidth=1.0)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x [{unit}]")
    axes.set_ylabel(f"height z [{unit}]")
    axes.margins(0.1)


def _pair(rows: pd.DataFrame, kind: str) -> tuple[float, float]:
    first, second = rows.loc[rows["kind"] == kind, ["a", "b"]].iloc[0]
    return float(first), float(second)
