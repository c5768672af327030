"""A sweep at a glance: a quantity over its settings, and their effects."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.report import style
from evoexp.report.figures import records
from evoexp.report.figures.end_labels import CurveEnd, name_ends
from evoexp.report.figures.matrix import DARK, LUMINANCE
from evoexp.report.statistics import quantile
from evoexp.report.swept_settings import MainEffect, Sweep, Values

PER_LINE = 3  # panels side by side
MOST_PANELS = 18


def grid_table(sweep: Sweep, values: Values) -> pd.DataFrame:
    """Return median and quartiles of a quantity of each combination.

    Returns:
        Columns panel, x, y (names of the values of the last two settings; y is empty where one
        setting is swept), column, row (their places), median, lower, upper, runs.
    """
    found, last = [], len(sweep.settings) - 1
    levels = [sweep.levels(k) for k in range(len(sweep.settings))]
    for each in sweep.conditions:
        if not each.results.done:
            continue
        own = values(each.results)
        before = sweep.settings[: max(last - 1, 0)]
        words = [f"{s} = {v}" for s, v in zip(before, each.values, strict=False)]
        panel = ", ".join(word for word in (each.base, *words) if word)
        y, row = ("", 0) if last == 0 else _place(each.values[last - 1], levels[last - 1])
        x, column = _place(each.values[last], levels[last])
        spread = (quantile(own, share) for share in (0.5, 0.25, 0.75))
        found.append((panel, x, y, column, row, *spread, len(own)))
    names = ["panel", "x", "y", "column", "row", "median", "lower", "upper", "runs"]
    return pd.DataFrame(found, columns=names).assign(
        x_setting=sweep.settings[last], y_setting=sweep.settings[last - 1] if last else ""
    )


def _place(value: str, levels: Sequence[str]) -> tuple[str, int]:
    return value, levels.index(value)


def draw_grid(table: pd.DataFrame, name: str) -> Figure:
    """Draw a heat map of medians per panel, or, where one setting is swept, a curve."""
    return _draw_curves(table, name) if (table["y"] == "").all() else _draw_maps(table, name)


def _draw_maps(table: pd.DataFrame, name: str) -> Figure:
    panels = list(dict.fromkeys(table["panel"]))[:MOST_PANELS]
    rows = int(table["row"].max()) + 1
    figure, axes_of = style.lines_of_panels(0.42 * rows + 1.15, len(panels), PER_LINE, 0.0)
    finite = table.loc[np.isfinite(table["median"]), "median"]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    image = None
    for axes, panel in zip(axes_of, panels, strict=True):
        own = table[table["panel"] == panel]
        cells = own.pivot(index="row", columns="column", values="median")
        cells = cells.reindex(index=range(rows), columns=range(int(table["column"].max()) + 1))
        shown = cells.to_numpy(np.float64)
        finite_cells = np.where(np.isfinite(shown), shown, np.nan)
        limits: dict[str, Any] = {"vmin": low, "vmax": high if high > low else low + 1.0}
        image = axes.imshow(finite_cells, cmap="viridis_r", aspect="auto", **limits)
        for cell in records(own):
            _write_cell(axes, image, cell)
        ticks = own.drop_duplicates("column").sort_values("column")
        axes.set_xticks(ticks["column"], ticks["x"])
        ticks = own.drop_duplicates("row").sort_values("row")
        axes.set_yticks(ticks["row"], ticks["y"])
        axes.set(title=panel, xlabel=table["x_setting"].iloc[0])
        axes.grid(visible=False)
        axes.tick_params(length=0)
    for axes in filter(style.begins_line, axes_of):
        axes.set_ylabel(table["y_setting"].iloc[0])
    if image is not None:
        figure.colorbar(image, ax=axes_of, label=f"{name} (median)", fraction=0.05, aspect=14)
    return figure


def _write_cell(axes: Axes, image: Any, cell: Any) -> None:
    """Write the median into a cell, white in dark ones."""
    text = f"{cell.median:.4g}" if np.isfinite(cell.median) else "∞"
    is_dark = np.isfinite(cell.median) and np.dot(LUMINANCE, image.to_rgba(cell.median)[:3]) < DARK
    look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7.5}
    axes.annotate(text, (cell.column, cell.row), color="white" if is_dark else "black", **look)


def _draw_curves(table: pd.DataFrame, name: str) -> Figure:
    figure, (axes,) = style.row_of_panels(3.2, 1)
    panels = list(dict.fromkeys(table["panel"]))
    ends = []
    for k, panel in enumerate(panels):
        own = table[table["panel"] == panel].sort_values("column")
        own = own[np.isfinite(own[["median", "lower", "upper"]]).all(axis=1)]
        if own.empty:
            continue
        errors = [own["median"] - own["lower"], own["upper"] - own["median"]]
        look: dict[str, Any] = {"color": style.condition_colour(k), "marker": "o", "ms": 4}
        axes.errorbar(own["column"], own["median"], yerr=errors, capsize=2.0, **look)
        last = own.iloc[-1]
        place = float(last["column"]), float(last["median"])
        ends.append(CurveEnd(*place, panel, style.condition_colour(k)))
    ticks = table.drop_duplicates("column").sort_values("column")
    axes.set_xticks(ticks["column"], ticks["x"])
    axes.margins(x=0.05)
    axes.set(xlabel=table["x_setting"].iloc[0], ylabel=f"{name} (median, quartiles)")
    if any(panels):
        name_ends(axes, ends)
    return figure


def effect_table(rows: Sequence[MainEffect]) -> pd.DataFrame:
    """Return main effects, one per row; columns of `MainEffect`, the interval as low and high."""
    found = [
        (r.base, r.setting, r.first, r.other, r.num_pairs, r.difference, *r.interval, r.better)
        for r in rows
    ]
    names = ["base", "setting", "first", "other", "pairs", "difference", "low", "high", "better"]
    return pd.DataFrame(found, columns=names)


def draw_effects(table: pd.DataFrame) -> Figure:
    """Draw the median differences with their intervals, one panel per swept condition."""
    bases = list(dict.fromkeys(table["base"]))[:MOST_PANELS]
    rows = max(int((table["base"] == base).sum()) for base in bases)
    figure, panels = style.lines_of_panels(0.26 * rows + 1.0, len(bases), PER_LINE, 0.0)
    for axes, base in zip(panels, bases, strict=True):
        own = table[table["base"] == base].reset_index(drop=True)
        finite = own[np.isfinite(own[["difference", "low", "high"]]).all(axis=1)]
        errors = [finite["difference"] - finite["low"], finite["high"] - finite["difference"]]
        look: dict[str, Any] = {"fmt": "o", "ms": 4, "capsize": 2.0, "color": style.NEUTRAL}
        axes.errorbar(finite["difference"], finite.index, xerr=errors, **look)
        axes.axvline(0.0, color=style.FAINT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1)
        names = [f"{r.setting}: {r.first} → {r.other}" for r in records(own)]
        axes.set_yticks(range(len(own)), names if style.begins_line(axes) else [])
        axes.set(title=base, xlabel="change of the cost", ylim=(len(own) - 0.5, -0.5))
        axes.xaxis.set_major_locator(style.few_ticks())
    return figure
