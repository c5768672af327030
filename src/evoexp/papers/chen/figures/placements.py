"""Docking postures: fitness, gaps to the optimum, postures (Chen & Zalzala 1995, Figs. 3–8)."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from evoexp.papers.chen.cases import CLOSE, METHODS, Case
from evoexp.report.kit import groups, quantile, records, rounded, spread, style

RUNS = ("GA", "GA, elitism", "random search")
ORDER = (*RUNS, *METHODS)  # the place of a method gives its colour
OPTIMUM: dict[str, Any] = {
    "color": style.NEUTRAL,
    "linestyle": (0, (5, 1.5, 1, 1.5)),
    "linewidth": 1.0,
}
LEAST_GAP = 1e-6  # [-] smaller gaps are drawn as this one
POSTURES = ("exact optimum", "best run", "paper's angles")
# colour and width of each posture
LOOKS = (style.NEUTRAL, 3.4), (style.ARM_COLOURS[0], 1.7), (style.ARM_COLOURS[1], 1.1)
ARROW: dict[str, Any] = {"arrowstyle": "-|>", "color": style.ARM_COLOURS[2], "linewidth": 1.4}
OBSTACLE: dict[str, Any] = {"color": style.FORBIDDEN, "ms": 7, "mec": "white", "zorder": 8}


def _colour(method: str) -> str:
    return style.condition_colour(ORDER.index(method)) if method in ORDER else style.NEUTRAL


# ------------------------------------------------------------------------------------------ fitness


def fitness_table(cases: list[Case]) -> pd.DataFrame:
    """Return median and quartiles over runs of the best fitness f = E_m − E so far.

    For the criterion of the least torque norm it is that norm itself, as in the paper.

    Returns:
        Columns panel, case, quantity, method, generation, median, lower, upper, average (of a
        generation, median over runs), runs, optimum.
    """
    rows: list[tuple[object, ...]] = []
    for panel, case in enumerate(cases):
        given = panel, case.name, "fitness f"
        offset, sign = float(case.conditions[0].planner.objective.greatest), -1.0
        if case.name == "least torque norm":
            given, offset, sign = (panel, case.name, "torque norm E₁"), 0.0, 1.0
        for method, condition in case.evolved.items():
            for index, own in groups(condition.generations, "index"):
                best, mean = offset + sign * own[["best_cost", "mean_cost"]].to_numpy().T
                median, lower, upper, _ = spread(best)
                told = median, lower, upper, quantile(mean, 0.5), len(best)
                rows.append((*given, method, index, *told, offset + sign * case.least))
    return rounded(
        pd.DataFrame(
            rows,
            columns=[
                *("panel", "case", "quantity", "method", "generation"),
                *("median", "lower", "upper", "average", "runs", "optimum"),
            ],
        )
    )


def draw_fitness(table: pd.DataFrame) -> Figure:
    """Draw one panel per criterion: the best so far against generations, the optimum as a line."""
    figure, places = style.lines_of_panels(2.5, table["panel"].nunique(), 3, 0.6)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=True):
        optimum, quantity = rows[["optimum", "quantity"]].iloc[0]
        for method, own in groups(rows, "method"):
            x, colour = own["generation"], _colour(method)
            label = f"{method} (n = {int(own['runs'].max())})"
            axes.fill_between(x, own["lower"], own["upper"], color=colour, alpha=0.18, linewidth=0)
            axes.plot(x, own["median"], color=colour, label=label)
        axes.axhline(optimum, label="optimum", **OPTIMUM)
        # the first generations may be far off: later ones tell the range
        late = rows[rows["generation"] >= min(3, int(rows["generation"].max()))]
        far = max(float((late[["lower", "upper"]] - optimum).abs().to_numpy().max()), 1e-9)
        below, above = (0.08, 1.0) if quantity.startswith("t") else (1.0, 0.08)
        if np.isfinite([far, optimum]).all():
            axes.set_ylim(optimum - below * far, optimum + above * far)
        axes.set(
            xlim=(0, max(1, int(rows["generation"].max()))),
            xlabel="generation",
            ylabel=f"{quantity} [-]",
            title=rows["case"].iloc[0],
        )
    style.legend_below(figure, places[0], 4)
    return figure


# --------------------------------------------------------------------------------------------- gaps


def gaps_table(cases: list[Case]) -> pd.DataFrame:
    """Return the gap of every run, and of every start of a conventional method, to the optimum.

    Returns:
        Columns panel, case, method, at (place of the method in the legend), gap.
    """
    parts = []
    for panel, case in enumerate(cases):
        costs = {method: c.column("best_cost") for method, c in case.evolved.items()}
        costs |= {method: ends[:, 2] for method, ends in case.ends().items()}
        given = {"panel": panel, "case": case.name}
        parts += [
            pd.DataFrame(
                given
                | {"method": method, "at": ORDER.index(method)}
                | {"gap": np.maximum(case.gaps(values), 0.0)}
            )
            for method, values in costs.items()
        ]
    return rounded(pd.concat(parts, ignore_index=True))


def draw_gaps(table: pd.DataFrame) -> Figure:
    """Draw shares of runs, or starts, whose gap is smaller than x, one panel per criterion."""
    figure, places = style.lines_of_panels(2.5, table["panel"].nunique(), 3, 0.6)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=True):
        for (_, method), own in groups(rows, ["at", "method"]):
            x = np.sort(np.maximum(np.nan_to_num(own["gap"].to_numpy(), posinf=np.inf), LEAST_GAP))
            finite = np.isfinite(x)  # the gaps that are not come last
            heights = np.arange(1, len(x) + 1)[finite] / len(x)
            axes.step(
                np.append(x[finite], 1e2),
                np.append(heights, finite.mean()),
                where="post",
                color=_colour(method),
                linestyle="-" if method in RUNS else (0, (4, 1.5)),
                label=f"{method} (n = {len(x)})",
            )
        for close in CLOSE:
            axes.axvline(close, color=style.FAINT, linewidth=0.8, linestyle=":")
        axes.set(
            xscale="log",
            xlim=(LEAST_GAP, 10.0),
            ylim=(0.0, 1.02),
            xlabel="gap E / E* − 1 [-]",
            ylabel="share with a smaller gap",
            title=rows["case"].iloc[0],
        )
    style.legend_of_all(figure, places, 3)
    return figure


# ----------------------------------------------------------------------------------------- postures


def postures_table(cases: list[Case]) -> pd.DataFrame:
    """Return obstacles, the force, and three postures: exact optimum, best run, paper's angles.

    Returns:
        Columns panel, case, element (platform, link, obstacle, force), posture, x, y, x_end, y_end,
        size (of an obstacle its radius, of a link its number).
    """
    rows: list[tuple[Any, ...]] = []
    for panel, case in enumerate(cases):
        scenario: Any = case.conditions[0].condition.scenario
        own: list[tuple[Any, ...]] = [
            ("obstacle", "", *place, *place, float(getattr(obstacle, "radius", 0.0)))
            for obstacle, place in zip(
                scenario.obstacles, map(tuple, scenario.obstacle_points()), strict=True
            )
        ]
        force = np.array(scenario.force) / max(float(np.hypot(*scenario.force)), 1e-12)
        end = np.array(scenario.target) + 0.6 * force
        own.append(("force", "", *scenario.target, *end, 0.0))
        run = case.elitist or case.plain
        best = run.solutions[run.best_replicate] if run is not None else None
        shown = case.optimal_angles, best, case.printed.angles
        for posture, angles in zip(POSTURES, shown, strict=True):
            found = {} if angles is None else case.measured(angles)
            if found.get("branch", -1.0) >= 0.0:
                own += _links(case, posture, found)
        rows += [(panel, case.name, *row) for row in own]
    return rounded(
        pd.DataFrame(
            rows,
            columns=["panel", "case", "element", "posture", "x", "y", "x_end", "y_end", "size"],
        )
    )


def _links(case: Case, posture: str, found: dict[str, float]) -> list[tuple[Any, ...]]:
    """Return the platform and the links of a posture, of which the terms are given."""
    robot: Any = case.conditions[0].condition.robot
    length, height = 0.5 * np.array(robot.platform_size)
    angles = np.cumsum([np.radians(found[f"theta_{k}_deg"]) for k in (1, 2, 3)])
    steps = np.array([np.cos(angles), np.sin(angles)]) * np.array(robot.link_lengths)
    joints = np.cumsum([(found["platform_x"], 0.0), *steps.T], axis=0)
    x, y = joints[0]
    return [
        ("platform", posture, x - length, y - height, x + length, y + height, 0.0),
        *(("link", posture, *joints[k], *joints[k + 1], k + 1.0) for k in range(len(joints) - 1)),
    ]


def draw_postures(table: pd.DataFrame) -> Figure:
    """Draw one panel per criterion: three postures, the force, the obstacle."""
    limits: dict[str, Any] = {}  # over all panels, with a margin
    for axis in "xy":
        values = table[[axis, f"{axis}_end"]].to_numpy()
        margin = 0.07 * float(np.ptp(values)) + 0.05
        limits[f"{axis}lim"] = values.min() - margin, values.max() + margin
    figure, places = style.lines_of_panels(2.6, table["panel"].nunique(), 3, 0.6)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=True):
        style.operational_axes(axes, "unit")
        axes.axhline(0.0, color=style.FAINT, linewidth=0.8)
        for posture, look in zip(POSTURES, LOOKS, strict=True):
            own = rows[rows["posture"] == posture]
            if len(own):
                _draw_posture(axes, own, posture, *look)
        obstacles = rows[rows["element"] == "obstacle"]
        if len(obstacles):
            axes.plot(obstacles["x"], obstacles["y"], "X", label="obstacle", **OBSTACLE)
        for row in records(rows[rows["element"] == "force"]):
            axes.annotate("", (row.x_end, row.y_end), (row.x, row.y), arrowprops=ARROW, zorder=7)
            axes.plot([], [], color=ARROW["color"], label="force F")
        axes.set(title=rows["case"].iloc[0], **limits)
        axes.xaxis.set_major_locator(style.few_ticks())
    style.legend_of_all(figure, places, 5)
    return figure


def _draw_posture(axes: Axes, rows: pd.DataFrame, label: str, colour: str, width: float) -> None:
    """Draw the links and the platform of a posture."""
    links = rows[rows["element"] == "link"]
    x, y = ([*links[name], links[f"{name}_end"].iloc[-1]] for name in "xy")
    axes.plot(x, y, "o-", color=colour, linewidth=width, ms=3.0, mfc="white", label=label, zorder=5)
    for row in records(rows[rows["element"] == "platform"]):
        height = row.y_end - row.y
        ends = f"round,pad=0,rounding_size={0.499 * height}"
        look: dict[str, Any] = {"fill": False, "edgecolor": colour, "linewidth": 0.6 * width}
        corner, length = (row.x, row.y), row.x_end - row.x
        axes.add_patch(FancyBboxPatch(corner, length, height, boxstyle=ends, zorder=4, **look))
