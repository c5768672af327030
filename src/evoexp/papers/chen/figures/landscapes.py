"""The landscape of E over θ1 and θ2, and where searches end (Chen & Zalzala 1995, Fig. 9)."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from evoexp.papers.chen.cases import Case
from evoexp.records import FloatArray
from evoexp.report.kit import groups, rounded, style

GRID, RUN, PAPER, OPTIMUM, MINIMUM = "grid", "GA, runs", "paper", "optimum", "other local minima"
LOOKS: dict[str, dict[str, Any]] = {
    RUN: {"marker": ".", "color": "#ffffff", "mec": "#000000", "mew": 0.4, "ms": 5, "zorder": 5},
    MINIMUM: {"marker": "v", "color": "none", "mec": "#D55E00", "mew": 1.2, "ms": 7, "zorder": 6},
    OPTIMUM: {"marker": "*", "color": "#D55E00", "mec": "white", "mew": 0.5, "ms": 12, "zorder": 7},
    PAPER: {"marker": "+", "color": "#000000", "mew": 1.6, "ms": 10, "zorder": 8},
}
NAMES = ["panel", "case", "element", "theta_1_deg", "theta_2_deg", "cost"]
LABEL = "E [-], lower is better"
# range of a colour bar → its ticks, both in units of the least E
TICKS = {20.0: [1.0, 2.0, 5.0, 10.0, 20.0], 3.0: [1.0, 1.5, 2.0, 3.0]}


def landscape_table(cases: list[Case]) -> pd.DataFrame:
    """Return E over the angles, and the points that are marked.

    Returns:
        Columns panel, case, element, theta_1_deg, theta_2_deg, cost (NaN: infeasible).
    """
    parts = []
    for panel, case in enumerate(cases):
        assert case.landscape is not None
        one, two, cost = (case.landscape.array(name) for name in ("theta_1", "theta_2", "cost"))
        grid = np.stack(np.meshgrid(one, two, indexing="ij"), axis=-1).reshape(-1, 2)
        marked = {
            element: (angles, np.array([case.measured(pair)["cost"] for pair in angles]))
            for element, angles in _points(case).items()
            if len(angles)
        }
        for element, (angles, costs) in ({GRID: (grid, cost.ravel())} | marked).items():
            columns = panel, case.name, element, angles[:, 0], angles[:, 1], costs
            parts.append(pd.DataFrame(dict(zip(NAMES, columns, strict=True))))
    return rounded(pd.concat(parts, ignore_index=True))


def _points(case: Case) -> dict[str, FloatArray]:
    """Return the marked points θ1, θ2 [deg] by element, (points, 2) each."""
    points, minima = {}, case.minima
    if case.plain is not None:
        points[RUN] = np.array([case.plain.solutions[k] for k in sorted(case.plain.solutions)])
    if len(minima):
        best = minima[:, 2] <= minima[0, 2] * (1.0 + 1e-9)
        points |= {OPTIMUM: minima[best, :2], MINIMUM: minima[~best, :2]}
    if case.printed.angles is not None:
        points[PAPER] = np.array([case.printed.angles])
    return points


def draw_landscape(table: pd.DataFrame) -> Figure:
    """Draw E in colours, one column per criterion: the whole landscape, and around the best.

    White: no posture is feasible.
    """
    figure, count = style.figure(7.4), table["panel"].nunique()
    places = figure.subplots(2, count, squeeze=False)
    for (whole, close), (_, rows) in zip(places.T, groups(table, "panel"), strict=True):
        grid = rows[rows["element"] == GRID]
        wide = grid.pivot(index="theta_2_deg", columns="theta_1_deg", values="cost")
        for axes, widest in zip((whole, close), TICKS, strict=True):
            _draw_costs(figure, axes, wide, widest)
            _draw_points(axes, rows)
        whole.set(
            xlim=(wide.columns.min(), wide.columns.max()),
            ylim=(wide.index.min(), wide.index.max()),
            title=rows["case"].iloc[0],
        )
        for axis in (whole.xaxis, whole.yaxis):
            axis.set_major_locator(MultipleLocator(90.0))
        best = rows[rows["element"].isin([OPTIMUM, PAPER, RUN])]
        for axis, name in (("x", "theta_1_deg"), ("y", "theta_2_deg")) if len(best) else ():
            close.set(**{f"{axis}lim": (best[name].min() - 15.0, best[name].max() + 15.0)})
        close.set_title("around the best", fontweight="normal")
    style.legend_below(figure, places[0, 0], 4)
    return figure


def _draw_costs(figure: Figure, axes: Axes, wide: pd.DataFrame, widest: float) -> None:
    """Draw the costs in colours, up to a multiple of the least one, and their colour bar."""
    costs, least = wide.to_numpy(), float(np.nanmin(wide))
    look: dict[str, Any] = {"cmap": "viridis_r", "shading": "nearest", "rasterized": True}
    norm = LogNorm(vmin=least, vmax=least * widest)
    image = axes.pcolormesh(wide.columns, wide.index, costs, norm=norm, **look)
    bar = figure.colorbar(image, ax=axes, extend="max", shrink=0.8, label=LABEL)
    ticks = [least * tick for tick in TICKS[widest]]
    bar.set_ticks(ticks, labels=[f"{tick:.3g}" for tick in ticks])
    bar.minorticks_off()


def _draw_points(axes: Axes, rows: pd.DataFrame) -> None:
    """Draw the marked points of a criterion."""
    for element, look in LOOKS.items():
        x, y = rows.loc[rows["element"] == element, ["theta_1_deg", "theta_2_deg"]].to_numpy().T
        if len(x):
            axes.plot(x, y, linestyle="none", label=element, **look)
    axes.set(xlabel="θ₁ [deg]", ylabel="θ₂ [deg]", aspect="equal")
    axes.grid(False)
