"""The generations of a log as columns, without a record for each of them."""

import operator
from collections.abc import Collection, Iterable, Iterator
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from evoexp.records import GenerationRow
from evoexp.store.container import MAX_LOG, MAX_MESSAGE
from evoexp.store.log import GENERATION_TOPIC
from evoexp.store.log_reader import Source, indexed
from evoexp.store.messages import NONFINITE, TERM, field_types, restore

DTYPES: dict[Any, Any] = {int: np.int64, float: np.float64, bool: np.bool_}


def generation_columns(source: Source) -> dict[str, NDArray[Any]]:
    """Return the records on /generation, without their chain, as arrays (generations,) by name.

    A term that a generation does not have is NaN there.

    Raises:
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    with indexed(source) as (container, index):
        channel_id = index.channels[GENERATION_TOPIC].id
        messages = (m.data for m in container.messages() if m.channel_id == channel_id)
        parts = [_columns(orjson.loads(text)) for text in _joined(messages)]
        return parts[0] if len(parts) == 1 else _one_below_another(parts)


def _joined(messages: Iterable[bytes]) -> Iterator[bytes]:
    """Yield messages as JSON lists of about `MAX_MESSAGE` bytes, one list at least.

    Decoded, they take many times that: never all of them together.
    """
    size, found = 0, list[bytes]()
    for data in messages:
        if size > MAX_MESSAGE:
            yield b"[" + b",".join(found) + b"]"
            size, found = 0, []
        size += len(data)
        found.append(data)
    yield b"[" + b",".join(found) + b"]"


def _one_below_another(parts: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Return the columns of all parts, NaN where a part does not have one."""
    lengths = [len(part["index"]) for part in parts]
    own = list(_own_columns())
    names = own + sorted({name for part in parts for name in part} - set(own))
    _refuse_wide(names, sum(lengths))
    return {
        name: np.concatenate(
            [
                part[name] if name in part else np.full(length, np.nan)
                for part, length in zip(parts, lengths, strict=True)
            ]
        )
        for name in names
    }


def _own_columns() -> dict[str, Any]:
    """Return the columns that every generation has, and their kinds."""
    fields = field_types(GenerationRow).items()
    return {name: DTYPES[kind] for name, kind in fields if name != "chain"}


def _refuse_wide(names: Collection[str], num_rows: int) -> None:
    """Refuse rows that each have terms of their own: their table would be larger than any log."""
    if len(names) * num_rows * 8 > MAX_LOG:
        raise ValueError(f"{num_rows} generations with {len(names)} different terms")


def _columns(rows: list[dict[str, Any]]) -> dict[str, NDArray[Any]]:
    kinds = _own_columns()
    for row in rows:
        if NONFINITE in row:
            restore(row)
            del row[NONFINITE]
    names = rows[0].keys() if rows else set()
    if not all(row.keys() == names for row in rows):
        names = {name for row in rows for name in row}
        _refuse_wide(names, len(rows))
        absent = dict.fromkeys((name for name in names if name.startswith(TERM)), np.nan)
        rows = [absent | row for row in rows]
    kinds |= dict.fromkeys(sorted(name for name in names if name.startswith(TERM)), np.float64)
    values = (
        zip(*map(operator.itemgetter(*kinds), rows), strict=True) if rows else [()] * len(kinds)
    )
    return {
        name: np.array(column, dtype=kinds[name])
        for name, column in zip(kinds, values, strict=True)
    }
