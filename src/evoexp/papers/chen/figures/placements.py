"""Docking postures: fitness, gaps to the optimum, postures (Chen & Zalzala 1995, Figs. 3–8)."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from evoexp.papers.chen.cases import Case
from evoexp.report import style
from evoexp.report.rows import groups, records, rounded
from evoexp.report.statistics import quantile

METHODS = (
    "GA",
    "GA, elitism",
    "random search",
    "Newton-type",
    "Newton-type, smooth form",
    "subgradient",
)
LEAST_GAP = 1e-6  # [-] what is drawn of a smaller one
POSTURES = ("exact optimum", "best run", "paper's angles")


def _colour(method: str) -> str:
    return style.condition_colour(METHODS.index(method)) if method in METHODS else style.NEUTRAL


# ------------------------------------------------------------------------------------------ fitness


def fitness_table(cases: list[Case]) -> pd.DataFrame:
    """Return median and quartiles of the best fitness f = E_m − E so far over runs.

    And the optimum's.

    Returns:
        Columns panel, case, quantity, method, generation, median, lower, upper, average (of a
        generation, median over runs), runs, optimum.
    """
    rows = []
    for panel, case in enumerate(cases):
        greatest = float(case.any.planner.objective.greatest)
        torque = case.name == "least torque norm"  # which the paper draws itself
        for method, condition in case.evolved.items():
            for index, own in groups(condition.generations, "index"):
                best, mean = own["best_cost"].to_numpy(), own["mean_cost"].to_numpy()
                values, average = (best, mean) if torque else (greatest - best, greatest - mean)
                spread = [quantile(values, share) for share in (0.5, 0.25, 0.75)]
                optimum = case.least if torque else greatest - case.least
                quantity = "torque norm E₁" if torque else "fitness f"
                told = (*spread, quantile(average, 0.5), len(values), optimum)
                rows.append((panel, case.name, quantity, method, index, *told))
    names = ["median", "lower", "upper", "average", "runs", "optimum"]
    return rounded(
        pd.DataFrame(rows, columns=["panel", "case", "quantity", "method", "generation", *names])
    )


def draw_fitness(table: pd.DataFrame) -> Figure:
    """Draw one panel per criterion: the best so far against generations, the optimum as a line."""
    figure, places = _panels(table["panel"].nunique(), 2.5)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=False):
        optimum = float(rows["optimum"].iloc[0])
        for method, own in groups(rows, "method"):
            colour = _colour(method)
            label = f"{method} (n = {int(own['runs'].max())})"
            axes.fill_between(
                own["generation"], own["lower"], own["upper"], color=colour, alpha=0.18, linewidth=0
            )
            axes.plot(own["generation"], own["median"], color=colour, label=label)
        axes.axhline(
            optimum,
            color=style.NEUTRAL,
            linestyle=(0, (5, 1.5, 1, 1.5)),
            linewidth=1.0,
            label="optimum",
        )
        late = rows[rows["generation"] >= min(3, int(rows["generation"].max()))]
        far = max(float((late[["lower", "upper"]] - optimum).abs().to_numpy().max()), 1e-9)
        low, high = (optimum - 0.08 * far,
        optimum + far) if rows["quantity"].iloc[0].startswith("t") else (
            optimum - far,
            optimum + 0.08 * far,
        )  # fmt: skip
        if np.isfinite([low, high]).all():
            axes.set_ylim(low, high)
        axes.set_xlim(0, max(1, int(rows["generation"].max())))
        axes.set_xlabel("generation")
        axes.set_ylabel(f"{rows['quantity'].iloc[0]} [-]")
        axes.set_title(rows["case"].iloc[0])
    style.legend_below(figure, places[0], 4)
    return figure


# --------------------------------------------------------------------------------------------- gaps


def gaps_table(cases: list[Case]) -> pd.DataFrame:
    """Return the gap of every run, and of every start of a conventional method, to the optimum.

    Returns:
        Columns panel, case, method, position, gap.
    """
    parts = []
    for panel, case in enumerate(cases):
        costs = {method: c.column("best_cost") for method, c in case.evolved.items()}
        costs |= {method: ends[:, 2] for method, ends in case.ends().items()}
        for method, values in costs.items():
            gaps = np.maximum(case.gaps(values), 0.0)
            position = METHODS.index(method)
            parts.append(
                pd.DataFrame({"gap": gaps}).assign(
                    panel=panel, case=case.name, method=method, at=position
                )
            )
    return rounded(pd.concat(parts, ignore_index=True)[["panel", "case", "method", "at", "gap"]])


def draw_gaps(table: pd.DataFrame) -> Figure:
    """Draw shares of runs, or starts, whose gap is smaller than x, one panel per criterion."""
    figure, places = _panels(table["panel"].nunique(), 2.5)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=False):
        for _, own in groups(rows, "at"):
            method = own["method"].iloc[0]
            x = np.sort(
                np.clip(np.nan_to_num(own["gap"].to_numpy(), posinf=np.inf), LEAST_GAP, None)
            )
            share = np.arange(1, len(x) + 1) / len(x)
            finite = np.isfinite(x)
            kind: Any = "-" if METHODS.index(method) < 3 else (0, (4, 1.5))
            steps = {
                "color": _colour(method),
                "linestyle": kind,
                "label": f"{method} (n = {len(x)})",
            }
            axes.step(
                np.append(x[finite], 1e2),
                np.append(share[finite], finite.mean()),
                where="post",
                **steps,
            )
        for close in (0.001, 0.01):
            axes.axvline(close, color=style.FAINT, linewidth=0.8, linestyle=":")
        axes.set_xscale("log")
        axes.set_xlim(LEAST_GAP, 10.0)
        axes.set_ylim(0.0, 1.02)
        axes.set_xlabel("gap E / E* − 1 [-]")
        axes.set_ylabel("share with a smaller gap")
        axes.set_title(rows["case"].iloc[0])
    _legend_of_all(figure, places, 3)
    return figure


# ----------------------------------------------------------------------------------------- postures


def postures_table(cases: list[Case]) -> pd.DataFrame:
    """Return the links of the exact optimum, of the best run and at the paper's angles, platform.

    Obstacles, force.

    Returns:
        Columns panel, case, element (platform, link, obstacle, force, target), posture, x, y,
        x_end, y_end, size.
    """
    rows: list[tuple[Any, ...]] = []
    for panel, case in enumerate(cases):
        head = (panel, case.name)
        scenario: Any = case.any.condition.scenario
        for obstacle, (x, y) in zip(scenario.obstacles, scenario.obstacle_points(), strict=True):
            rows.append(
                (*head, "obstacle", "", x, y, x, y, float(getattr(obstacle, "radius", 0.0)))
            )
        force = np.array(scenario.force) / max(float(np.hypot(*scenario.force)), 1e-12)
        x, y = scenario.target
        rows.append((*head, "force", "", x, y, x + 0.6 * force[0], y + 0.6 * force[1], 0.0))
        for posture, angles in _shown(case).items():
            found = case.measured(angles)
            if found["branch"] >= 0.0:
                rows += [(*head, *row) for row in _links(case, posture, found)]
    names = ["panel", "case", "element", "posture", "x", "y", "x_end", "y_end", "size"]
    return rounded(pd.DataFrame(rows, columns=names))


def _shown(case: Case) -> dict[str, Any]:
    """Return θ1, θ2 [deg] of the postures that are drawn."""
    shown: dict[str, Any] = {}
    if case.optimum is not None:
        shown[POSTURES[0]] = case.optimum.solutions[case.optimum.best_replicate]
    run = case.elitist or case.plain
    if run is not None:
        shown[POSTURES[1]] = run.solutions[run.best_replicate]
    if case.printed is not None and case.printed.angles is not None:
        shown[POSTURES[2]] = case.printed.angles
    return shown


def _links(case: Case, posture: str, found: dict[str, float]) -> list[tuple[Any, ...]]:
    robot: Any = case.any.condition.robot
    x, y, angle = found["platform_x"], 0.0, 0.0
    length, height = robot.platform_size
    rows: list[tuple[Any, ...]] = [
        ("platform", posture, x - length / 2, -height / 2, x + length / 2, height / 2, 0.0)
    ]
    for k, link in enumerate(robot.link_lengths):
        angle += np.radians(found[f"theta_{k + 1}_deg"])
        end = x + link * np.cos(angle), y + link * np.sin(angle)
        rows.append(("link", posture, x, y, *end, float(k + 1)))
        x, y = end
    return rows


def draw_postures(table: pd.DataFrame) -> Figure:
    """Draw one panel per criterion."""
    figure, places = _panels(table["panel"].nunique(), 2.6)
    looks = dict(
        zip(
            POSTURES,
            ((style.NEUTRAL, 3.4), (style.ARM_COLOURS[0], 1.7), (style.ARM_COLOURS[1], 1.1)),
            strict=True,
        )
    )
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=False):
        style.operational_axes(axes, "unit")
        axes.axhline(0.0, color=style.FAINT, linewidth=0.8)
        for posture, (colour, width) in looks.items():
            own = rows[rows["posture"] == posture]
            if len(own):
                _draw_posture(axes, own, posture, colour, width)
        for row in records(rows[rows["element"] == "obstacle"]):
            axes.plot(
                row.x,
                row.y,
                "X",
                color=style.FORBIDDEN,
                ms=7,
                mec="white",
                zorder=8,
                label="obstacle",
            )
        for row in records(rows[rows["element"] == "force"]):
            arrow = {"arrowstyle": "-|>", "color": style.ARM_COLOURS[2], "linewidth": 1.4}
            axes.annotate("", (row.x_end, row.y_end), (row.x, row.y), arrowprops=arrow, zorder=7)
            axes.plot([], [], color=style.ARM_COLOURS[2], label="force F")
        axes.set_xlim(*_around(table, "x"))
        axes.set_ylim(*_around(table, "y"))
        axes.xaxis.set_major_locator(style.few_ticks())
        axes.set_title(rows["case"].iloc[0])
    _legend_of_all(figure, places, 5)
    return figure


def _draw_posture(axes: Axes, rows: pd.DataFrame, label: str, colour: str, width: float) -> None:
    links = rows[rows["element"] == "link"]
    x, y = ([*links[name], links[f"{name}_end"].iloc[-1]] for name in "xy")
    axes.plot(x, y, "o-", color=colour, linewidth=width, ms=3.0, mfc="white", label=label, zorder=5)
    for row in records(rows[rows["element"] == "platform"]):
        height = row.y_end - row.y
        look: dict[str, Any] = {
            "fill": False,
            "edgecolor": colour,
            "linewidth": 0.6 * width,
            "zorder": 4,
        }
        rounded_ends = f"round,pad=0,rounding_size={0.499 * height}"
        box = FancyBboxPatch(
            (row.x, row.y), row.x_end - row.x, height, boxstyle=rounded_ends, **look
        )
        axes.add_patch(box)


def _around(table: pd.DataFrame, name: str) -> tuple[float, float]:
    """Return the range of a coordinate over all panels, with a margin."""
    values = table[[name, f"{name}_end"]].to_numpy()
    margin = 0.07 * float(np.ptp(values)) + 0.05
    return float(values.min()) - margin, float(values.max()) + margin


def _panels(count: int, height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with so many panels, two or three in a row."""
    columns = min(count, 3)
    rows = -(-count // columns)
    figure = style.figure(height * rows + 0.6)
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in places[count:]:
        axes.set_axis_off()
    return figure, list(places[:count])


def _legend_of_all(figure: Figure, places: list[Axes], columns: int) -> None:
    """Draw one legend below all panels, of whatever any of them shows."""
    handles: dict[str, Any] = {}
    for axes in places:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=columns)
