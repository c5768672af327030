"""The test of two links for an intersection (Curkovic et al. 2013, Fig. 7, Eqs. 11 and 12)."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Arc

from evoexp.collision.planar.planar_arms import closed_form
from evoexp.numeric.elementary import DEGREE
from evoexp.papers.curkovic import link_motions
from evoexp.planners.coevolution.planner import Problem
from evoexp.report.figures import marks, records, rounded, style
from evoexp.report.results.stored_results import ConditionResults

SAMPLES = 200  # configurations per segment of the straight line among which one is chosen
TOP_LINKS = 3  # of the four pairs of links that `closed_form` tells apart
VECTORS = ("a", "b", "c", "d")  # of the paper: links of robot 1, then of robot 2


def intersection_table(condition: ConditionResults) -> pd.DataFrame:
    """Return links and intersection of two robots that go straight, where their top links cross."""
    problem = condition.problem(Problem)
    one, two = link_motions.arms(condition.prepared)
    steps = np.linspace(0.0, 1.0, SAMPLES + 1)[:, None, None]
    links = (1.0 - steps) * problem.start + steps * problem.goal  # (samples, robots, 2)
    found = closed_form(one, links[:, 0].T, two, links[:, 1].T)
    mu, nu = found.mu[TOP_LINKS], found.nu[TOP_LINKS]
    off = np.nan_to_num(np.maximum(np.abs(mu - 0.5), np.abs(nu - 0.5)), nan=np.inf)
    k = int(np.argmin(off))
    rows: list[tuple[Any, ...]] = []
    for robot, arm in enumerate((one, two)):
        elbow_x, elbow_y, tip_x, tip_y = arm.outlines(links[k, robot].reshape(1, 2, 1))[0, :4, 0]
        angles = links[k, robot] / DEGREE
        rows += [
            (VECTORS[2 * robot], *arm.base, elbow_x, elbow_y, angles[0]),
            (VECTORS[2 * robot + 1], elbow_x, elbow_y, tip_x, tip_y, angles[1]),
        ]
    _, x, y, x_end, y_end, _ = rows[1]
    at = (x + mu[k] * (x_end - x), y + mu[k] * (y_end - y))
    rows += [("base", *one.base, *two.base, np.nan), ("point", *at, *at, np.nan)]
    table = rounded(
        pd.DataFrame(rows, columns=["element", "x", "y", "x_end", "y_end", "angle_deg"])
    )
    return table.assign(
        mu=round(float(mu[k]), 9),
        nu=round(float(nu[k]), 9),
        share=float(steps[k, 0, 0]),
        crossing=bool(found.crossing[TOP_LINKS, k]),
        length_unit=condition.length_unit,
    )


def draw_intersection(table: pd.DataFrame) -> Figure:
    """Draw the links as the paper's vectors, their angles, the bases' distance, the crossing."""
    figure = style.figure(4.3, 5.4)
    axes = figure.subplots()
    style.operational_axes(axes, table["length_unit"].iloc[0])
    rows = {row.element: row for row in records(table)}
    links = [rows[name] for name in VECTORS]
    size = max(float(np.hypot(row.x_end - row.x, row.y_end - row.y)) for row in links)
    arrow: dict[str, Any] = {"shrinkA": 0, "shrinkB": 0}
    for k, row in enumerate(links):
        colour = style.arm_colour(k // 2)
        look: dict[str, Any] = {"arrowstyle": "-|>", "color": colour, "linewidth": 2.2}
        axes.annotate("", (row.x_end, row.y_end), (row.x, row.y), arrowprops=look | arrow)
        # a line for the limits of the axes
        axes.plot([row.x, row.x_end], [row.y, row.y_end], color=colour, linewidth=0.1)
        away = np.array([-(row.y_end - row.y), row.x_end - row.x]) / size * 10.0
        name: dict[str, Any] = {"va": "center", "color": colour, "weight": "bold"}
        marks.write(axes, row.element, _middle(row), tuple(away), **name)
        # the angle from +x
        radius, half = 0.2 * size, np.radians(0.5 * row.angle_deg)
        faint: dict[str, Any] = {"color": style.FAINT, "linewidth": 0.9, "zorder": 1}
        axes.plot([row.x, row.x + 1.5 * radius], [row.y, row.y], ":", **faint)
        arc: dict[str, Any] = {"theta1": 0.0, "theta2": row.angle_deg, "color": colour, "lw": 0.9}
        axes.add_patch(Arc((row.x, row.y), 2 * radius, 2 * radius, **arc))
        text = f"φ{str(k + 1).translate(style.SUBSCRIPTS)} = {row.angle_deg:.0f}°"
        place = row.x + 1.45 * radius * np.cos(half), row.y + 1.45 * radius * np.sin(half)
        axes.annotate(text, place, ha="left", va="center", color=colour, fontsize=7)
    # the distance of the bases, the first joints, and the crossing
    base, point = rows["base"], rows["point"]
    both = {"arrowstyle": "<->"} | arrow
    axes.annotate("", (base.x_end, base.y_end), (base.x, base.y), arrowprops=both)
    marks.write(axes, "d·i", _middle(base), (0, -12))
    for k, text, side in ((1, "O₁", -11), (3, "O₂", 11)):
        joint = links[k].x, links[k].y
        marks.hollow(axes, *joint, "o", style.arm_colour(k // 2), 6, zorder=4)
        marks.write(axes, text, joint, (side, 4))
    marks.contact(axes, point.x, point.y, 9, zorder=6)
    marks.write(axes, "P", (point.x, point.y), (0, 9), color=style.FORBIDDEN, weight="bold")
    word = "the links cross" if base.crossing else "the links do not cross"
    axes.set_title(f"μ = {base.mu:.3f}, ν = {base.nu:.3f}: {word}")
    axes.margins(0.12)
    figure.supxlabel("O₁P = μ b,  O₂P = ν d;  they cross where both lie in [0, 1]", fontsize=8)
    return figure


def _middle(row: Any) -> tuple[float, float]:
    return 0.5 * (row.x + row.x_end), 0.5 * (row.y + row.y_end)
