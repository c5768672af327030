"""Figures: from results to a tidy table, from that table to a matplotlib Figure; no file access.

The columns of each table stand in `page.yaml`, with its figure. Here are the small steps over tidy
tables that they share.
"""

from collections.abc import Iterator
from typing import Any

import pandas as pd

# of coordinates and distances; rounding errors beside 0 would differ between machines
DECIMALS = 12


def records(table: pd.DataFrame) -> Iterator[Any]:
    """Yield rows with their columns as attributes."""
    yield from table.itertuples(index=False)


def groups(table: pd.DataFrame, by: str | list[str]) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Yield (key, rows) in the order of the keys."""
    yield from table.groupby(by, sort=True)


def rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table with its floats rounded, and without negative zeros."""
    numbers = table.select_dtypes("float64").columns
    return table.assign(**{str(name): table[name].round(DECIMALS) + 0.0 for name in numbers})
