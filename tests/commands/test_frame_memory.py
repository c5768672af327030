"""Calls within a command share a piece of memory, however deep they are."""

import resource

import pytest

from evoexp.commands.frame_memory import called_in_one_piece

CALLS, DEPTHS = 400, 200  # a piece of CPython's own holds the frames of some 130 calls


def _sum(values: list[int]) -> int:
    """Add numbers in a frame that is larger than the one of `_page_faults`."""
    a, b, c, d, e, f, g, h, i, j, k, m, n, o, p, q = values
    return a + b + c + d + e + f + g + h + i + j + k + m + n + o + p + q


def _page_faults(depth: int) -> int:
    """Return how often the system gives memory while a function is called from some depth."""
    if depth > 0:
        return _page_faults(depth - 1)
    values = [1] * 16
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(CALLS):
        _sum(values)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


def test_no_depth_asks_the_system_for_memory_at_every_call() -> None:
    found = called_in_one_piece(lambda: [_page_faults(depth) for depth in range(DEPTHS)])
    assert max(found) < CALLS / 2


def test_results_and_errors_pass_through() -> None:
    assert called_in_one_piece(lambda: called_in_one_piece(lambda: 7)) == 7
    with pytest.raises(ZeroDivisionError):
        called_in_one_piece(lambda: 1 // 0)
