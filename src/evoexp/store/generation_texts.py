"""The messages of generations, many at a time.

All of them together take little more than half the time that they take one by one; a stretch of
generations, whose best changes rarely, takes half of that.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import repeat
from math import isfinite
from typing import Any, NamedTuple

import orjson

from evoexp.records import Standing, Stretch
from evoexp.store.messages import NONFINITE, TERM, flagged


def generation_row(
    values: Sequence[Any],
    terms: Mapping[str, Any],
    columns: Iterable[tuple[str, str]],
    chain: str,
) -> dict[str, Any]:
    """Return the recorded part of a generation as plain values, for `encode_generations`.

    Args:
        values: Of the fields of `Generation`, from `index` to `solved`.
        terms: Its terms.
        columns: (name, column) of every term, in the order of the columns.
        chain: Its link.
    """
    index, _, best, lowest, mean, std, num_feasible, evaluations, queries, solved = values
    row: dict[str, Any] = {
        "index": int(index),
        "best_cost": float(best),
        "best_cost_in_generation": float(lowest),
        "mean_cost": float(mean),
        "std_cost": float(std),
        "num_feasible": int(num_feasible),
        "evaluations": int(evaluations),
        "collision_queries": int(queries),
        "solved": bool(solved),
    }
    for name, column in columns:
        row[column] = float(terms[name])
    row["chain"] = chain
    return row


def encode_generations(rows: Sequence[dict[str, Any]]) -> list[bytes]:
    """Return the messages of generations.

    All rows together take little more than half the time that they take one by one.

    Args:
        rows: Of `generation_row`.
    """
    parts = orjson.dumps(rows)[2:-2].split(b"},{")
    if len(parts) != len(rows):  # a name of a term looks like the end of a row
        return [orjson.dumps(flagged(row)) for row in rows]
    return [
        orjson.dumps(flagged(row)) if b"null" in part else b"{%b}" % part  # is a number not finite?
        for part, row in zip(parts, rows, strict=True)
    ]


def encode_stretch(stretch: Stretch, links: Sequence[str]) -> list[bytes]:
    """Return the messages of a stretch: those that its generations have one by one.

    Args:
        stretch: The generations.
        links: Of the chain, one of each generation.
    """
    count, standings = len(links), stretch.standings
    ends = [standing.place for standing in standings[1:]]
    numbers = orjson.dumps([*stretch.lowest, *stretch.means, *stretch.deviations]).decode()
    written = numbers[1:-1].split(",")
    fields = (
        written[:count],
        written[count : 2 * count],
        written[2 * count :],
        stretch.num_feasible,
        stretch.evaluations,
        stretch.collision_queries,
        links,
        _flags_of_each(stretch) if "null" in numbers else repeat("", count),
    )
    own = zip(*fields, strict=True)
    found: list[bytes] = []
    for standing, begin, end in zip(standings, [0, *ends], [*ends, count], strict=True):
        cost, rest, flags, more_flags = _standing_texts(standing)
        found += [
            f'{{"index":{index},{cost},"best_cost_in_generation":{lowest},"mean_cost":{mean},'
            f'"std_cost":{deviation},"num_feasible":{num_feasible},"evaluations":{evaluations},'
            f'"collision_queries":{queries},{rest},"chain":"{link}"'
            f"{_nonfinite(flags + own_flags + more_flags)}}}".encode()
            for index, (
                lowest,
                mean,
                deviation,
                num_feasible,
                evaluations,
                queries,
                link,
                own_flags,
            ) in zip(range(stretch.first + begin, stretch.first + end), own, strict=False)
        ]
    return found


class _StandingTexts(NamedTuple):
    """The pieces of a message that are the same while a solution is the best."""

    cost: str
    rest: str  # from `solved` on
    flags: str  # of the cost, see `_flags`
    more_flags: str  # of the terms


def _standing_texts(standing: Standing) -> _StandingTexts:
    cost = {"best_cost": standing.cost}
    terms = {TERM + name: float(standing.terms[name]) for name in sorted(standing.terms)}
    cost_text = orjson.dumps(cost)[1:-1].decode()
    rest = orjson.dumps({"solved": standing.solved, **terms})[1:-1].decode()
    more_flags = _flags(terms) if "null" in rest else ""
    return _StandingTexts(cost_text, rest, _flags(cost) if "null" in cost_text else "", more_flags)


def _flags_of_each(stretch: Stretch) -> list[str]:
    """Return the flags of the numbers that every generation has for itself."""
    names = "best_cost_in_generation", "mean_cost", "std_cost"
    own = zip(stretch.lowest, stretch.means, stretch.deviations, strict=True)
    return [_flags(dict(zip(names, values, strict=True))) for values in own]


def _flags(row: Mapping[str, float]) -> str:
    """Return the numbers that are not finite as JSON, each with a comma behind it."""
    texts = {name: repr(float(value)) for name, value in row.items() if not isfinite(value)}
    return orjson.dumps(texts)[1:-1].decode() + "," if texts else ""


def _nonfinite(flags: str) -> str:
    """Return the end of a message, which names the numbers that are not finite."""
    return f',"{NONFINITE}":{{{flags[:-1]}}}' if flags else ""
