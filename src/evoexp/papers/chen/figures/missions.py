"""Chen & Zalzala 1995, both searches joined: a safe path and a docking posture as one motion."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from evoexp.papers.chen.figures.grid_paths import OBSTACLE, draw_obstacle
from evoexp.planners.two_stage.planner import Problem
from evoexp.report.figures import groups, style
from evoexp.report.pages import markdown
from evoexp.report.results.run_measures import median_replicate
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.inference import Proportion

PATH, TRAVEL, DOCKED = "path", "travel posture", "docking posture"
TARGET, BODY, FORCE = "target", "body", "force"
MARK: dict[str, Any] = {"color": style.NEUTRAL}
PLATFORM: dict[str, Any] = {"facecolor": "#dddddd", "edgecolor": style.NEUTRAL}
ARMS: dict[str, dict[str, Any]] = {
    TRAVEL: {"color": style.FAINT, "linestyle": "--"},
    DOCKED: {"color": style.ARM_COLOURS[1]},
}
ARROW = {"arrowstyle": "-|>", "color": style.FORBIDDEN}


def missions_table(shown: Sequence[ConditionResults]) -> pd.DataFrame:
    """Return the run of median cost of every condition, with everything that is drawn of it."""
    rows: list[tuple[object, ...]] = []
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
        reach, above = scenario.docking.target
        kinds = [
            *((OBSTACLE, k, [box[:2], box[2:]]) for k, box in enumerate(scenario.grid.obstacles)),
            (PATH, 0, q[:-1, :2].tolist()),
            (TRAVEL, 0, arms[0]),
            (DOCKED, 0, arms[1]),
            (BODY, 0, [(robot.body_radius, robot.body_height)]),
            (TARGET, 0, [(scenario.task_origin[0] + reach, robot.body_height + above)]),
            (FORCE, 0, [scenario.docking.force]),
        ]
        given = told, c.length_unit
        rows += [(*given, *kind, a, b) for *kind, points in kinds for a, b in points]
    return pd.DataFrame(rows, columns=["row", "unit", "kind", "number", "a", "b"])


def draw_missions(table: pd.DataFrame) -> Figure:
    """Draw one row per motion: from above, and from the side."""
    count = table["row"].nunique()
    figure = style.figure(3.1 * count + 0.3)
    panels = figure.subplots(count, 2, squeeze=False)
    for (above, side), (name, rows) in zip(panels, groups(table, "row"), strict=True):
        label, _, told = str(name).partition(", ")
        unit = str(rows["unit"].iloc[0])
        # from above: obstacles and the platform's way
        for _, corners in groups(rows[rows["kind"] == OBSTACLE], "number"):
            draw_obstacle(above, corners["a"], corners["b"])
        path = rows.loc[rows["kind"] == PATH, ["a", "b"]].to_numpy()
        above.plot(*path.T, color=style.CONDITION_COLOURS[0], label="way of the platform")
        above.plot(*path[0], "o", markersize=4, **MARK)
        above.plot(*path[-1], "*", markersize=8, label="docking place", **MARK)
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
        side.plot(x, z, "x", label="target of the end-effector", markersize=7, zorder=4, **MARK)
        size = np.hypot(fx, fz) or 1.0
        tail = x - 0.6 * fx / size, z - 0.6 * fz / size
        side.annotate("F", (x, z), tail, arrowprops=ARROW, ha="center", fontsize=7.5)
        side.axhline(0.0, linewidth=1.0, **MARK)
        side.set(title=told, xlabel=f"x [{unit}]", ylabel=f"height z [{unit}]")
        side.set_aspect("equal", adjustable="datalim")
        side.margins(0.1)
    style.legend_below(figure, panels[0], 3)
    return figure


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # motions of a condition that are free of contact, of those judged
    "free": lambda condition: Proportion(condition.verdicts.certified, condition.verdicts.judged),
    "free_interval": lambda free, confidence: markdown.percent(free.interval(confidence)),
    # the pair of bodies that is closest in most runs
    "closest": lambda condition: condition.summaries["clearance_pair"].value_counts().index[0],
    "places": lambda condition: np.round(condition.column("term_platform_x"), 3),
    # docking places on the near side of the end-effector
    "near": lambda condition, places: np.sum(places < condition.scenario.docking.target[0]),
}
