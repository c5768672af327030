"""Ours and a reference in turns, in processor time.

The clock speed of a shared machine changes during a run, their ratio hardly does; and how long a
process waits for others is no property of either.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

import pytest

Work = Callable[[], object]
Reference = Work | tuple[Work, float, int]  # a function, units of work of a call, calls a round


@pytest.fixture
def beside(benchmark: Any) -> Callable[..., None]:
    """Return a function that times `ours` and, before each of its rounds, the references."""

    def measure(
        work: str,  # with its size; a row of the table that `scripts/benchmark` prints
        ours: Work,  # called `repeat` times a round; does `amount` units of work
        references: dict[str, Reference],  # alone: one call does `amount` units of work
        unit: str,  # of work
        amount: float = 1.0,
        repeat: int = 1,
        rounds: int = 50,
    ) -> None:
        whole = {k: r if isinstance(r, tuple) else (r, amount, 1) for k, r in references.items()}
        seconds: dict[str, list[float]] = {name: [] for name in whole}

        def time_references() -> None:
            for name, (reference, units, calls) in whole.items():
                begin = time.process_time()
                for _ in range(calls):
                    reference()
                seconds[name].append((time.process_time() - begin) / (calls * units))

        def repeated() -> None:
            for _ in range(repeat):
                ours()

        ours()  # compiled
        benchmark.pedantic(
            repeated, setup=time_references, rounds=rounds, iterations=1, warmup_rounds=1
        )
        each = [t / (repeat * amount) for t in benchmark.stats.stats.data]
        benchmark.group = benchmark.group or "ratios"
        rows = {name: compared(taken[-len(each) :], each) for name, taken in seconds.items()}
        own = {"work": work, "unit": unit, "ours": spread(each), "references": rows}
        benchmark.extra_info |= own

    return measure


def compared(theirs: list[float], ours: list[float]) -> dict[str, Any]:
    """Return times of a reference, and ratios with half of their interquartile range as noise."""
    ratios = [their / our for their, our in zip(theirs, ours, strict=True)]
    low, middle, high = statistics.quantiles(ratios, n=4)
    row = {"time": spread(theirs), "of_minima": min(theirs) / min(ours)}
    return row | {"median": statistics.median(ratios), "noise": (high - low) / (2.0 * middle)}


def spread(seconds: list[float]) -> dict[str, float]:
    """Return minimum and median."""
    return {"min": min(seconds), "median": statistics.median(seconds)}
