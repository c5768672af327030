"""Records as JSON and back, flat and with a fixed order of keys.

A non-finite number, for which JSON has no word, is written as null and named in `nonfinite`, a key
that is there only when needed: `{"best_cost": "inf"}` for a field, `{"values": {"3": "nan"}}` for
an element of an array.
"""

from collections.abc import Mapping
from functools import cache
from math import isfinite
from sys import intern
from typing import Any, TypeVar, get_type_hints

import numpy as np
import orjson

from evoexp.records import (
    FloatArray,
    FrontRow,
    GenerationRow,
    ReplicateSummary,
    SolutionRow,
    flatten,
)

Row = TypeVar("Row", GenerationRow, SolutionRow, FrontRow, ReplicateSummary)
TERM = "term_"
NONFINITE = "nonfinite"

_JSON_TYPES: dict[Any, dict[str, Any]] = {
    int: {"type": "integer"},
    float: {"type": "number"},
    bool: {"type": "boolean"},
    str: {"type": "string"},
    FloatArray: {"type": "array", "items": {"type": "number"}},
}
_NUMBER = (int, float)
# what JSON may hold for a field of each type; true and false are ints to Python only
_TAKEN: dict[Any, Any] = {int: _NUMBER, float: _NUMBER, bool: bool, str: str, FloatArray: list}
_TAKEN |= {kind | None: (*_NUMBER, type(None)) for kind in _NUMBER} | {bool | None: bool | None}
_TRUTHS = (bool, bool | None)


@cache
def field_types(record: type) -> dict[str, Any]:
    """Return a record's fields and their types in order; `terms` become a field each."""
    return {name: kind for name, kind in get_type_hints(record).items() if name != "terms"}


@cache
def json_schema(record: type, terms: tuple[str, ...] = ()) -> bytes:
    """Return the JSON Schema of a record's messages, one type per field, as Foxglove reads it.

    Any number may be null, which JSON Schema could only say with a union type.
    """
    properties = {name: _JSON_TYPES[kind] for name, kind in field_types(record).items()}
    if record is FrontRow:  # a matrix travels flat
        properties["num_criteria"] = _JSON_TYPES[int]
    properties.update({TERM + name: _JSON_TYPES[float] for name in sorted(terms)})
    title = f"evoexp.{record.__name__.removesuffix('Row')}"
    return orjson.dumps({"title": title, "type": "object", "properties": properties})


def encode_generation(row: GenerationRow) -> bytes:
    """Return the message of one generation; its terms stand in alphabetical order."""
    values = {name: kind(getattr(row, name)) for name, kind in field_types(GenerationRow).items()}
    chain = values.pop("chain")
    terms = {TERM + name: float(row.terms[name]) for name in sorted(row.terms)}
    return encode({**values, **terms, "chain": chain})


def encode_summary(summary: ReplicateSummary) -> dict[str, str]:
    """Return the summary as metadata: every value one JSON text, terms in alphabetical order."""
    row = flatten(summary._replace(terms=dict(sorted(summary.terms.items()))))
    return encode_values(flagged(row))


def encode_values(values: Mapping[str, Any]) -> dict[str, str]:
    """Return a mapping as metadata: every value one JSON text."""
    options = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_SORT_KEYS
    return {name: orjson.dumps(value, option=options).decode() for name, value in values.items()}


def decode_values(metadata: Mapping[str, str]) -> dict[str, Any]:
    """Undo `encode_values`."""
    return {name: orjson.loads(text) for name, text in metadata.items()}


def decode_environment(metadata: Mapping[str, str]) -> dict[str, Any]:
    """Undo `encode_values` of an environment, whose sections are mappings."""
    environment = decode_values(metadata)
    for section in ("versions", "platform", "cpu", "components"):
        if not isinstance(environment.get(section, {}), dict):
            raise ValueError(f"{section} is {str(environment[section])[:40]!r}")
    return environment


def decode(record: type[Row], row: dict[str, Any]) -> Row:
    """Build a record from the decoded JSON of its message, or raise an error if it is none.

    Keys that are no field of the record are left out.
    """
    if NONFINITE in row:
        restore(row)
    fields: dict[str, Any] = {}
    kinds: Any = record
    for name, kind in field_types(kinds).items():
        value = row[name] if name in row else record._field_defaults[name]
        if not isinstance(value, _TAKEN[kind]) or (value is True or value is False) is not (
            kind in _TRUTHS and value is not None
        ):
            raise ValueError(f"{name} is {str(value)[:40]!r}")
        if kind is float or kind is int:
            value = kind(value)
        elif kind == FloatArray:
            value = np.array(value, dtype=np.float64)
            if value.ndim != 1:
                raise ValueError(f"{name} is no list of numbers")
        fields[name] = value
    if "terms" in record._fields:
        fields["terms"] = {
            intern(name[5:]): float(value) for name, value in row.items() if name[:5] == TERM
        }
    if record is FrontRow:  # a matrix travels flat
        fields["criteria"] = fields["criteria"].reshape(-1, row["num_criteria"])
    return record(**fields)


def encode(row: dict[str, Any]) -> bytes:
    """Return a message; numbers are Python's, arrays flat."""
    text = orjson.dumps(row, option=orjson.OPT_SERIALIZE_NUMPY)
    if b"null" in text:  # a number is not finite
        return orjson.dumps(flagged(row), option=orjson.OPT_SERIALIZE_NUMPY)
    return text


def flagged(row: dict[str, Any]) -> dict[str, Any]:
    """Return the row with `nonfinite` appended where a number of it needs the flag."""
    flags: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, np.ndarray):
            places = np.flatnonzero(~np.isfinite(value))
            if places.size:
                flags[name] = {str(place): repr(float(value[place])) for place in places.tolist()}
        elif isinstance(value, float) and not isfinite(value):
            flags[name] = repr(float(value))
    return {**row, NONFINITE: flags} if flags else row


def restore(row: dict[str, Any]) -> None:
    """Put the non-finite numbers of a decoded row that has the flag back in place."""
    for name, flag in row[NONFINITE].items():
        if isinstance(flag, str):
            row[name] = float(flag)
        else:
            for index, element in flag.items():
                row[name][int(index)] = float(element)
