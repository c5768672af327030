"""How many attempts runs take (Lavoie & Boudreau 2001, section 5)."""

import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers import marks
from evoexp.report.kit import Results, counted, groups, records, style

NAMES = [
    *("position", "condition", "attempts", "having", "total"),
    *("share", "lower", "upper", "mean"),
]


def attempts_table(results: Results, confidence: float) -> pd.DataFrame:
    """Return how many runs take 1, 2, … attempts.

    Returns:
        Columns position, condition, attempts, having, total, share, lower, upper (Wilson's
        interval), mean (of the condition's attempts).
    """
    rows: list[tuple[object, ...]] = []
    for c in results.with_data:
        taken = c.column("term_attempts")
        for number in range(1, 1 + c.planner.num_attempts):
            found = counted(taken == number)
            share = *found, found.share, *found.interval(confidence)
            rows.append((results.position(c.label), c.label, number, *share, float(taken.mean())))
    return pd.DataFrame(rows, columns=NAMES)


def draw_attempts(table: pd.DataFrame) -> Figure:
    """Draw one bar per number of attempts and arm, with intervals and counts."""
    figure, (axes,) = style.row_of_panels(2.9, 1)
    count = table["position"].nunique()
    width = 0.8 / count
    for k, (position, rows) in enumerate(groups(table, "position")):
        first = rows.iloc[0]
        x = rows["attempts"].to_numpy() + width * (k - 0.5 * (count - 1))
        colour = style.condition_colour(int(position))
        label = f"{first['condition']} (n = {first['total']}, mean {first['mean']:.2f})"
        axes.bar(x, 100.0 * rows["share"], width=width, color=colour, alpha=0.75, label=label)
        seen = rows.assign(x=x)[rows["share"] > 0.0]
        lower, upper = 100.0 * seen["lower"], 100.0 * seen["upper"]
        axes.vlines(seen["x"], lower, upper, color=style.NEUTRAL, linewidth=1.0)
        for row in records(seen):
            marks.write(axes, str(row.having), (row.x, 100.0 * row.upper), (0, 2), fontsize=6.5)
    axes.set_xticks(sorted(table["attempts"].unique()))
    axes.set(xlabel="attempts of SP1 → SP2", ylabel="share of runs [%]")
    axes.grid(visible=False, axis="x")
    style.legend_below(figure, axes, 2)
    return figure
