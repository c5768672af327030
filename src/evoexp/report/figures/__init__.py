"""Figures: from results to a tidy table, from that table to a matplotlib Figure; no file access.

The columns of each table stand in `page.yaml`, with its figure. Here are the small steps over tidy
tables that they share.
"""

import functools
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ParamSpec

import numpy as np
import pandas as pd

# of coordinates and distances; rounding errors beside 0 would differ between machines
DECIMALS = 12


Arguments = ParamSpec("Arguments")
# of a table, one by one; or columns of several rows at once, beside values that all of them have
Rows = Iterator[tuple[object, ...]]
Parts = Iterator[Mapping[str, Any]]  # of a table, one below the other: name → column


def table_of(
    names: str = "", *, is_rounded: bool = False
) -> Callable[[Callable[Arguments, Rows | Parts]], Callable[Arguments, pd.DataFrame]]:
    """Make a table of a function that yields `Rows`, with columns of these names, or `Parts`."""

    def made(yielding: Callable[Arguments, Rows | Parts]) -> Callable[Arguments, pd.DataFrame]:
        @functools.wraps(yielding)
        def table(*arguments: Arguments.args, **named: Arguments.kwargs) -> pd.DataFrame:
            rows: list[Any] = list(yielding(*arguments, **named))
            columns = names.split()
            if columns and not any(np.ndim(value) for row in rows[:1] for value in row):
                whole = pd.DataFrame(rows, columns=columns)
            else:
                parts = (dict(zip(columns, row, strict=True)) if columns else row for row in rows)
                whole = pd.concat(map(pd.DataFrame, parts), ignore_index=True)
            return rounded(whole) if is_rounded else whole

        return table

    return made


def records(table: pd.DataFrame) -> Iterator[Any]:
    """Yield rows with their columns as attributes."""
    yield from table.itertuples(index=False)


def groups(
    table: pd.DataFrame, by: str | list[str], *, in_order: bool = True
) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Yield (key, rows) in the order of the keys, or in that of their first rows."""
    yield from table.groupby(by, sort=in_order)


def rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table with its floats rounded, and without negative zeros."""
    numbers = table.select_dtypes("float64").columns
    return table.assign(**{str(name): table[name].round(DECIMALS) + 0.0 for name in numbers})
