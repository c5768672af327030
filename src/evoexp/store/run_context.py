"""Columns that say of every row of a run which run it is: experiment, label, seed, settings.

They make tables of many runs one table: SQL over `runs/*/summary.parquet` groups by
`population_size` without a join. No command reads them back.
"""

import json
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from evoexp.errors import StoreError
from evoexp.shipped import rows_of, shipped
from evoexp.store.identity import CONFIG, MANIFEST, read_object
from evoexp.store.manifest import leaves
from evoexp.store.run_directory import RunDirectory
from evoexp.validation import MOST_QUERIES, TARGET

ORIGIN = ("experiment", "label", "budget")
LONGEST = 200  # characters of a list
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def origin(manifest: Mapping[str, Any], condition_id: str) -> dict[str, Any]:
    """Return experiment, label and budget of a run, None if unknown; and whether it was `changed`.

    A shipped condition has the label and the budget of the shipped table, in the experiment that
    its manifest names if that has it: experiments share conditions.
    """
    notes = {name: manifest.get(name) or None for name in ORIGIN}
    experiment, label = notes["experiment"], notes["label"]
    rows = sorted(
        rows_of(condition_id),
        key=lambda row: (row.experiment != experiment, row.label != label),
    )
    labels = {row.label for row in shipped() if row.experiment == experiment}
    is_named = label is not None and label not in labels
    if rows and (rows[0].experiment == experiment or not is_named):
        return {**{name: getattr(rows[0], name) for name in ORIGIN}, "changed": False}
    budget = rows[0].budget if rows else notes["budget"]
    return {**notes, "budget": budget, "changed": bool(labels)}


def origin_of(run: RunDirectory) -> dict[str, Any]:
    """Return the `origin` of a stored run; of one whose manifest is lost by its hash alone."""
    return origin(run.manifest(), run.condition_id)


def run_context(path: Path, condition_id: str, taken: Collection[str]) -> dict[str, Any]:
    """Return name → value of the origin and the settings of a run, as far as they can be read.

    A setting has the last part of its name where no other setting and no column has it, else its
    name as it is typed: `population_size`, `collision.num_samples`. Components are called by their
    group: `planner`, `control`, `robot`. Lists of plain values are JSON; other lists are left out.
    """
    objects: dict[str, dict[str, Any]] = {MANIFEST: {}, CONFIG: {}}
    for name in objects:
        with suppress(StoreError):
            objects[name] = read_object(path / name)
    known = origin(objects[MANIFEST], condition_id)
    columns = {name: str(known[name]) for name in ORIGIN if known[name]}
    settings = dict(_settings(typed_parts(objects[CONFIG])))
    counts = Counter(name.rpartition(".")[2] for name in settings)
    for name, value in settings.items():
        short = name.rpartition(".")[2]
        is_free = counts[short] == 1 and short not in taken and short not in columns
        column = short if is_free else name
        if column not in taken:
            columns[column] = value
    return columns


def typed_parts(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts of a canonical form by the names under which their settings are typed.

    A planner's components come out of it (`ga`, `collision`), and a planner out of its control.
    """
    parts: dict[str, Any] = {}
    for name, component in settings.items():
        if isinstance(component, Mapping) and isinstance(component.get("planner"), Mapping):
            around = {key: value for key, value in component.items() if key != "planner"}
            parts |= {"control": around} | typed_parts({"planner": component["planner"]})
        elif name == "planner" and isinstance(component, Mapping):
            fields = component.items()
            inner = {
                k: value for k, value in fields if isinstance(value, Mapping) and TARGET in value
            }
            parts |= {"planner": {k: value for k, value in fields if k not in inner}} | inner
        elif name == MOST_QUERIES:
            parts["budget"] = {"collision_queries": component}
        else:
            parts[name] = component
    return parts


def _settings(config: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield (dotted name, value) of the settings that a column can hold."""
    for name, value in leaves(config):
        group, _, last = name.rpartition(".")
        dotted = group if last == TARGET else name  # a component is called by its group
        if isinstance(value, list):
            value = json.dumps(value)
            is_short = len(value) <= LONGEST and "{" not in value
        else:
            is_short = isinstance(value, bool | int | float | str)
        is_plain = all(map(_PLAIN.fullmatch, dotted.split(".")))
        if is_plain and is_short and last not in ("revision", "sha256"):
            yield dotted, value
