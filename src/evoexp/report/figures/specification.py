"""Specification curves: the number that decides a claim under every reading of the paper, sorted.

After Simonsohn, Simmons & Nelson 2020 (Nature Human Behaviour 4, 1208–1214); a reading's choice is
written beside its number.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report.figures import records, style
from evoexp.report.statistics.inference import spread
from evoexp.report.statistics.judging import CONTRADICTED, EQUAL, REPRODUCED

OTHERWISE = "undecided or not judged"
MARKS: dict[str, dict[str, Any]] = {
    REPRODUCED: {"marker": "o", "mfc": style.ARM_COLOURS[0], "mec": style.ARM_COLOURS[0]},
    EQUAL: {"marker": "s", "mfc": "white", "mec": style.ARM_COLOURS[0]},
    CONTRADICTED: {"marker": "X", "mfc": style.ARM_COLOURS[1], "mec": style.ARM_COLOURS[1]},
    OTHERWISE: {"marker": "o", "mfc": "white", "mec": style.FAINT},
}


def specification_table(judged: Sequence[Any], headline: Any) -> pd.DataFrame:
    """Return one row per reading of a headline claim, of `pages.readings.Judged`.

    Where a rule has no number that decides, the row holds median and quartiles of the quantity.
    """
    rows = []
    for one in judged:
        if one.headline is headline:
            size, name = one.claim.size, headline.quantity
            numbers: tuple[float, ...] = (*spread(headline.values(one.condition))[:3], np.nan)
            if size is not None:
                name, numbers = size.name, (size.value, size.low, size.high, size.neutral)
            reading, is_first = (
                one.family.reading(one.condition),
                one.condition is one.family.shipped,
            )
            family, verdict = one.family.shipped.label, one.claim.verdict
            rows.append((family, reading, is_first, name, *numbers, verdict))
    names = ["family", "reading", "default", "quantity", "value", "low", "high", "neutral"]
    return pd.DataFrame(rows, columns=[*names, "verdict"])


def draw_specification(table: pd.DataFrame) -> Figure:
    """Draw readings sorted by the number that decides, families one below the other.

    Args:
        table: Of `specification_table`; infinite values stand at the right edge, as "never".
    """
    numbers = table[["value", "low", "high", "neutral"]].to_numpy(np.float64)
    finite = numbers[np.isfinite(numbers)]
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 1.0)
    room = 0.08 * (high - low) or 0.5
    edge, families = high + room, list(dict.fromkeys(table["family"]))
    labels = dict[float, tuple[str, bool]]()  # place of a line → its label, whether it is bold
    place = 0.0
    figure, (axes,) = style.panels(0.2 * (len(table) + 1.5 * len(families)) + 1.2)
    for family in families:
        rows = table[table["family"] == family].sort_values(["value", "reading"], kind="stable")
        if len(families) > 1:
            labels[place] = f"{family}:", False
            place += 1.0
        first = place
        for row in records(rows):
            labels[place] = row.reading, row.default
            mark = MARKS.get(row.verdict, MARKS[OTHERWISE])
            ends = [min(end, edge) for end in (row.low, row.high)]
            axes.hlines(place, *ends, color=mark["mec"], linewidth=1.4)
            axes.plot(min(row.value, edge), place, zorder=3, ms=5, **mark)
            if not np.isfinite(row.value):
                beside: dict[str, Any] = {"xytext": (5, 0), "textcoords": "offset points"}
                axes.annotate("never", (edge, place), va="center", fontsize=6.5, **beside)
            place += 1.0
        neutral = rows["neutral"].iloc[0]
        if np.isfinite(neutral):
            lines: dict[str, Any] = {"color": style.FAINT, "ls": (0, (4, 2)), "lw": 0.9}
            axes.vlines(neutral, first - 0.5, place - 0.5, **lines)
        place += 0.5
    axes.set_xlim(low - room, edge + (0.25 * (edge - low) if np.isinf(numbers).any() else 0))
    axes.xaxis.set_major_locator(style.few_ticks())
    style.shorten_thousands(axes.xaxis)
    axes.set_xlabel(", ".join(dict.fromkeys(table["quantity"])))
    axes.set_yticks(list(labels), [label for label, _ in labels.values()])
    for tick, (_, is_bold) in zip(axes.get_yticklabels(), labels.values(), strict=True):
        tick.set_fontweight("bold" if is_bold else "normal")
    axes.set_ylim(place - 1.0, -0.6)
    entries = [style.key(label, ls="", ms=5, **look) for label, look in MARKS.items()]
    style.keys_below(figure, entries)
    return figure
