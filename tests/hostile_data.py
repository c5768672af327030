"""Plain data that are changed at random, and attempts to use them."""

import copy
import random
from collections.abc import Callable, Iterator, Sequence
from functools import reduce
from operator import getitem
from typing import Any

from confinement import no_longer
from evoexp.errors import EvoexpError


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of every value in plain data."""
    if isinstance(value, list):
        value = dict(enumerate(value))
    for key, item in value.items() if isinstance(value, dict) else ():
        yield (*path, key)
        yield from places(item, (*path, key))


def at(data: Any, path: Sequence[Any]) -> Any:
    """Return the value at a place."""
    return reduce(getitem, path, data)


def mutated(data: Any, rng: random.Random, values: Sequence[Any]) -> Any:
    """Return data that are changed in one to three places, often to one of some values."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        known = list(places(data))
        if not known:
            return data
        path = rng.choice(known)
        node, last = at(data, path[:-1]), path[-1]
        match rng.randrange(10):
            case 0:
                del node[last]
            case 1 if isinstance(node, dict):
                node[rng.choice(("x", "", "_target_", "λ", f"{last}_"))] = rng.choice(values)
            case 2 if isinstance(node, list):
                node.extend(copy.deepcopy(node) * rng.choice((1, 3, 50)))
            case 3:
                node[last] = copy.deepcopy(at(data, rng.choice(known[: known.index(path) + 1])))
            case 4 if type(node[last]) in (int, float) and abs(node[last]) < 1e300:
                node[last] *= rng.choice((-1, 0, 2, 10, 1000, 10**6, 0.5, 1e-3, 1e-12))
            case _:
                node[last] = copy.deepcopy(rng.choice(values))
    return data


def refusal(attempt: Callable[[], object]) -> str:
    """Return the refusal of an attempt, which is one line; an empty text if it succeeds."""
    try:
        with no_longer():
            attempt()
    except EvoexpError as error:
        text = str(error)
        assert "\n" not in text and len(text) < 1500, text
        return text
    return ""
