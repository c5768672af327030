"""The messages of generations, many at a time.

All of them together take little more than half the time that they take one by one; a stretch of
generations, whose best changes rarely, takes half of that.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import orjson

from evoexp.records import Standing, Stretch
from evoexp.store.messages import TERM, flagged


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
    texts = [part for each in standings for part in _standing_texts(each)]
    numbers = orjson.dumps([*stretch.lowest, *stretch.means, *stretch.deviations]).decode()
    if "null" in numbers or any("null" in text for text in texts):  # a number is not finite
        return [orjson.dumps(flagged(row)) for row in _rows(stretch, links)]
    written = numbers[1:-1].split(",")
    fields = (
        written[:count],
        written[count : 2 * count],
        written[2 * count :],
        stretch.num_feasible,
        stretch.evaluations,
        stretch.collision_queries,
        links,
    )
    found: list[bytes] = []
    for begin, end, cost, rest in zip(
        [0, *ends], [*ends, count], texts[::2], texts[1::2], strict=True
    ):
        own = zip(*(field[begin:end] for field in fields), strict=True)
        found += [
            f'{{"index":{index},{cost},"best_cost_in_generation":{lowest},"mean_cost":{mean},'
            f'"std_cost":{deviation},"num_feasible":{num_feasible},"evaluations":{evaluations},'
            f'"collision_queries":{queries},{rest},"chain":"{link}"}}'.encode()
            for index, (lowest, mean, deviation, num_feasible, evaluations, queries, link) in (
                enumerate(own, stretch.first + begin)
            )
        ]
    return found


def _standing_texts(standing: Standing) -> tuple[str, str]:
    """Return the two pieces of a message that are the same while a solution is the best."""
    cost = orjson.dumps({"best_cost": standing.cost})
    terms = {TERM + name: float(standing.terms[name]) for name in sorted(standing.terms)}
    return cost[1:-1].decode(), orjson.dumps({"solved": standing.solved, **terms})[1:-1].decode()


def _rows(stretch: Stretch, links: Sequence[str]) -> list[dict[str, Any]]:
    """Return the rows of the generations of a stretch."""
    rows, standing, later = [], stretch.standings[0], stretch.standings[1:]
    columns = [(name, TERM + name) for name in sorted(standing.terms)]
    for k, link in enumerate(links):
        if later and later[0].place == k:
            standing, *later = later
        values = (
            stretch.first + k,
            standing.best,
            standing.cost,
            stretch.lowest[k],
            stretch.means[k],
            stretch.deviations[k],
            stretch.num_feasible[k],
            stretch.evaluations[k],
            stretch.collision_queries[k],
            standing.solved,
        )
        rows.append(generation_row(values, standing.terms, columns, link))
    return rows
