"""Pieces of a page in Markdown."""

import math
from collections.abc import Iterable, Sequence

from evoexp.report.statistics import Interval, Spread


def table(headers: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; bars inside of cells are escaped."""
    lines = [_row(headers), _row(["---"] * len(headers)), *(_row(row) for row in rows)]
    return "\n".join(lines) + "\n"


def number(value: float) -> str:
    """Return a number with four significant digits, whole ones with all digits, NaN as a dash."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    whole = value == round(value) and abs(value) < 1e9
    return (f"{value + 0.0:.0f}" if whole else f"{value:.4g}").replace("-", "−")  # −0.0 is 0


def p_value(p: float) -> str:
    """Return a p-value with two significant digits."""
    return f"{p:.2g}" if p >= 1e-4 else f"{p:.1e}".replace("-", "−")


def share(count: int, total: int) -> str:
    """Return a count of a total."""
    return f"{count} of {total}"


def percent(interval: Interval) -> str:
    """Return an interval of a proportion in percent."""
    return f"{100 * interval.low:.0f}–{100 * interval.high:.0f} %"


def spread(values: Spread) -> str:
    """Return a median with its quartiles; a single value as it is."""
    if not values.num_values:
        return "–"
    if values.num_values == 1:
        return number(values.median)
    return f"{number(values.median)} [{number(values.lower)}, {number(values.upper)}]"


def _row(cells: Sequence[object]) -> str:
    return (
        "| " + " | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"
    )
