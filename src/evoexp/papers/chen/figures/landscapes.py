"""The landscape of a posture's fitness over θ1 and θ2, and where searches end on it.

Chen & Zalzala 1995, Fig. 9.
"""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from evoexp.papers.chen.cases import Case
from evoexp.report import style
from evoexp.report.rows import groups, rounded

GRID, RUN, PAPER, OPTIMUM, MINIMUM = "grid", "GA, runs", "paper", "optimum", "other local minima"
LOOKS: dict[str, dict[str, Any]] = {
    RUN: {"marker": ".", "color": "#ffffff", "mec": "#000000", "mew": 0.4, "ms": 5, "zorder": 5},
    MINIMUM: {"marker": "v", "color": "none", "mec": "#D55E00", "mew": 1.2, "ms": 7, "zorder": 6},
    OPTIMUM: {
        "marker": "*",
        "color": "#D55E00",
        "mec": "#ffffff",
        "mew": 0.5,
        "ms": 12,
        "zorder": 7,
    },
    PAPER: {"marker": "+", "color": "#000000", "mew": 1.6, "ms": 10, "zorder": 8},
}


def landscape_table(cases: list[Case]) -> pd.DataFrame:
    """Return E over the angles, and the points that are marked.

    Returns:
        Columns panel, case, element, theta_1_deg, theta_2_deg, cost (NaN: infeasible).
    """
    parts = []
    for panel, case in enumerate(cases):
        if case.landscape is None:
            continue
        one, two, cost = (case.landscape.array(name) for name in ("theta_1", "theta_2", "cost"))
        x, y = np.meshgrid(one, two, indexing="ij")
        rows = [
            pd.DataFrame({"theta_1_deg": x.ravel(), "theta_2_deg": y.ravel(), "cost": cost.ravel()})
        ]
        rows[0]["element"] = GRID
        for element, angles in _points(case).items():
            costs = [case.measured(pair)["cost"] for pair in angles]
            told = {
                "theta_1_deg": angles[:, 0],
                "theta_2_deg": angles[:, 1],
                "cost": costs,
                "element": element,
            }
            rows.append(pd.DataFrame(told))
        parts.append(pd.concat(rows, ignore_index=True).assign(panel=panel, case=case.name))
    names = ["panel", "case", "element", "theta_1_deg", "theta_2_deg", "cost"]
    return rounded(pd.concat(parts, ignore_index=True)[names])


def _points(case: Case) -> dict[str, Any]:
    points: dict[str, Any] = {}
    if case.plain is not None:
        points[RUN] = np.array([case.plain.solutions[k] for k in sorted(case.plain.solutions)])
    if case.optimum is not None:
        minima = case.optimum.array("minima")
        best = minima[:, 2] <= minima[0, 2] * (1.0 + 1e-9)
        points[OPTIMUM] = minima[best, :2]
        if not best.all():
            points[MINIMUM] = minima[~best, :2]
    if case.printed is not None and case.printed.angles is not None:
        points[PAPER] = np.array([case.printed.angles])
    return points


def draw_landscape(table: pd.DataFrame) -> Figure:
    """Draw E in colours, one column per criterion, white where no posture is feasible.

    Below: around the best.
    """
    panels = [rows for _, rows in groups(table, "panel")]
    figure = style.figure(7.4)
    places = figure.subplots(2, len(panels), squeeze=False)
    for column, rows in enumerate(panels):
        grid = rows[rows["element"] == GRID].pivot(
            index="theta_2_deg", columns="theta_1_deg", values="cost"
        )
        costs = grid.to_numpy()
        least, x, y = float(np.nanmin(costs)), grid.columns.to_numpy(), grid.index.to_numpy()
        for axes, widest in zip(places[:, column], (20.0, 3.0), strict=True):
            norm = LogNorm(vmin=least, vmax=least * widest)
            image = axes.pcolormesh(
                x, y, costs, norm=norm, cmap="viridis_r", shading="nearest", rasterized=True
            )
            ticks = least * np.array(
                [1.0, 1.5, 2.0, 3.0] if widest < 10.0 else [1.0, 2.0, 5.0, 10.0, 20.0]
            )
            bar = figure.colorbar(image, ax=axes, extend="max", shrink=0.8)
            bar.set_ticks(ticks.tolist(), labels=[f"{tick:.3g}" for tick in ticks])
            bar.minorticks_off()
            bar.set_label("E [-], lower is better")
            for element, look in LOOKS.items():
                own = rows[rows["element"] == element]
                if len(own):
                    axes.plot(
                        own["theta_1_deg"],
                        own["theta_2_deg"],
                        linestyle="none",
                        label=element,
                        **look,
                    )
            axes.set_xlabel("θ₁ [deg]")
            axes.set_ylabel("θ₂ [deg]")
            axes.set_aspect("equal")
            axes.grid(False)
        places[0, column].set(
            xlim=(x.min(), x.max()), ylim=(y.min(), y.max()), title=rows["case"].iloc[0]
        )
        places[0, column].xaxis.set_major_locator(MultipleLocator(90.0))
        places[0, column].yaxis.set_major_locator(MultipleLocator(90.0))
        best = rows[rows["element"].isin([OPTIMUM, PAPER, RUN])]
        for axis, name in (("x", "theta_1_deg"), ("y", "theta_2_deg")):
            if len(best):
                low, high = float(best[name].min()) - 15.0, float(best[name].max()) + 15.0
                places[1, column].set(**{f"{axis}lim": (low, high)})
        places[1, column].set_title("around the best", fontweight="normal")
    style.legend_below(figure, places[0, 0], 4)
    return figure
