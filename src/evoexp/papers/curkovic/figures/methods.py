"""Best costs of methods side by side (Curkovic et al. 2013, Fig. 6): curves, boxes of all runs."""

from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from evoexp.papers.curkovic import measures
from evoexp.papers.curkovic.claims import PAIRS
from evoexp.records import FloatArray
from evoexp.report.figures import groups, marks, style
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.inference import quantile

SPREAD = 0.2  # [rows] over which points are spread to either side
CURVE, FINAL, BOUND, THRESHOLD = "best so far", "final", "lower bound", "threshold"
ORDER = ["series", "position", "method", "panel", "hall", "generation", "replicate", "value"]
WITH, WITHOUT = style.ARM_COLOURS[0], style.ARM_COLOURS[1]
PRINTED_RUNS = 20  # of each method in Fig. 6
DASHED = (0, (4, 1.5))
LINES = {BOUND: (0, (1, 2)), THRESHOLD: (0, (4, 2))}


def costs_table(results: Results, threshold: float) -> pd.DataFrame:
    """Return every run's best cost."""
    parts = [
        pd.DataFrame(
            {
                "position": position,
                "condition": c.label,
                "replicate": c.summaries.index,
                "cost": c.column("best_cost"),
                "refuted": measures.refuted(c) == 1.0,
            }
        )
        for position, c in enumerate(results.with_data)
    ]
    return pd.concat(parts, ignore_index=True).assign(threshold=threshold)


def draw_costs(table: pd.DataFrame) -> Figure:
    """Draw one box per condition, the first on top."""
    labels = table.groupby("position")["condition"].first()
    figure = style.figure(0.25 * len(labels) + 1.3)
    axes = figure.add_subplot()
    names = []
    for position, rows in groups(table, "position"):
        costs, refuted = rows["cost"].to_numpy(), rows["refuted"].to_numpy(dtype=bool)
        draw_cost_box(axes, position, costs, refuted, style.ARM_COLOURS[0], "horizontal")
        names.append(f"{labels[position]}  ({counted(costs, refuted)})")
    threshold = float(table["threshold"].iloc[0])
    line: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 1.0, "linestyle": (0, (4, 2))}
    axes.axvline(threshold, zorder=1, **line)
    axes.set_yticks(range(len(names)), names)
    axes.set(ylim=(len(names) - 0.4, -0.6), xlabel="best C₂ + C₃ + C₄ of a team")
    style.keys_below(figure, [*run_keys(), style.key("threshold", **line)], 4)
    return figure


def draw_cost_box(
    axes: Axes,
    position: float,
    costs: FloatArray,
    refuted: np.ndarray,
    colour: str,
    orientation: Literal["horizontal", "vertical"],
) -> None:
    """Draw the box of all runs, their points, and the median with refuted runs as worst.

    Infinite costs (runs,) are runs without a team; costs grow in the direction of `orientation`.
    """
    finite = np.isfinite(costs)
    if not finite.any():
        return
    line = {"color": colour}
    axes.boxplot(
        costs[finite],
        positions=[position],
        orientation=orientation,
        widths=0.6,
        manage_ticks=False,
        showfliers=False,
        boxprops=line,
        whiskerprops=line,
        capprops=line,
        medianprops={"color": colour, "linewidth": 2.0},
    )
    beside = position + SPREAD * (2.0 * ((np.arange(len(costs)) * 0.618034) % 1.0) - 1.0)
    looks: tuple[tuple[np.ndarray, dict[str, Any]], ...] = (
        (finite & ~refuted, {"marker": "o", "ms": 2.4, "color": colour, "mec": "none"}),
        (finite & refuted, {"marker": "x", "ms": 4.0, "color": style.FORBIDDEN, "mew": 1.0}),
    )
    for shown, look in looks:
        x, y = costs[shown], beside[shown]
        where = (x, y) if orientation == "horizontal" else (y, x)
        axes.plot(*where, linestyle="none", alpha=0.7, zorder=3, **look)
    middle = quantile(np.where(refuted, np.inf, costs), 0.5)
    if np.isfinite(middle):
        place = (middle, position) if orientation == "horizontal" else (position, middle)
        axes.plot(*place, "D", ms=5, color="white", mec=style.NEUTRAL, mew=1.0, zorder=5)


def counted(costs: FloatArray, refuted: np.ndarray) -> str:
    """Return the number of runs, of those without a team, and of the refuted: "n = 20, 3 ×"."""
    without = int(np.count_nonzero(~np.isfinite(costs)))
    parts = [f"n = {len(costs)}"] + [f"{without} without"] * (without > 0)
    return ", ".join([*parts, f"{int(refuted.sum())} ×"])


def run_keys() -> list[Line2D]:
    """Return the entries of a legend for points and medians."""
    grey = style.NEUTRAL
    return [
        marks.point_key("a run", "o", 3, color=grey),
        marks.point_key("refuted (×)", "x", 5, color=style.FORBIDDEN),
        marks.point_key("median, refuted as worst", "D", 5, mec=grey, mfc="white"),
    ]


ORDER += ["deviation", "replicates", "refuted"]


def methods_table(results: Results, bound: float, threshold: float) -> pd.DataFrame:
    """Return best costs so far per generation, and at the end, and two costs to compare with.

    Of the first runs, as many as the paper draws.
    """
    panels = {label: k for k, pair in enumerate(PAIRS) for label in pair}
    parts = []
    for position, c in enumerate(results.with_data):
        drawn = c.summaries.index < PRINTED_RUNS
        rows = c.generations[c.generations["replicate"] < PRINTED_RUNS]
        costs = rows.pivot(index="index", columns="replicate", values="best_cost")
        finite = costs.replace([np.inf], np.nan)
        curve = pd.DataFrame(
            {
                "series": CURVE,
                "generation": finite.index.to_numpy(),
                "value": finite.mean(axis=1).to_numpy(),
                "deviation": finite.std(axis=1, ddof=1).to_numpy(),
                "replicates": finite.notna().sum(axis=1).to_numpy(),
            }
        )
        final = pd.DataFrame(
            {
                "series": FINAL,
                "replicate": c.summaries.index[drawn],
                "value": c.column("best_cost")[drawn],
                "refuted": (measures.refuted(c) == 1.0)[drawn],
            }
        )
        own: dict[str, Any] = {
            "position": position,
            "method": c.label,
            "panel": panels.get(c.label, len(PAIRS)),
            "hall": bool(c.planner.ga.hall_depth),
        }
        parts += [part.assign(**own) for part in (curve, final)]
    lines = pd.DataFrame({"series": [BOUND, THRESHOLD], "value": [bound, threshold]})
    table = pd.concat([*parts, lines], ignore_index=True)
    return table[ORDER].astype({"value": "float64", "deviation": "float64"})


def draw_methods(table: pd.DataFrame) -> Figure:
    """Draw mean and standard deviation pair by pair, and the final values as boxes."""
    curves, final = (table[table["series"] == series] for series in (CURVE, FINAL))
    panels = sorted(curves["panel"].unique())
    figure = style.figure(6.4)
    halves: Any = figure.subfigures(2, 1, height_ratios=(5, 6))
    above, below = halves
    row = above.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False)[0]
    for axes, panel in zip(row, panels, strict=True):
        pair, names = curves[curves["panel"] == panel], []
        for _, rows in groups(pair, "position"):
            colour, kind = (WITH, "-") if rows["hall"].iloc[0] else (WITHOUT, DASHED)
            names.append(str(rows["method"].iloc[0]))
            x, mean, deviation = (
                rows[name].to_numpy(np.float64) for name in ("generation", "value", "deviation")
            )
            marks.band(axes, x, mean - deviation, mean + deviation, colour, alpha=0.2)
            axes.plot(x, mean, color=colour, linestyle=kind)
        axes.set_xlim(0, max(1.0, float(pair["generation"].max())))
        axes.set(xlabel="generation", title=" and ".join(names))
        axes.xaxis.set_major_locator(style.few_ticks())
        _lines(axes, table)
    row[0].set_ylabel("best C₂ + C₃ + C₄ of a team")
    above.suptitle(
        "a  best collision-free team so far: mean ± standard deviation",
        x=0.01, ha="left", fontsize=9, fontweight="bold",
    )  # fmt: skip
    boxes = below.subplots()
    labels = []
    for position, rows in groups(final, "position"):
        costs, refuted = rows["value"].to_numpy(), rows["refuted"].to_numpy(dtype=bool)
        colour = WITH if rows["hall"].iloc[0] else WITHOUT
        draw_cost_box(boxes, int(position), costs, refuted, colour, "vertical")
        labels.append(f"{rows['method'].iloc[0]}\n{counted(costs, refuted)}")
    _lines(boxes, table)
    boxes.set_title("b  at the end of each run")
    boxes.set(xlim=(-0.6, len(labels) - 0.4), ylabel="best C₂ + C₃ + C₄ of a team")
    boxes.set_xticks(range(len(labels)), labels)
    keys = [
        style.key("hall of fame, Eq. 10", color=WITH),
        style.key("no hall, constant rate", color=WITHOUT, linestyle=DASHED),
        *run_keys(),
        *(style.key(name, color=style.NEUTRAL, lw=1.0, ls=kind) for name, kind in LINES.items()),
    ]
    style.keys_below(below, keys, 4)
    return figure


def _lines(axes: Axes, table: pd.DataFrame) -> None:
    """Draw lower bound and threshold, with room below the bound."""
    for name, kind in LINES.items():
        value = float(table.loc[table["series"] == name, "value"].iloc[0])
        axes.axhline(value, color=style.NEUTRAL, linewidth=1.0, linestyle=kind, zorder=1)
    low, high = axes.get_ylim()
    bound = float(table.loc[table["series"] == BOUND, "value"].iloc[0])
    axes.set_ylim(min(low, bound - 0.04 * (high - bound)), high)
