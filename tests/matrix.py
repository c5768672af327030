"""Parameters of tests: some always, all with ./scripts/test --all."""

import os
from collections.abc import Callable, Iterable
from typing import Any

import pytest

MATRICES = "EVOEXP_MATRICES"  # set where the matrices are asked for
EXHAUSTIVE = "EVOEXP_EXHAUSTIVE"  # set where larger counts are asked for


def matrices_are_asked_for() -> bool:
    """Whether tests marked `matrix` are collected: by an option, a marker or a test's name."""
    return MATRICES in os.environ


def examples(values: Iterable[Any], always: Callable[[Any], bool]) -> list[Any]:
    """Return values as parameters; those that are not `always` run are marked, or left out."""
    found = []
    for value in values:
        given, is_example = value if isinstance(value, tuple) else (value,), always(value)
        if is_example or matrices_are_asked_for():
            found.append(pytest.param(*given, marks=() if is_example else pytest.mark.matrix))
    return found


def first(count: int, values: Iterable[Any]) -> list[Any]:
    """Return values as parameters; all but the first `count` run with --all only."""
    known = list(values)
    early = known[:count]
    return examples(known, lambda value: any(value is one for one in early))


def num_cases(few: int, many: int) -> int:
    """Return the number of cases of a test: many with ./scripts/test --all, else few."""
    return many if matrices_are_asked_for() else few


def counts(few: int, many: int) -> int:
    """Return the number of cases of a test: many with ./scripts/test --exhaustive, else few."""
    return many if EXHAUSTIVE in os.environ else few
