"""Arms in the plane, as all figures draw them."""

from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from evoexp.report import style


def draw_arm(
    axes: Axes, arm: int, rows: pd.DataFrame, *, alpha: float = 1.0, dashed: bool = False
) -> None:
    """Draw an arm's links, given by rows with x, y, x_end, y_end in order."""
    x, y = ([*rows[name], rows[f"{name}_end"].iloc[-1]] for name in "xy")
    colour = style.arm_colour(arm)
    line: dict[str, Any] = (
        {"linestyle": (0, (2, 1)), "linewidth": 2} if dashed else {"linewidth": 3}
    )
    axes.plot(x, y, color=colour, alpha=alpha, zorder=3 + dashed, **line)
    joints: dict[str, Any] = {"color": "white", "markeredgecolor": colour, "ms": 5}
    axes.plot(x[:-1], y[:-1], "o", alpha=alpha, zorder=4, **joints)
    axes.plot(x[-1], y[-1], "o", color=colour, alpha=alpha, markersize=4, zorder=4)
