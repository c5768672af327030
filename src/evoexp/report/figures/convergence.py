"""Costs over generations, over evaluations and over settings: of sweeps and of searches."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from evoexp.report.figures import Rows, groups, marks, records, style, table_of
from evoexp.report.figures.marks import name_curves, name_ends
from evoexp.report.pages.sweeps import MOST_PANELS, Sweep, labelled
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import quantile, quantiles

COLUMNS = ("best_cost", "mean_cost")
NAMES = {"best_cost": "best so far", "mean_cost": "average"}
REFERENCE = "reference"
LINE = 0.14  # [inch] of the height of a figure for each of many curves
DASH_DOTTED = (0, (5, 1.5, 1, 1.5))


def cost_table(results: Results) -> pd.DataFrame:
    """Return median and quartiles of best and average costs, per condition and generation."""
    # references have no generations, and one row each
    beside: dict[str, Any] = {"quantity": REFERENCE, "generation": 0, "evaluations": 0.0}
    references = (
        _condition(results, c, None).iloc[:1].assign(**beside)
        for c in results.references
        if c not in results.evolved and np.isfinite(c.column("best_cost")).all()
    )
    parts = [_condition(results, condition, None) for condition in results.evolved]
    return pd.concat([*parts, *references], ignore_index=True)


def fitness_table(results: Results) -> pd.DataFrame:
    """Return the same columns as `cost_table`, with the fitness of the planner's objective."""
    parts = [_condition(results, c, c.planner.objective) for c in results.evolved]
    return pd.concat(parts, ignore_index=True)


def draw_cost(table: pd.DataFrame) -> Figure:
    """Draw best and average cost against generations."""
    figure, (axes,) = style.panels(3.4)
    beside = table["quantity"] == REFERENCE
    _curves(axes, table[~beside])
    for row in records(table[beside]):
        look: dict[str, Any] = {"color": style.condition_colour(row.position), "linewidth": 1.0}
        axes.axhline(row.median, linestyle=DASH_DOTTED, label=row.condition, **look)
    axes.set_ylabel("cost")
    style.legend_below(figure, [axes], 2)
    return figure


def draw_best(table: pd.DataFrame) -> Figure:
    """Draw medians of the best cost only, many curves without quartiles, named at their ends."""
    best = table[table["quantity"] == NAMES["best_cost"]].replace([np.inf, -np.inf], np.nan)
    across, curves = _across(best), list(groups(best, ["position", "condition"]))
    figure, (axes,) = style.panels(max(4.4, LINE * len(curves)))
    for k, ((_, condition), curve) in enumerate(curves):
        look = style.curve_look(k) | {"linewidth": 1.2}
        if len(curves) < marks.MANY:
            marks.band(axes, curve[across], curve["lower"], curve["upper"], look["color"])
        axes.plot(curve[across], curve["median"], label=f"{condition} ({_counts(curve)})", **look)
    limits = (0, max(1, int(best[across].max())))
    axes.set(xlim=limits, xlabel=across, ylabel="best cost so far (median)")
    style.shorten_thousands(axes.xaxis)
    name_curves(figure, axes, 3)
    return figure


def draw_fitness(table: pd.DataFrame) -> Figure:
    """Draw best and average fitness over the whole range, and the best fitness enlarged."""
    figure, (whole, close) = style.panels(4.1, 2)
    best = table[table["quantity"] == NAMES["best_cost"]]
    for axes, shown, title in ((whole, table, "a  whole range"), (close, best, "b  best fitness")):
        _curves(axes, shown)
        axes.set(ylabel="fitness F [-]", title=title)
    finite = best[np.isfinite(best[["median", "lower", "upper"]]).all(axis=1)]
    if len(finite):
        last = finite.groupby("position")["median"].max()
        near = float(last.min()) - 2.0 * (float(last.max() - last.min()) + 5.0)
        low, high = max(float(finite["lower"].min()), near), float(finite["upper"].max())
        close.set_ylim(low - 0.05 * (high - low) - 0.5, high + 0.05 * (high - low) + 0.5)
    style.legend_below(figure, [whole], 2)
    return figure


@table_of("condition position quantity generation evaluations median lower upper replicates")
def _condition(results: Results, condition: ConditionResults, objective: Any) -> Rows:
    for column in COLUMNS:
        rows = condition.generations[["replicate", "index", "evaluations", column]]
        if objective is not None:
            rows = rows.assign(**{column: objective.fitness(rows[column].to_numpy())})
        wide = rows.pivot(index="index", columns="replicate", values=column)
        replicates = rows.groupby("index").size().to_numpy()
        if column == "best_cost":  # a run that has ended keeps its best
            wide, replicates = wide.ffill(), np.full(len(wide), wide.shape[1])
        quartiles = quantiles(wide.to_numpy(np.float64), (0.5, 0.25, 0.75))
        spent = rows.pivot(index="index", columns="replicate", values="evaluations")
        (evaluations,) = quantiles(spent.to_numpy(np.float64), (0.5,))
        curve = condition.label, results.position(condition.label), NAMES[column]
        yield *curve, wide.index, evaluations, *quartiles, replicates


def _curves(axes: Axes, table: pd.DataFrame) -> None:
    across = _across(table)
    for (position, condition), rows in groups(table, ["position", "condition"]):
        colour = style.condition_colour(position)
        for column in COLUMNS:
            curve = rows[rows["quantity"] == NAMES[column]].replace([np.inf, -np.inf], np.nan)
            if curve.empty:
                continue
            kind = "-" if column == "best_cost" else (0, (3, 1.5))
            label = f"{condition}, {NAMES[column]} ({_counts(curve)})"
            marks.band(axes, curve[across], curve["lower"], curve["upper"], colour)
            axes.plot(curve[across], curve["median"], linestyle=kind, color=colour, label=label)
    axes.set(xlim=(0, max(1, int(table[across].max()))), xlabel=across)
    # evaluations as a second scale above
    steps = table.groupby("generation")["evaluations"].first()
    if across != "generation" or len(steps) < 2:
        return
    slope = float(steps.iloc[-1] - steps.iloc[0]) / float(steps.index[-1] - steps.index[0])
    offset = float(steps.iloc[0])

    above = axes.secondary_xaxis(
        "top",
        functions=(
            lambda generation: offset + slope * np.asarray(generation, dtype=np.float64),
            lambda evaluations: (np.asarray(evaluations, dtype=np.float64) - offset) / slope,
        ),
    )
    above.set_xlabel("evaluations")
    above.xaxis.set_major_locator(style.few_ticks())


def _across(table: pd.DataFrame) -> str:
    """Return the common axis: generations if they cost all conditions the same, or evaluations."""
    spent = table.groupby("generation")["evaluations"].nunique()
    return "generation" if spent.max() == 1 else "evaluations"


def _counts(curve: pd.DataFrame) -> str:
    low, high = int(curve["replicates"].min()), int(curve["replicates"].max())
    return f"n = {low}" if low == high else f"n = {low}…{high}"


PER_LINE = 3  # panels side by side
LUMINANCE = (0.2126, 0.7152, 0.0722)  # of red, green and blue (ITU-R BT.709)
DARK = 0.46  # [-] luminance below which a cell is dark
SETTLED = 0.05  # [-] of a run, after which the panels show all costs
ORDINAL, PALEST = "viridis", 0.8  # colours of values that have an order, the palest to be read


@table_of("panel x y column row median lower upper runs x_setting y_setting")
def grid_table(sweep: Sweep, values: Values) -> Rows:
    """Return median and quartiles of a quantity of each combination."""
    last = len(sweep.settings) - 1
    across, up = sweep.settings[last], sweep.settings[last - 1] if last else ""
    levels = [sweep.levels(k) for k in range(len(sweep.settings))]
    for each in sweep.conditions:
        if not each.results.done:
            continue
        own = values(each.results)
        before = labelled(sweep, each.values[: max(last - 1, 0)])
        panel = ", ".join(word for word in (each.base, before) if word)
        x, y = each.values[last], each.values[last - 1] if last else ""
        row = levels[last - 1].index(y) if last else 0
        spread = (quantile(own, share) for share in (0.5, 0.25, 0.75))
        yield panel, x, y, levels[last].index(x), row, *spread, len(own), across, up


def draw_grid(table: pd.DataFrame, name: str) -> Figure:
    """Draw a heat map of medians per panel, or, where one setting is swept, a curve."""
    return _draw_curves(table, name) if (table["y"] == "").all() else _draw_maps(table, name)


def _draw_maps(table: pd.DataFrame, name: str) -> Figure:
    panels = list(groups(table, "panel", in_order=False))[:MOST_PANELS]
    rows = int(table["row"].max()) + 1
    figure, axes_of = style.panels(0.42 * rows + 1.15, len(panels), PER_LINE, 0.0)
    finite = table.loc[np.isfinite(table["median"]), "median"]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    image = None
    for axes, (panel, own) in zip(axes_of, panels, strict=True):
        cells = own.pivot(index="row", columns="column", values="median")
        cells = cells.reindex(index=range(rows), columns=range(int(table["column"].max()) + 1))
        shown = cells.to_numpy(np.float64)
        finite_cells = np.where(np.isfinite(shown), shown, np.nan)
        limits: dict[str, Any] = {"vmin": low, "vmax": high if high > low else low + 1.0}
        image = axes.imshow(finite_cells, cmap="viridis_r", aspect="auto", **limits)
        for cell in records(own):  # the median, white in dark cells
            known = bool(np.isfinite(cell.median))
            text = f"{cell.median:.4g}" if known else "∞"
            is_dark = known and np.dot(LUMINANCE, image.to_rgba(cell.median)[:3]) < DARK
            look: dict[str, Any] = {"color": "white" if is_dark else "black", "fontsize": 7.5}
            axes.annotate(text, (cell.column, cell.row), ha="center", va="center", **look)
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


def _draw_curves(table: pd.DataFrame, name: str) -> Figure:
    figure, (axes,) = style.panels(3.2)
    ends = []
    for k, (panel, rows) in enumerate(groups(table, "panel", in_order=False)):
        finite = rows.replace([np.inf, -np.inf], np.nan).dropna(subset=["median", "lower", "upper"])
        own = finite.sort_values("column")
        if own.empty:
            continue
        colour, last = style.condition_colour(k), own.iloc[-1]
        marks.band(axes, own["column"], own["lower"], own["upper"], colour)
        axes.plot(own["column"], own["median"], color=colour, marker="o", ms=4)
        ends.append((float(last["column"]), float(last["median"]), panel, colour))
    ticks = table.drop_duplicates("column").sort_values("column")
    axes.set_xticks(ticks["column"], ticks["x"])
    axes.margins(x=0.05)
    axes.set(xlabel=table["x_setting"].iloc[0], ylabel=f"{name} (median, quartiles)")
    if table["panel"].any():
        name_ends(axes, ends)
    return figure


def draw_effects(table: pd.DataFrame) -> Figure:
    """Draw the median differences with their intervals, one panel per swept condition."""
    bases = list(groups(table, "base", in_order=False))[:MOST_PANELS]
    rows = max(len(own) for _, own in bases)
    figure, panels = style.panels(0.26 * rows + 1.0, len(bases), PER_LINE, 0.0)
    for axes, (base, rows_of_base) in zip(panels, bases, strict=True):
        own = rows_of_base.reset_index(drop=True)
        finite = own[np.isfinite(own[["difference", "low", "high"]]).all(axis=1)]
        errors = [finite["difference"] - finite["low"], finite["high"] - finite["difference"]]
        look: dict[str, Any] = {"fmt": "o", "ms": 4, "capsize": 2.0, "color": style.NEUTRAL}
        axes.errorbar(finite["difference"], finite.index, xerr=errors, **look)
        marks.dashed(axes, 0.0)
        names = [f"{r.setting}: {r.first} → {r.other}" for r in records(own)]
        axes.set_yticks(range(len(own)), names if style.begins_line(axes) else [])
        axes.set(title=base, xlabel="change of the cost", ylim=(len(own) - 0.5, -0.5))
        axes.xaxis.set_major_locator(style.few_ticks())
    return figure


def facets_table(results: Results, sweep: Sweep) -> pd.DataFrame:
    """Return the best cost so far of each combination."""
    table = cost_table(results)
    best = table[table["quantity"] == NAMES["best_cost"]]
    of = {each.results.label: each for each in sweep.conditions}
    levels = sweep.levels(len(sweep.settings) - 1)
    best = best[best["condition"].isin(of.keys())]
    swept = [of[label] for label in best["condition"]]
    return best.assign(
        base=[each.base for each in swept],
        facet=[labelled(sweep, each.values[:-1]) for each in swept],
        setting=sweep.settings[-1],
        value=[each.values[-1] for each in swept],
        level=[levels.index(each.values[-1]) for each in swept],
    )


def draw_facets(table: pd.DataFrame) -> Figure:
    """Draw the panels, those of one condition in one scale; values stand at the ends of curves."""
    shown = table.replace([np.inf, -np.inf], np.nan)
    panels = list(dict.fromkeys(zip(shown["base"], shown["facet"], strict=True)))[:MOST_PANELS]
    beside = len({facet for _, facet in panels})
    per_line = beside if 1 < beside <= PER_LINE else min(PER_LINE, len(panels))
    figure, axes_of = style.panels(2.35, len(panels), per_line, 0.3)
    count = int(shown["level"].max()) + 1
    colours = [mpl.colors.to_hex(c) for c in mpl.colormaps[ORDINAL](np.linspace(0, PALEST, count))]
    for axes, (base, facet) in zip(axes_of, panels, strict=True):
        of_base = shown[shown["base"] == base]
        own, ends = of_base[of_base["facet"] == facet], []
        for level, curve in groups(own, "level"):
            across, last = curve["evaluations"], curve.iloc[-1]
            marks.band(axes, across, curve["lower"], curve["upper"], colours[level])
            axes.plot(across, curve["median"], color=colours[level], linewidth=1.1)
            place = float(last["evaluations"]), float(last["median"])
            ends.append((*place, str(last["value"]), colours[level]))
        # costs but for the first ones, which are far above the others
        settled = of_base[of_base["generation"] >= SETTLED * of_base["generation"].max()]
        low, high = settled["lower"].min(), settled["upper"].max()
        low, high = (low, high) if low <= high else (0.0, 1.0)
        room, most = 0.05 * (high - low) or 1.0, float(of_base["evaluations"].max())
        axes.set(xlim=(0.0, most), ylim=(low - room, high + room))
        axes.set_title("\n".join(word for word in (base, facet) if word))
        axes.set_xlabel("evaluations")
        axes.set_ylabel("best cost so far" if style.begins_line(axes) else "")
        axes.xaxis.set_major_locator(style.few_ticks())
        style.shorten_thousands(axes.xaxis)
        name_ends(axes, ends)
    setting = table["setting"].iloc[0]
    style.keys_below(
        figure, [style.key(f"medians, quartiles; at the ends of curves: {setting}", lw=0)]
    )
    return figure


HIGHEST = 1.5  # score at the top of a panel, in that of the experiment as it is
ORDERS = 30.0  # ratio of the ends of an axis from which on it is logarithmic
TRIAL = "trial"  # the axis of the first panel; the others are settings


@table_of("axis importance trial value score best proven runs queries")
def trials_table(trials: pd.DataFrame, importance: Mapping[str, float]) -> Rows:
    """Yield every trial over its number, and over each setting."""
    numbers = ("score", "best", "proven", "runs", "queries")
    for axis in (str(name) for name in trials if name not in numbers):
        for trial in trials.to_dict("records"):
            own = importance.get(axis, np.nan), trial[TRIAL], str(trial[axis])
            yield axis, *own, *(trial[name] for name in numbers)


def draw_trials(table: pd.DataFrame) -> Figure:
    """Draw the score of each trial over its number and over each setting; later ones darker."""
    names = list(table["axis"].unique())[:MOST_PANELS]
    figure, panels = style.panels(2.3, len(names), PER_LINE, 0.3, sharey=True)
    own, count = float(table["score"].iloc[0]), int(table["trial"].max())
    for axes, name in zip(panels, names, strict=True):
        trials = table[table["axis"] == name]
        if name == TRIAL:
            axes.step(trials["trial"], trials["best"], where="post", label="best so far")
            axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
        trials = trials[trials["trial"] > 0]
        places = pd.to_numeric(trials["value"], errors="coerce")
        if places.isna().any():  # words
            words = sorted(trials["value"].unique())
            places = trials["value"].map({word: k for k, word in enumerate(words)})
            axes.set_xticks(range(len(words)), words)
            axes.margins(x=0.2)
        elif places.min() > 0.0 and places.max() > ORDERS * places.min():
            axes.set_xscale("log")
        for is_above, marker in ((False, "o"), (True, "^")):
            rows = (trials["score"] > HIGHEST * own) == is_above
            look: dict[str, Any] = {"c": trials["trial"][rows], "vmin": -count / 2, "vmax": count}
            look |= {"cmap": "Blues", "edgecolors": style.NEUTRAL, "linewidths": 0.4, "zorder": 2}
            scores = trials["score"][rows].clip(upper=HIGHEST * own)
            axes.scatter(places[rows], scores, marker=marker, s=18, **look)
        axes.axhline(own, color="black", ls="--", lw=0.8, label="the experiment as it is")
        share = trials["importance"].iloc[0] if len(trials) else np.nan
        axes.set_title("" if np.isnan(share) else f"importance {share:.2f}", fontweight="normal")
        axes.set(xlabel=name, ylabel="score" if style.begins_line(axes) else "")
    style.legend_below(figure, panels, 2)
    return figure
