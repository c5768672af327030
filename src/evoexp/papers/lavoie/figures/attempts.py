"""How many attempts runs take (Lavoie & Boudreau 2001, section 5)."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report import style
from evoexp.report.proportions import Proportion
from evoexp.report.results import Results
from evoexp.report.rows import groups


def attempts_table(results: Results, confidence: float) -> pd.DataFrame:
    """Return how many runs take 1, 2, … attempts.

    Returns:
        Columns position, condition, attempts, having, total, share, lower, upper (Wilson's
        interval), mean (of the condition's attempts).
    """
    rows: list[tuple[object, ...]] = []
    for c in results.with_data:
        attempts = c.column("term_attempts")
        for number in range(1, 1 + c.planner.num_attempts):
            found = Proportion(int(np.count_nonzero(attempts == number)), c.done)
            given = (
                results.position(c.label),
                c.label,
                number,
                *found,
                found.share,
                *found.interval(confidence),
            )
            rows.append((*given, float(attempts.mean())))
    names = [
        "position",
        "condition",
        "attempts",
        "having",
        "total",
        "share",
        "lower",
        "upper",
        "mean",
    ]
    return pd.DataFrame(rows, columns=names)


def draw_attempts(table: pd.DataFrame) -> Figure:
    """Draw one bar per number of attempts and arm, with intervals and counts."""
    figure = style.figure(2.9)
    axes = figure.subplots()
    positions = sorted(table["position"].unique())
    width = 0.8 / len(positions)
    for k, (position, rows) in enumerate(groups(table, "position")):
        x = rows["attempts"].to_numpy() + width * (k - 0.5 * (len(positions) - 1))
        colour = style.condition_colour(int(position))
        label = (
            f"{rows['condition'].iloc[0]} (n = {rows['total'].iloc[0]}, mean "
            f"{rows['mean'].iloc[0]:.2f})"
        )
        share, lower, upper = (
            100.0 * rows[name].to_numpy() for name in ("share", "lower", "upper")
        )
        axes.bar(x, share, width=width, color=colour, alpha=0.75, label=label)
        seen = share > 0.0
        axes.vlines(x[seen], lower[seen], upper[seen], color=style.NEUTRAL, linewidth=1.0)
        for at, height, count in zip(
            x[seen], upper[seen], rows["having"].to_numpy()[seen], strict=True
        ):
            place = (0, 2)
            axes.annotate(
                str(count),
                (at, height),
                xytext=place,
                textcoords="offset points",
                ha="center",
                fontsize=6.5,
            )
    axes.set_xticks(sorted(table["attempts"].unique()))
    axes.set_xlabel("attempts of SP1 → SP2")
    axes.set_ylabel("share of runs [%]")
    axes.grid(visible=False, axis="x")
    style.legend_below(figure, axes, 2)
    return figure
