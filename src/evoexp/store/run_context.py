"""Columns that say of every row of a run which run it is: experiment, label, seed, settings.

They are constant in a run, and make tables of many runs one table: SQL over
`runs/*/summary.parquet` groups by `population_size` without a join. No command reads them back.
"""

import json
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from evoexp.errors import StoreError
from evoexp.store.identity import CONFIG, MANIFEST, read_object

ORIGIN = ("experiment", "label", "budget")  # of the manifest
LONGEST = 200  # characters of a list
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_NO_SETTING = ("_target_", "revision", "sha256")


def run_context(path: Path, taken: Collection[str]) -> dict[str, Any]:
    """Collect the origin and the settings of a run.

    A setting has the last part of its name where no other setting and no column has it, else its
    whole dotted name: `population_size`, `planner.collision.revision`. Components are called by
    their group: `planner`, `robot`. Lists of plain values are JSON; other lists are left out.

    Args:
        path: The run's directory.
        taken: Columns that the table has already.

    Returns:
        Name → value; empty where neither configuration nor manifest can be read.
    """
    manifest, config = (_read(path / name) for name in (MANIFEST, CONFIG))
    found = {name: str(manifest[name]) for name in ORIGIN if manifest.get(name)}
    settings = dict(_settings(config))
    counts = Counter(name.rpartition(".")[2] for name in settings)
    for name, value in settings.items():
        short = name.rpartition(".")[2]
        free = counts[short] == 1 and short not in taken and short not in found
        column = short if free else name
        if column not in taken:
            found[column] = value
    return found


def with_context(table: pa.Table, context: Mapping[str, Any]) -> pa.Table:
    """Return a table with constant columns added at its end."""
    for name, value in context.items():
        table = table.append_column(name, _constant(value, table.num_rows))
    return table


def _read(path: Path) -> dict[str, Any]:
    try:
        return read_object(path)
    except StoreError:
        return {}


def _settings(config: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (dotted name, value) of the settings that a column can hold."""
    for key, value in config.items() if isinstance(config, Mapping) else ():
        dotted = f"{name}.{key}" if name else str(key)
        if not _PLAIN.fullmatch(str(key)) or key in _NO_SETTING:
            continue
        if isinstance(value, Mapping):
            if isinstance(value.get("_target_"), str):
                yield dotted, value["_target_"]
            yield from _settings(value, dotted)
        elif isinstance(value, bool | int | float | str):
            yield dotted, value
        elif isinstance(value, list):
            text = json.dumps(value)
            if len(text) <= LONGEST and "{" not in text:
                yield dotted, text


def _constant(value: Any, count: int) -> pa.Array:
    """Return a column of one value; `pa.array` would load pandas."""
    if isinstance(value, str):
        text = value.encode()
        ends = np.arange(count + 1, dtype=np.int32) * len(text)
        buffers = [None, pa.py_buffer(ends), pa.py_buffer(text * count)]
        return pa.Array.from_buffers(pa.string(), count, buffers)
    if isinstance(value, bool):
        bits = np.packbits(np.full(count, value), bitorder="little")
        return pa.Array.from_buffers(pa.bool_(), count, [None, pa.py_buffer(bits)])
    numbers = np.full(count, float(value))
    return pa.Array.from_buffers(pa.float64(), count, [None, pa.py_buffer(numbers)])
