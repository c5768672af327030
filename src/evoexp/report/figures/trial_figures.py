"""Figures of a search of settings: scores trial by trial, by setting, and what matters."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.report.figures import marks, style

PER_LINE = 3  # panels side by side
MOST_SETTINGS = 9  # panels of a figure
ORDERS = 30.0  # ratio of the ends of an axis from which on it is logarithmic


def draw_history(table: pd.DataFrame) -> Figure:
    """Draw the score of every trial and the best one so far."""
    figure, (axes,) = style.panels(2.9)
    found = table[table["trial"] > 0]
    axes.plot(found["trial"], found["score"], "o", ms=4, color=style.NEUTRAL, label="trial")
    colour = style.condition_colour(0)
    axes.step(table["trial"], table["best"], where="post", color=colour, label="best so far")
    _draw_own(axes, table)
    axes.set(xlabel="trial", ylabel="score (lower is better)")
    _scaled(axes, table["score"])
    style.legend_below(figure, [axes], 3)
    return figure


def draw_slices(table: pd.DataFrame) -> Figure:
    """Draw the score over each setting; later trials are darker."""
    keys = [str(key) for key in table.columns[5:]][:MOST_SETTINGS]
    figure, panels = style.panels(2.3, len(keys), PER_LINE, 0.3, sharey=True)
    found = table[table["trial"] > 0]
    for axes, key in zip(panels, keys, strict=True):
        values = pd.to_numeric(found[key], errors="coerce")
        if values.isna().any():  # words
            names = sorted(found[key].unique())
            values = found[key].map(names.index)
            axes.set_xticks(range(len(names)), names)
            axes.margins(x=0.2)
        elif values.min() > 0.0 and values.max() > ORDERS * values.min():
            axes.set_xscale("log")
        look: dict[str, Any] = {
            "c": found["trial"],
            "cmap": "Blues",
            "vmin": -0.5 * len(found),
            "s": 18,
        }
        axes.scatter(values, found["score"], edgecolors=style.NEUTRAL, linewidths=0.4, **look)
        _draw_own(axes, table)
        axes.set_xlabel(key)
        axes.set_ylabel("score" if style.begins_line(axes) else "")
        _scaled(axes, table["score"])
    style.legend_below(figure, panels, 1)
    return figure


def _draw_own(axes: Axes, table: pd.DataFrame) -> None:
    look: dict[str, Any] = {"color": "black", "linestyle": "--", "linewidth": 0.8}
    axes.axhline(table["score"].iloc[0], label="the experiment as it is", **look)


def _scaled(axes: Axes, scores: pd.Series) -> None:
    """Draw scores by orders of magnitude where they differ by some."""
    if scores.max() > ORDERS / 10.0 * scores.min():
        axes.set_yscale("log")


def importance_table(importance: Mapping[str, float]) -> pd.DataFrame:
    """Return columns setting, importance (shares that sum to 1), the largest first."""
    return pd.DataFrame(
        {"setting": list(importance), "importance": list(importance.values())}
    ).sort_values("importance", ascending=False, ignore_index=True)


def draw_importance(table: pd.DataFrame) -> Figure:
    """Draw the importance of the settings as bars."""
    figure, (axes,) = style.panels(0.3 * len(table) + 0.9)
    places = np.arange(len(table))
    axes.barh(places, table["importance"], color=style.condition_colour(0), height=0.6)
    for place, share in zip(places, table["importance"], strict=True):
        marks.beside(axes, place, f"{share:.2f}")
    axes.set_yticks(places, table["setting"])
    axes.set(xlabel="importance", xlim=(0.0, 1.0), ylim=(len(table) - 0.5, -0.5))
    axes.grid(visible=False, axis="y")
    return figure
