"""Motions of strings of via-points, their straight lines, and how they are drawn as paths."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from evoexp.collision.certifier.verdict import certify
from evoexp.collision.scene import obstacle_pairs
from evoexp.papers import trails
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import groups, style
from evoexp.report.results import motion_geometry, run_measures
from evoexp.report.results.stored_results import ConditionResults

STRAIGHT, OTHERS = "straight line", "replicate"
MOST_PATHS = 200  # replicates whose paths are drawn, beside the best one; more hide each other
ARMS, OBSTACLES = "between arms", "to obstacles"  # kinds of pairs of bodies
WHITE: dict[str, Any] = {"color": "white", "markeredgecolor": style.NEUTRAL, "zorder": 5}


def problem(condition: ConditionResults) -> Problem:
    """Return the problem of a condition whose planner is Rana & Zalzala's, or a control of it."""
    return condition.problem(Problem)


def best_motion(condition: ConditionResults) -> FloatArray:
    """Return the configurations of the best replicate's motion, (nq, instants) [deg]."""
    best = condition.solutions[condition.best_replicate]
    return motion_geometry.configurations(condition.prepared, best)


def straight_line(condition: ConditionResults) -> FloatArray:
    """Return the solution that goes straight from start to goal, flat [deg]."""
    found = problem(condition)
    return motion_geometry.straight_line(condition.planner.shape(found), found.start, found.goal)


def straight_length(condition: ConditionResults) -> float:
    """Return the length of the straight paths of all arms together [deg]."""
    found = problem(condition)
    gap = found.goal - found.start
    return float(sum(np.linalg.norm(gap[a:b]) for a, b in found.arm_slices))


def worth(condition: ConditionResults) -> float:
    """Return how many degrees of path cost as much as one colliding instant, k3 / k1."""
    weights = condition.planner.objective
    return float(weights.collision_weight / weights.length_weight)


def paths_table(
    condition: ConditionResults,
    table_of: Callable[[ConditionResults, FloatArray], pd.DataFrame],
    best: str,
) -> pd.DataFrame:
    """Return one table of the replicates' solutions and of the straight line."""
    solutions, best_replicate = condition.solutions, condition.best_replicate
    shown = [k for n, k in enumerate(solutions) if n < MOST_PATHS or k == best_replicate]
    others = OTHERS if len(shown) == len(solutions) else f"{OTHERS} of {len(solutions)}"
    parts = [
        table_of(condition, solutions[k]).assign(
            series=best if k == best_replicate else others, replicate=k
        )
        for k in shown
    ]
    straight = table_of(condition, straight_line(condition))
    return pd.concat([*parts, straight.assign(series=STRAIGHT, replicate=-1)], ignore_index=True)


def draw_paths(table: pd.DataFrame, columns: list[str], *, together: bool = False) -> Figure:
    """Draw the paths of arms in the plane, or in space, of some columns; each arm in a panel.

    Together they stand in one panel, which is that of the operational space.
    """
    arms, is_solid = list(groups(table, "arm")), len(columns) == 3
    figure = style.figure(4.0, 5.6 if together else style.WIDTH)
    for k, (arm, rows) in enumerate(arms):
        colour = style.arm_colour(arm)
        if k == 0 or not together:
            place = (1, 1 if together else len(arms), k + 1)
            axes: Any = figure.add_subplot(*place, projection="3d" if is_solid else None)
        for (series, _), path in groups(rows, ["series", "replicate"]):
            points = [path[name].to_numpy() for name in columns]
            if series.startswith("best"):
                axes.plot(*points, color=colour, linewidth=1.8, marker="o", ms=2.6, zorder=4)
                axes.plot(*(p[:1] for p in points), "s", markersize=6.5, **WHITE)
                axes.plot(*(p[-1:] for p in points), "*", markersize=10.5, **WHITE)
            elif series == STRAIGHT:
                axes.plot(*points, ":", color=style.NEUTRAL, linewidth=1.1, zorder=3)
            else:
                axes.plot(*points, color=colour, linewidth=0.8, alpha=0.3)
        labels = [f"{style.joint_symbol(arm, joint)} [deg]" for joint in range(len(columns))]
        if together:
            labels = [f"{name} [{table['length_unit'].iloc[0]}]" for name in columns]
        for name, label in zip("xyz", labels, strict=False):
            getattr(axes, f"set_{name}label")(label, labelpad=-2 if is_solid else None)
            getattr(axes, f"{name}axis").set_major_locator(style.few_ticks())
        axes.set_title("" if together else f"arm {arm + 1}")
        if is_solid:
            axes.tick_params(labelsize=6, pad=-1)
            axes.view_init(elev=24.0, azim=-50.0)
            axes.set_box_aspect(None, zoom=0.85)
        else:
            axes.set_aspect("equal", adjustable="datalim")  # lengths are Euclidean in degrees
    keys = [*trails.arm_keys(set(table["arm"])), *path_keys(table)]
    style.keys_below(figure, keys if together else path_keys(table), 4)
    return figure


def path_keys(table: pd.DataFrame) -> list[Line2D]:
    """Return the entries of the legend of `draw_paths`."""
    count, grey = table.loc[table["replicate"] >= 0, "replicate"].nunique(), style.NEUTRAL
    some = [name for name in table["series"].unique() if name.startswith(f"{OTHERS} of ")]
    shown = f"{count} of {some[0].split()[-1]} replicates" if some else ""
    return [
        style.key("best replicate, its via-points", color=grey, linewidth=1.8, marker="o", ms=3),
        style.key(shown or f"all replicates (n = {count})", color=grey, linewidth=0.8, alpha=0.4),
        style.key(STRAIGHT, color=grey, linewidth=1.1, linestyle=":"),
        style.key("start", marker="s", ms=6.5, color="none", mec=grey, mfc="white"),
        style.key("goal", marker="*", ms=10.5, color="none", mec=grey, mfc="white"),
    ]


def kinds_of_pairs(condition: ConditionResults) -> dict[str, tuple[np.ndarray, float]]:
    """Return the kinds of pairs of bodies: name → (pairs of the scene, required distance)."""
    found = problem(condition)
    among = obstacle_pairs(found.assembly, found.scene)
    kinds = {ARMS: (~among, found.security_margin), OBSTACLES: (among, found.obstacle_margin)}
    return {name: kind for name, kind in kinds.items() if kind[0].any()}


def approaches(condition: ConditionResults) -> pd.DataFrame:
    """Return how close the bodies of each kind of pairs come in every replicate's motion, exactly.

    `refuted_at` is NaN where they touch nowhere; `kept` says whether the required distance is.
    """
    rows = []
    for name, (kept, margin) in kinds_of_pairs(condition).items():
        bodies = problem(condition).scene.of_pairs(kept)
        for k in condition.solutions:
            verdict = certify(bodies, condition.motion(k), margin)
            where = verdict.clearance, verdict.clearance_at, verdict.refuted_at
            rows.append((name, k, *where, verdict.margin_status == "certified"))
    names = ["kind", "replicate", "clearance", "clearance_at", "refuted_at", "kept"]
    return pd.DataFrame(rows, columns=names)


def colliding_after(condition: ConditionResults, relaxed: bool) -> int:
    """Count the collision-free final strings that collide once redistributed (and relaxed)."""
    own, found = condition.planner, problem(condition)
    step = own.relaxation_step if relaxed else 0.0
    operator = own.model_copy(update={"redistribution": True, "relaxation_step": step})
    strings = [
        motion_geometry.configurations(condition.prepared, condition.solutions[int(k)])
        for k in condition.summaries.index[run_measures.solved(condition)]
    ]
    if not strings:
        return 0
    rng = np.random.Generator(np.random.PCG64(0))  # the operator draws nothing
    improved = operator.improve(found, np.stack(strings, axis=2), rng)
    return int(np.count_nonzero(~own.cost(found, improved).feasible))
