"""Figures of a search of settings: scores trial by trial, by setting, and what matters."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.report.figures import marks, style

PER_LINE = 3  # panels side by side
NUMBERS = ("trial", "score", "best", "proven", "runs", "queries")  # columns of no setting
MOST_SETTINGS = 9  # panels of a figure
HIGHEST = 1.5  # score at the top of a panel, in that of the experiment as it is
ORDERS = 30.0  # ratio of the ends of an axis from which on it is logarithmic


def draw_history(table: pd.DataFrame) -> Figure:
    """Draw the score of every trial and the best one so far."""
    figure, (axes,) = style.panels(2.9)
    _draw_scores(axes, table, table["trial"], color=style.NEUTRAL)
    colour = style.condition_colour(0)
    axes.step(table["trial"], table["best"], where="post", color=colour, label="best so far")
    axes.set(xlabel="trial", ylabel="score")
    style.legend_below(figure, [axes], 2)
    return figure


def draw_slices(table: pd.DataFrame) -> Figure:
    """Draw the score over each setting; later trials are darker."""
    shown = [str(key) for key in table if key not in NUMBERS][:MOST_SETTINGS]
    figure, panels = style.panels(2.3, len(shown), PER_LINE, 0.3, sharey=True)
    look: dict[str, Any] = {"edgecolors": style.NEUTRAL, "linewidths": 0.4, "cmap": "Blues"}
    for axes, key in zip(panels, shown, strict=True):
        values = pd.to_numeric(table[key], errors="coerce")
        if values[1:].isna().any():  # words
            names = sorted(table[key][1:].unique())
            values = table[key].map({name: k for k, name in enumerate(names)})
            axes.set_xticks(range(len(names)), names)
            axes.margins(x=0.2)
        elif values.min() > 0.0 and values.max() > ORDERS * values.min():
            axes.set_xscale("log")
        _draw_scores(axes, table, values, c=table["trial"][1:], vmin=-len(table) / 2, **look)
        axes.set_xlabel(key)
        axes.set_ylabel("score" if style.begins_line(axes) else "")
    style.legend_below(figure, panels, 1)
    return figure


def _draw_scores(axes: Axes, table: pd.DataFrame, places: Any, **look: Any) -> None:
    """Draw the scores of trials; those far above that of the experiment as it is at the top."""
    own, top = float(table["score"].iloc[0]), HIGHEST * float(table["score"].iloc[0])
    for is_above, marker in ((False, "o"), (True, "^")):
        rows = (table["trial"] > 0) & ((table["score"] > top) == is_above)
        parts = {"c": look["c"][rows[1:]], "vmax": len(table)} if "c" in look else {}
        scores = table["score"][rows].clip(upper=top)
        axes.scatter(places[rows], scores, marker=marker, s=18, zorder=2, **{**look, **parts})
    axes.axhline(own, color="black", linestyle="--", linewidth=0.8, label="the experiment as it is")


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
