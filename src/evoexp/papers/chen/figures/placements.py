"""Docking postures (Chen & Zalzala 1995, Figs. 3–9): fitness, gaps, postures, landscapes of E.

The last figure joins both searches: a safe path and a docking posture as one motion.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MultipleLocator

from evoexp.papers import trails
from evoexp.papers.chen.docking_postures import CLOSE, METHODS, Case
from evoexp.papers.chen.figures import grid_paths
from evoexp.planners.two_stage.planner import Problem
from evoexp.report.figures import Rows, groups, marks, records, style, table_of
from evoexp.report.pages import markdown
from evoexp.report.results.run_measures import median_replicate
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.inference import quantiles

RUNS = ("GA", "GA, elitism", "random search")
ORDER = (*RUNS, *METHODS)  # the place of a method gives its colour
OPTIMUM_LINE: dict[str, Any] = {
    "color": style.NEUTRAL,
    "linestyle": (0, (5, 1.5, 1, 1.5)),
    "linewidth": 1.0,
}
LEAST_GAP = 1e-6  # [-] smaller gaps are drawn as this one
POSTURE_LOOKS = {  # colour and width of each posture
    "exact optimum": (style.NEUTRAL, 3.4),
    "best run": (style.ARM_COLOURS[0], 1.7),
    "paper's angles": (style.ARM_COLOURS[1], 1.1),
}
ARROW: dict[str, Any] = {"arrowstyle": "-|>", "color": style.ARM_COLOURS[2], "linewidth": 1.4}
OBSTACLE: dict[str, Any] = {"color": style.FORBIDDEN, "ms": 7, "mec": "white", "zorder": 8}
GRID, RUN, PAPER, OPTIMUM, MINIMUM = "grid", "GA, runs", "paper", "optimum", "other local minima"
LOOKS: dict[str, dict[str, Any]] = {
    RUN: {"marker": ".", "color": "#ffffff", "mec": "#000000", "mew": 0.4, "ms": 5, "zorder": 5},
    MINIMUM: {"marker": "v", "color": "none", "mec": "#D55E00", "mew": 1.2, "ms": 7, "zorder": 6},
    OPTIMUM: {"marker": "*", "color": "#D55E00", "mec": "white", "mew": 0.5, "ms": 12, "zorder": 7},
    PAPER: {"marker": "+", "color": "#000000", "mew": 1.6, "ms": 10, "zorder": 8},
}
LABEL = "E [-], lower is better"
ANGLES = ["theta_1_deg", "theta_2_deg"]
WAY, TRAVEL, DOCKED = "path", "travel posture", "docking posture"
TARGET, BODY, FORCE = "target", "body", "force"
MARKED: dict[str, Any] = {"color": style.NEUTRAL}
PLATFORM: dict[str, Any] = {"facecolor": "#dddddd", "edgecolor": style.NEUTRAL}
ARMS: dict[str, dict[str, Any]] = {
    TRAVEL: {"color": style.FAINT, "linestyle": "--"},
    DOCKED: {"color": style.ARM_COLOURS[1]},
}
FORCE_ARROW = {"arrowstyle": "-|>", "color": style.FORBIDDEN}


def _colour(method: str) -> str:
    return style.condition_colour(ORDER.index(method)) if method in ORDER else style.NEUTRAL


@table_of(
    "panel case quantity method generation median lower upper average runs optimum", is_rounded=True
)
def fitness_table(cases: list[Case]) -> Rows:
    """Return median and quartiles over runs of the best fitness f = E_m − E so far."""
    for panel, case in enumerate(cases):
        quantity, sign = "fitness f", -1.0
        offset = float(case.conditions[0].planner.objective.greatest)
        if case.name == "least torque norm":
            quantity, offset, sign = "torque norm E₁", 0.0, 1.0
        for method, condition in case.evolved.items():
            rows = condition.generations
            best, mean = (
                offset + sign * wide.to_numpy(np.float64)
                for name in ("best_cost", "mean_cost")
                for wide in (rows.pivot(index="index", columns="replicate", values=name),)
            )
            curve = panel, case.name, quantity, method, np.unique(rows["index"])
            quartiles, (average,) = quantiles(best, (0.5, 0.25, 0.75)), quantiles(mean, (0.5,))
            runs = rows.groupby("index").size().to_numpy()
            yield *curve, *quartiles, average, runs, offset + sign * case.least


def draw_fitness(table: pd.DataFrame) -> Figure:
    """Draw one panel per criterion: the best so far against generations, the optimum as a line."""
    figure, places = style.panels(2.5, table["panel"].nunique(), 3, 0.6)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=True):
        case, optimum, quantity = rows[["case", "optimum", "quantity"]].iloc[0]
        for method, own in groups(rows, "method"):
            x, colour = own["generation"], _colour(method)
            label = f"{method} (n = {int(own['runs'].max())})"
            marks.band(axes, x, own["lower"], own["upper"], colour)
            axes.plot(x, own["median"], color=colour, label=label)
        axes.axhline(optimum, label="optimum", **OPTIMUM_LINE)
        # the first generations may be far off: later ones tell the range
        most = int(rows["generation"].max())
        late = rows.loc[rows["generation"] >= min(3, most), ["lower", "upper"]]
        far = max(float((late - optimum).abs().to_numpy().max()), 1e-9)
        below, above = (0.08, 1.0) if quantity.startswith("t") else (1.0, 0.08)
        if np.isfinite([far, optimum]).all():
            axes.set_ylim(optimum - below * far, optimum + above * far)
        axes.set(xlim=(0, max(1, most)), xlabel="generation", ylabel=f"{quantity} [-]", title=case)
    style.legend_below(figure, [places[0]], 4)
    return figure


@table_of("panel case method at gap", is_rounded=True)
def gaps_table(cases: list[Case]) -> Rows:
    """Return the gap of every run, and of every start of a conventional method, to the optimum."""
    for panel, case in enumerate(cases):
        costs = {method: c.column("best_cost") for method, c in case.evolved.items()}
        costs |= {method: ends[:, 2] for method, ends in case.ends().items()}
        for method, values in costs.items():
            gaps = np.maximum(case.gaps(values), 0.0)
            yield panel, case.name, method, ORDER.index(method), gaps


def draw_gaps(table: pd.DataFrame) -> Figure:
    """Draw shares of runs, or starts, whose gap is smaller than x, one panel per criterion."""
    figure, places = style.panels(2.5, table["panel"].nunique(), 3, 0.6)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=True):
        for (_, method), own in groups(rows, ["at", "method"]):
            look: dict[str, Any] = {"color": _colour(method), "label": f"{method} (n = {len(own)})"}
            look["linestyle"] = "-" if method in RUNS else (0, (4, 1.5))
            axes.ecdf(np.clip(own["gap"], LEAST_GAP, 1e2), **look)
        for close in CLOSE:
            axes.axvline(close, color=style.FAINT, linewidth=0.8, linestyle=":")
        axes.set(xscale="log", xlim=(LEAST_GAP, 10.0), ylim=(0.0, 1.02))
        axes.set(xlabel="gap E / E* − 1 [-]", ylabel="share with a smaller gap")
        axes.set_title(rows["case"].iloc[0])
    style.legend_below(figure, places, 3)
    return figure


@table_of("panel case element posture x y x_end y_end size", is_rounded=True)
def postures_table(cases: list[Case]) -> Rows:
    """Return obstacles, the force, and three postures: exact optimum, best run, paper's angles."""
    for panel, case in enumerate(cases):
        scenario, robot = case.conditions[0].scenario, case.conditions[0].robot
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
        for posture, angles in zip(POSTURE_LOOKS, shown, strict=True):
            found = {} if angles is None else case.measured(angles)
            if found.get("branch", -1.0) < 0.0:
                continue
            length, height = 0.5 * np.array(robot.platform_size)
            turns = np.cumsum([np.radians(found[f"theta_{k}_deg"]) for k in (1, 2, 3)])
            steps = np.array([np.cos(turns), np.sin(turns)]) * np.array(robot.link_lengths)
            joints = np.cumsum([(found["platform_x"], 0.0), *steps.T], axis=0)
            x, y = joints[0]
            own.append(("platform", posture, x - length, y - height, x + length, y + height, 0.0))
            ends = enumerate(pairwise(joints), 1)
            own += [("link", posture, *start, *end, float(k)) for k, (start, end) in ends]
        yield from ((panel, case.name, *row) for row in own)


def draw_postures(table: pd.DataFrame) -> Figure:
    """Draw one panel per criterion: three postures, the force, the obstacle."""
    (left, low), (right, high) = trails.room(table)
    figure, places = style.panels(2.6, table["panel"].nunique(), 3, 0.6)
    for axes, (_, rows) in zip(places, groups(table, "panel"), strict=True):
        style.operational_axes(axes, "unit")
        axes.axhline(0.0, color=style.FAINT, linewidth=0.8)
        for posture, (colour, width) in POSTURE_LOOKS.items():
            own = rows[rows["posture"] == posture]
            if not len(own):
                continue
            links = own[own["element"] == "link"]
            trails.draw_chain(axes, links, colour, label=posture, linewidth=width)
            for row in records(own[own["element"] == "platform"]):
                edge: dict[str, Any] = {"fill": False, "edgecolor": colour, "lw": 0.6 * width}
                size = row.x_end - row.x, row.y_end - row.y
                axes.add_patch(Rectangle((row.x, row.y), *size, zorder=4, **edge))
        obstacles = rows[rows["element"] == "obstacle"]
        if len(obstacles):
            axes.plot(obstacles["x"], obstacles["y"], "X", label="obstacle", **OBSTACLE)
        for row in records(rows[rows["element"] == "force"]):
            axes.annotate("", (row.x_end, row.y_end), (row.x, row.y), arrowprops=ARROW, zorder=7)
            axes.plot([], [], color=ARROW["color"], label="force F")
        axes.set(title=rows["case"].iloc[0], xlim=(left, right), ylim=(low, high))
        axes.xaxis.set_major_locator(style.few_ticks())
    style.legend_below(figure, places, 5)
    return figure


@table_of(" ".join(["panel case element", *ANGLES, "cost"]), is_rounded=True)
def landscape_table(cases: list[Case]) -> Rows:
    """Return E over the angles, and the points that are marked."""
    for panel, case in enumerate(cases):
        assert case.landscape is not None
        one, two, cost = (case.landscape.array(name) for name in ("theta_1", "theta_2", "cost"))
        grid = np.stack(np.meshgrid(one, two, indexing="ij"), axis=-1).reshape(-1, 2)
        points, minima = {}, case.minima  # element → marked points θ1, θ2 [deg], (points, 2)
        if case.plain is not None:
            points[RUN] = np.array([case.plain.solutions[k] for k in sorted(case.plain.solutions)])
        if len(minima):
            best = minima[:, 2] <= minima[0, 2] * (1.0 + 1e-9)
            points |= {OPTIMUM: minima[best, :2], MINIMUM: minima[~best, :2]}
        if case.printed.angles is not None:
            points[PAPER] = np.array([case.printed.angles])
        marked = {
            element: (angles, np.array([case.measured(pair)["cost"] for pair in angles]))
            for element, angles in points.items()
            if len(angles)
        }
        for element, (angles, costs) in ({GRID: (grid, cost.ravel())} | marked).items():
            yield panel, case.name, element, *angles.T, costs


def draw_landscape(table: pd.DataFrame) -> Figure:
    """Draw E in colours, a column per criterion: the whole, and around the best; white: none."""
    figure, count = style.figure(7.4), table["panel"].nunique()
    places = figure.subplots(2, count, squeeze=False)
    for (whole, close), (_, rows) in zip(places.T, groups(table, "panel"), strict=True):
        wide = rows[rows["element"] == GRID].pivot(
            index=ANGLES[1], columns=ANGLES[0], values="cost"
        )
        least = float(np.nanmin(wide.to_numpy()))
        for axes, greatest in ((whole, 20.0), (close, 3.0)):  # colours up to multiples of the least
            norm = LogNorm(vmin=least, vmax=least * greatest)
            look: dict[str, Any] = {"cmap": "viridis_r", "shading": "nearest", "rasterized": True}
            image = axes.pcolormesh(wide.columns, wide.index, wide.to_numpy(), norm=norm, **look)
            ticks = least * np.geomspace(1.0, greatest, 4)
            scale: dict[str, Any] = {"ticks": ticks, "format": "%.3g", "label": LABEL}
            figure.colorbar(image, ax=axes, extend="max", shrink=0.8, **scale).minorticks_off()
            for element, look in LOOKS.items():  # the marked points
                x, y = rows.loc[rows["element"] == element, ANGLES].to_numpy().T
                if len(x):
                    axes.plot(x, y, linestyle="none", label=element, **look)
            axes.set(xlabel="θ₁ [deg]", ylabel="θ₂ [deg]", aspect="equal")
            axes.grid(False)
        whole.set(xlim=wide.columns[[0, -1]], ylim=wide.index[[0, -1]])
        whole.set_title(rows["case"].iloc[0])
        for axis in (whole.xaxis, whole.yaxis):
            axis.set_major_locator(MultipleLocator(90.0))
        best = rows.loc[rows["element"].isin([OPTIMUM, PAPER, RUN]), ANGLES].to_numpy()
        if len(best):
            (left, low), (right, high) = best.min(axis=0) - 15.0, best.max(axis=0) + 15.0
            close.set(xlim=(left, right), ylim=(low, high))
        close.set_title("around the best", fontweight="normal")
    style.legend_below(figure, [places[0, 0]], 4)
    return figure


@table_of("row unit kind number a b")
def missions_table(shown: Sequence[ConditionResults]) -> Rows:
    """Return the run of median cost of every condition, with everything that is drawn of it."""
    for c in shown:
        replicate = median_replicate(c, c.column("best_cost"))
        q, verdict = c.motion(replicate).q, c.summaries.loc[replicate]
        word = "certified" if verdict["certified"] else "not certified"
        told = f"{c.label}, run {replicate}, {word}, clearance {verdict['clearance']:.3g}"
        robot, scenario, model = c.robot, c.scenario, c.problem(Problem).scene.model
        data = model.createData()
        arms = []  # joints and end of both postures, (4, 2): x, and height
        for posture in q[-2:]:
            pin.forwardKinematics(model, data, posture)
            tip = data.oMi[model.njoints - 1].act(np.array([robot.link_lengths[-1], 0.0, 0.0]))
            points = [*(data.oMi[k].translation for k in range(3, model.njoints)), tip]
            arms.append([(float(x), float(z)) for x, _, z in points])
        (reach, above), boxes = scenario.docking.target, enumerate(scenario.grid.obstacles)
        kinds = [
            *((grid_paths.OBSTACLE, k, [box[:2], box[2:]]) for k, box in boxes),
            (WAY, 0, q[:-1, :2].tolist()),
            (TRAVEL, 0, arms[0]),
            (DOCKED, 0, arms[1]),
            (BODY, 0, [(robot.body_radius, robot.body_height)]),
            (TARGET, 0, [(scenario.task_origin[0] + reach, robot.body_height + above)]),
            (FORCE, 0, [scenario.docking.force]),
        ]
        given = told, c.length_unit
        yield from ((*given, *kind, a, b) for *kind, points in kinds for a, b in points)


def draw_missions(table: pd.DataFrame) -> Figure:
    """Draw one row per motion: from above, and from the side."""
    count = table["row"].nunique()
    figure = style.figure(3.1 * count + 0.3)
    panels = figure.subplots(count, 2, squeeze=False)
    for (above, side), (name, rows) in zip(panels, groups(table, "row"), strict=True):
        label, _, told = str(name).partition(", ")
        unit = str(rows["unit"].iloc[0])
        # from above: obstacles and the platform's way
        for _, corners in groups(rows[rows["kind"] == grid_paths.OBSTACLE], "number"):
            grid_paths.draw_obstacle(above, corners["a"], corners["b"])
        path = rows.loc[rows["kind"] == WAY, ["a", "b"]].to_numpy()
        above.plot(*path.T, color=style.CONDITION_COLOURS[0], label="path of the platform")
        above.plot(*path[0], "o", markersize=4, **MARKED)
        above.plot(*path[-1], "*", markersize=8, label="docking place", **MARKED)
        style.operational_axes(above, unit)
        above.margins(0.08)
        above.set_title(f"{label}: from above")
        # from the side: the platform, both postures of the arm, the target and the force
        first = {str(kind): own[["a", "b"]].to_numpy()[0] for kind, own in groups(rows, "kind")}
        (radius, height), (middle, _) = first[BODY], first[DOCKED]
        side.add_patch(Rectangle((middle - radius, 0.0), 2.0 * radius, height, **PLATFORM))
        for kind, look in ARMS.items():
            joints = rows[rows["kind"] == kind]
            side.plot(joints["a"], joints["b"], marker="o", markersize=3.5, label=kind, **look)
        (x, z), (fx, fz) = first[TARGET], first[FORCE]
        side.plot(x, z, "x", label="target of the end-effector", markersize=7, zorder=4, **MARKED)
        size = np.hypot(fx, fz) or 1.0
        tail = x - 0.6 * fx / size, z - 0.6 * fz / size
        side.annotate("F", (x, z), tail, arrowprops=FORCE_ARROW, ha="center", fontsize=7.5)
        side.axhline(0.0, linewidth=1.0, **MARKED)
        side.set(title=told, xlabel=f"x [{unit}]", ylabel=f"height z [{unit}]")
        side.set_aspect("equal", adjustable="datalim")
        side.margins(0.1)
    style.legend_below(figure, panels[0], 3)
    return figure


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "free_interval": lambda free, confidence: markdown.percent(free.interval(confidence)),
    # the pair of bodies that is closest in most runs
    "closest": lambda condition: condition.summaries["clearance_pair"].value_counts().index[0],
    "places": lambda condition: np.round(condition.column("term_platform_x"), 3),
    # docking places on the near side of the end-effector
    "near": lambda condition, places: np.sum(places < condition.scenario.docking.target[0]),
}
