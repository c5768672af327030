"""Paths of arms in space: through the joint angles, and of the tips."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.rana import motions
from evoexp.records import FloatArray
from evoexp.report.kit import ConditionResults, groups, motion_geometry, rounded, style

BEST = "best replicate"


def paths_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the paths of all replicates and the straight line in both spaces.

    Returns:
        Columns series (best replicate, replicate, straight line), replicate (−1: none), arm,
        instant, x, y, z (of the tip [length unit]), joint_1_deg, joint_2_deg, … (NaN where an arm
        has fewer joints), length_unit.
    """
    table = rounded(motions.paths_table(condition, _path, BEST))
    return table.assign(length_unit=condition.condition.length_unit)


def draw_configuration_space(table: pd.DataFrame) -> Figure:
    """Draw the paths through the first three joint angles of every arm."""
    arms = sorted(table["arm"].unique())
    figure = style.figure(4.0)
    for k, arm in enumerate(arms):
        axes: Any = figure.add_subplot(1, len(arms), k + 1, projection="3d")
        rows = table[table["arm"] == arm]
        columns = [f"joint_{j}_deg" for j in (1, 2, 3)]
        motions.draw_paths(axes, rows, columns, BEST, style.arm_colour(arm))
        labels = [f"{style.joint_symbol(arm, j)} [deg]" for j in range(3)]
        _label(axes, labels, f"arm {arm + 1}")
    style.keys_below(figure, motions.path_keys(table))
    return figure


def draw_operational_space(table: pd.DataFrame) -> Figure:
    """Draw the paths of the tips of all arms."""
    unit = table["length_unit"].iloc[0]
    figure = style.figure(4.2, 5.6)
    axes: Any = figure.add_subplot(projection="3d")
    for arm, rows in groups(table, "arm"):
        motions.draw_paths(axes, rows, ["x", "y", "z"], BEST, style.arm_colour(arm))
    _label(axes, [f"{name} [{unit}]" for name in "xyz"], "")
    spans = [float(np.ptp(table[name])) for name in "xyz"]
    axes.set_box_aspect([max(span, 0.15 * max(spans)) for span in spans], zoom=1.1)
    arms = style.arm_keys(sorted(table["arm"].unique()), lw=2.2)
    style.keys_below(figure, [*arms, *motions.path_keys(table)], 4)
    return figure


def _path(condition: ConditionResults, solution: FloatArray) -> pd.DataFrame:
    """Return one solution's joint angles and tips."""
    problem = motions.problem(condition)
    q = motion_geometry.configurations(condition.prepared, solution)
    places = motion_geometry.joint_positions(problem.assembly, q)
    tips = {arm: end for arm, _, _, end in places}  # the last link's end stays
    frames = []
    for arm, (first, stop) in enumerate(problem.arm_slices):
        columns = {
            "arm": arm,
            "instant": np.arange(q.shape[1]),
            **dict(zip("xyz", tips[arm].T, strict=True)),
            **{f"joint_{j + 1}_deg": q[first + j] for j in range(stop - first)},
        }
        frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def _label(axes: Any, labels: list[str], title: str) -> None:
    axes.set_title(title)
    axes.tick_params(labelsize=6, pad=-1)
    for axis, label in zip((axes.xaxis, axes.yaxis, axes.zaxis), labels, strict=True):
        axis.set_label_text(label)
        axis.labelpad = -2
        axis.set_major_locator(style.few_ticks())
    axes.view_init(elev=24.0, azim=-50.0)
    axes.set_box_aspect(None, zoom=0.82)
