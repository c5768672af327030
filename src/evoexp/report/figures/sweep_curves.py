"""Convergence of a sweep in facets: a panel per condition and first settings, a curve per value."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report import style
from evoexp.report.figures import groups
from evoexp.report.figures.convergence import NAMES, cost_table
from evoexp.report.figures.end_labels import CurveEnd, name_ends
from evoexp.report.results import Results
from evoexp.report.swept_settings import Sweep

PER_LINE = 3  # panels side by side
MOST_PANELS = 18
SETTLED = 0.05  # [-] of a run, after which the panels show all costs
ORDINAL, PALEST = "viridis", 0.8  # colours of values that have an order, the palest to be read


def facets(sweep: Sweep) -> list[tuple[str, str]]:
    """Return the panels: (condition, values of all settings but the last), each once."""
    return list(
        dict.fromkeys((each.base, _before(sweep, each.values)) for each in sweep.conditions)
    )


def _before(sweep: Sweep, values: tuple[str, ...]) -> str:
    """Return the values of all settings but the last one, with their names."""
    named = zip(sweep.settings[:-1], values, strict=False)
    return ", ".join(f"{setting} = {value}" for setting, value in named)


def convergence_table(results: Results, sweep: Sweep) -> pd.DataFrame:
    """Return the best cost so far of each combination.

    Returns:
        Columns of `convergence.cost_table`, base and facet (the panel), setting, value and level
        (name, value and its place among the values of the last setting).
    """
    table = cost_table(results)
    best = table[table["quantity"] == NAMES["best_cost"]]
    of = {each.results.label: each for each in sweep.conditions}
    levels = sweep.levels(len(sweep.settings) - 1)
    labels = best[best["condition"].isin(of.keys())]["condition"]
    return best.loc[labels.index].assign(
        base=labels.map({label: each.base for label, each in of.items()}),
        facet=labels.map({label: _before(sweep, each.values) for label, each in of.items()}),
        setting=sweep.settings[-1],
        value=labels.map({label: each.values[-1] for label, each in of.items()}),
        level=labels.map({label: levels.index(each.values[-1]) for label, each in of.items()}),
    )


def draw_convergence(table: pd.DataFrame) -> Figure:
    """Draw the panels, those of one condition in one scale; values stand at the ends of curves."""
    import matplotlib as mpl

    shown = table.replace([np.inf, -np.inf], np.nan)
    panels = list(dict.fromkeys(zip(shown["base"], shown["facet"], strict=True)))[:MOST_PANELS]
    beside = len({facet for _, facet in panels})
    per_line = beside if 1 < beside <= PER_LINE else min(PER_LINE, len(panels))
    figure, axes_of = style.lines_of_panels(2.35, len(panels), per_line, 0.3)
    count = int(shown["level"].max()) + 1
    colours = [mpl.colors.to_hex(c) for c in mpl.colormaps[ORDINAL](np.linspace(0, PALEST, count))]
    for axes, (base, facet) in zip(axes_of, panels, strict=True):
        of_base = shown[shown["base"] == base]
        own, ends = of_base[of_base["facet"] == facet], []
        for level, curve in groups(own, "level"):
            axes.plot(curve["evaluations"], curve["median"], color=colours[level], linewidth=1.1)
            last = curve.iloc[-1]
            place = float(last["evaluations"]), float(last["median"])
            ends.append(CurveEnd(*place, str(last["value"]), colours[level]))
        axes.set(xlim=(0.0, float(own["evaluations"].max())), ylim=_limits(of_base))
        axes.set_title("\n".join(word for word in (base, facet) if word))
        axes.set_xlabel("evaluations" if style.ends_column(axes, axes_of) else "")
        axes.set_ylabel("best cost so far" if style.begins_line(axes) else "")
        axes.xaxis.set_major_locator(style.few_ticks())
        style.shorten_thousands(axes.xaxis)
        name_ends(axes, ends)
    setting = table["setting"].iloc[0]
    style.keys_below(figure, [style.key(f"medians; at the ends of curves: {setting}", lw=0)])
    return figure


def _limits(curves: pd.DataFrame) -> tuple[float, float]:
    """Return the limits of costs: from the lowest end to the highest cost of the settled curves."""
    known: list[float] = []
    for _, curve in groups(curves, "condition"):
        medians = curve["median"].to_numpy(np.float64)
        known += [medians[-1], medians[int(SETTLED * len(medians))]]
    finite = [value for value in known if np.isfinite(value)]
    low, high = (min(finite), max(finite)) if finite else (0.0, 1.0)
    room = 0.05 * (high - low) or 1.0
    return low - room, high + room
