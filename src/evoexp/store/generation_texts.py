"""The messages of a block of generations: what the best so far tells is written once for each."""

from collections.abc import Mapping, Sequence
from itertools import repeat
from math import isfinite
from typing import NamedTuple

import orjson

from evoexp.records import Best, Block
from evoexp.store.messages import NONFINITE, TERM


def encode_block(block: Block, links: Sequence[str]) -> list[bytes]:
    """Return the messages of the generations of a block.

    Args:
        block: The generations.
        links: Of the chain, one of each generation.
    """
    count, bests = len(links), block.bests
    ends = [best.place for best in bests[1:]]
    floats = [*map(float, (*block.lowest, *block.means, *block.deviations))]
    numbers = orjson.dumps(floats).decode()
    written = numbers[1:-1].split(",")
    fields = (
        written[:count],
        written[count : 2 * count],
        written[2 * count :],
        map(int, block.num_feasible),
        map(int, block.evaluations),
        map(int, block.collision_queries),
        links,
        _flags_of_each(block) if "null" in numbers else repeat("", count),
    )
    own = zip(*fields, strict=True)
    found: list[bytes] = []
    for best, begin, end in zip(bests, [0, *ends], [*ends, count], strict=True):
        cost, rest, flags, more_flags = _best_texts(best)
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
            ) in zip(range(block.first + begin, block.first + end), own, strict=False)
        ]
    return found


class _BestTexts(NamedTuple):
    """The pieces of a message that are the same while a solution is the best."""

    cost: str
    rest: str  # from `solved` on
    flags: str  # of the cost, see `_flags`
    more_flags: str  # of the terms


def _best_texts(best: Best) -> _BestTexts:
    cost = {"best_cost": float(best.cost)}
    terms = {TERM + name: float(best.terms[name]) for name in sorted(best.terms)}
    cost_text = orjson.dumps(cost)[1:-1].decode()
    rest = orjson.dumps({"solved": bool(best.solved), **terms})[1:-1].decode()
    more_flags = _flags(terms) if "null" in rest else ""
    return _BestTexts(cost_text, rest, _flags(cost) if "null" in cost_text else "", more_flags)


def _flags_of_each(block: Block) -> list[str]:
    """Return the flags of the numbers that every generation has for itself."""
    names = "best_cost_in_generation", "mean_cost", "std_cost"
    own = zip(block.lowest, block.means, block.deviations, strict=True)
    return [_flags(dict(zip(names, values, strict=True))) for values in own]


def _flags(row: Mapping[str, float]) -> str:
    """Return the numbers that are not finite as JSON, each with a comma behind it."""
    texts = {name: repr(float(value)) for name, value in row.items() if not isfinite(value)}
    return orjson.dumps(texts)[1:-1].decode() + "," if texts else ""


def _nonfinite(flags: str) -> str:
    """Return the end of a message, which names the numbers that are not finite."""
    return f',"{NONFINITE}":{{{flags[:-1]}}}' if flags else ""
