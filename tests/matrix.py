"""Parameters of tests: some always, all with ./scripts/test --all."""

import os
from collections.abc import Callable, Iterable
from typing import Any

import pytest


def examples(values: Iterable[Any], always: Callable[[Any], bool]) -> list[Any]:
    """Return values as parameters; those that are not for always are marked `matrix`.

    Args:
        values: What `parametrize` takes.
        always: Which of them run without --all.
    """
    found = []
    for value in values:
        given = value if isinstance(value, tuple) else (value,)
        found.append(pytest.param(*given, marks=() if always(value) else pytest.mark.matrix))
    return found


def first(count: int, values: Iterable[Any]) -> list[Any]:
    """Return values as parameters; all but the first `count` run with --all only."""
    known = list(values)
    early = known[:count]
    return examples(known, lambda value: any(value is one for one in early))


def counts(few: int, many: int) -> int:
    """Return the number of cases of a test: many with ./scripts/test --exhaustive, else few."""
    return many if "EVOEXP_EXHAUSTIVE" in os.environ else few
