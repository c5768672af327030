"""Docking postures: fitness, gaps to the optimum, postures (Chen & Zalzala 1995, Figs. 3–8)."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from evoexp.papers.chen.cases import CLOSE, METHODS, Case
from evoexp.records import FloatArray
from evoexp.report.kit import groups, quantile, records, rounded, style

RUNS = ("GA", "GA, elitism", "random search")
ORDER = (*RUNS, *METHODS.values())  # which tells colours
LEAST_GAP = 1e-6  # [-] smaller gaps are drawn as this one
POSTURES = ("exact optimum", "best run", "paper's angles")
FITNESS = [
    *("panel", "case", "quantity", "method", "generation"),
    *("median", "lower", "upper", "average", "runs", "optimum"),
]
LINKS = ["panel", "case", "element", "posture", "x", "y", "x_end", "y_end", "size"]


def _colour(method: str) -> str:
    return style.condition_colour(ORDER.index(method)) if method in ORDER else style.NEUTRAL


# ------------------------------------------------------------------------------------------ fitness


def fitness_table(cases: list[Case]) -> pd.DataFrame:
    """Return median and quartiles over runs of the best fitness f = E_m − E so far.

    Of the least torque norm it is the torque norm itself, which the paper draws.

    Returns:
        Columns panel, case, quantity, method, generation, median, lower, upper, average (of a
        generation, median over runs), runs, optimum.
    """
    rows = []
    for panel, case in enumerate(cases):
        greatest = float(case.conditions[0].planner.objective.greatest)
        torque = case.name == "least torque norm"
        quantity = "torque norm E₁" if torque else "fitness f"
        for method, condition in case.evolved.items():
            for index, own in groups(condition.generations, "index"):
                best, mean = own["best_cost"].to_numpy(), own["mean_cost"].to_numpy()
                if not torque:
                    best, mean = greatest - best, greatest - mean
                spread = (quantile(best, share) for share in (0.5, 0.25, 0.75))
                optimum = case.least if torque else greatest - case.least
                told = (*spread, quantile(mean, 0.5), len(best), optimum)
                rows.append((panel, case.name, quantity, method, index, *told))
    return rounded(pd.DataFrame(rows, columns=FITNESS))


def draw_fitness(table: pd.DataFrame) -> Figure:
    """Draw one panel per criterion: the best so far against generations, the optimum as a line."""
    figure, places = _panels(table, 2.5)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=False):
        optimum, quantity = rows[["optimum", "quantity"]].iloc[0]
        for method, own in groups(rows, "method"):
            x, colour = own["generation"], _colour(method)
            label = f"{method} (n = {int(own['runs'].max())})"
            axes.fill_between(x, own["lower"], own["upper"], color=colour, alpha=0.18, linewidth=0)
            axes.plot(x, own["median"], color=colour, label=label)
        line: dict[str, Any] = {"linestyle": (0, (5, 1.5, 1, 1.5)), "linewidth": 1.0}
        axes.axhline(optimum, color=style.NEUTRAL, label="optimum", **line)
        # the first generations may be far off: later ones tell the range
        late = rows[rows["generation"] >= min(3, int(rows["generation"].max()))]
        far = max(float((late[["lower", "upper"]] - optimum).abs().to_numpy().max()), 1e-9)
        lower_is_better = quantity.startswith("t")
        below, above = (0.08, 1.0) if lower_is_better else (1.0, 0.08)
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
        for method, values in costs.items():
            given = {"panel": panel, "case": case.name, "method": method}
            gaps = np.maximum(case.gaps(values), 0.0)
            parts.append(pd.DataFrame(given | {"at": ORDER.index(method), "gap": gaps}))
    return rounded(pd.concat(parts, ignore_index=True))


def draw_gaps(table: pd.DataFrame) -> Figure:
    """Draw shares of runs, or starts, whose gap is smaller than x, one panel per criterion."""
    figure, places = _panels(table, 2.5)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=False):
        for (_, method), own in groups(rows, ["at", "method"]):
            x = np.sort(np.maximum(np.nan_to_num(own["gap"].to_numpy(), posinf=np.inf), LEAST_GAP))
            share = np.arange(1, len(x) + 1) / len(x)
            finite = np.isfinite(x)
            heights = np.append(share[finite], finite.mean())
            axes.step(
                np.append(x[finite], 1e2),
                heights,
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
        shown = zip(POSTURES, (case.optimal_angles, best, case.printed_angles), strict=True)
        for posture, angles in shown:
            found = {} if angles is None else case.measured(angles)
            if found.get("branch", -1.0) >= 0.0:
                own += _links(case, posture, found)
        rows += [(panel, case.name, *row) for row in own]
    return rounded(pd.DataFrame(rows, columns=LINKS))


def _links(case: Case, posture: str, found: dict[str, float]) -> list[tuple[Any, ...]]:
    """Return the platform and the links of a posture, of which the terms are given."""
    robot: Any = case.conditions[0].condition.robot
    length, height = 0.5 * np.array(robot.platform_size)
    angles = np.cumsum([np.radians(found[f"theta_{k}_deg"]) for k in (1, 2, 3)])
    steps = np.array(robot.link_lengths)[:, None] * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )
    joints = np.cumsum([(found["platform_x"], 0.0), *steps], axis=0)
    x, y = joints[0]
    return [
        ("platform", posture, x - length, y - height, x + length, y + height, 0.0),
        *(("link", posture, *joints[k], *joints[k + 1], k + 1.0) for k in range(len(steps))),
    ]


def draw_postures(table: pd.DataFrame) -> Figure:
    """Draw one panel per criterion: three postures, the force, the obstacle."""
    figure, places = _panels(table, 2.6)
    looks = (style.NEUTRAL, 3.4), (style.ARM_COLOURS[0], 1.7), (style.ARM_COLOURS[1], 1.1)
    blue = style.ARM_COLOURS[2]
    arrow = {"arrowstyle": "-|>", "color": blue, "linewidth": 1.4}
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=False):
        style.operational_axes(axes, "unit")
        axes.axhline(0.0, color=style.FAINT, linewidth=0.8)
        for posture, (colour, width) in zip(POSTURES, looks, strict=True):
            own = rows[rows["posture"] == posture]
            if len(own):
                _draw_posture(axes, own, posture, colour, width)
        for row in records(rows[rows["element"] == "obstacle"]):
            axes.plot(
                row.x,
                row.y,
                "X",
                label="obstacle",
                color=style.FORBIDDEN,
                ms=7,
                mec="white",
                zorder=8,
            )
        for row in records(rows[rows["element"] == "force"]):
            axes.annotate("", (row.x_end, row.y_end), (row.x, row.y), arrowprops=arrow, zorder=7)
            axes.plot([], [], color=blue, label="force F")
        axes.set(xlim=_around(table, "x"), ylim=_around(table, "y"), title=rows["case"].iloc[0])
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
        box = FancyBboxPatch(
            (row.x, row.y),
            row.x_end - row.x,
            height,
            boxstyle=ends,
            zorder=4,
            fill=False,
            edgecolor=colour,
            linewidth=0.6 * width,
        )
        axes.add_patch(box)


def _around(table: pd.DataFrame, name: str) -> tuple[float, float]:
    """Return the range of a coordinate over all panels, with a margin."""
    values: FloatArray = table[[name, f"{name}_end"]].to_numpy()
    margin = 0.07 * float(np.ptp(values)) + 0.05
    return float(values.min()) - margin, float(values.max()) + margin


def _panels(table: pd.DataFrame, height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with a panel for each of the table, three in a row at most."""
    count = table["panel"].nunique()
    columns = min(count, 3)
    rows = -(-count // columns)
    figure = style.figure(height * rows + 0.6)
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in places[count:]:
        axes.set_axis_off()
    return figure, list(places[:count])
