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


@pytest.fixture
def beside(benchmark: Any) -> Callable[..., None]:
    """Return a function that times `ours` by pytest-benchmark and, before each of its rounds.

    The references.

    Its arguments:
        work: What is done, with its size; a row of the table that `scripts/benchmark` prints.
        ours: Called `repeat` times a round; does `amount` units of work.
        references: Name → (function, units of work that one call does, calls a round).
        unit: Of work.
        amount: See `ours`.
        repeat: See `ours`.
        rounds: Rounds.
    """

    def measure(
        work: str,
        ours: Work,
        references: dict[str, tuple[Work, float, int]],
        unit: str,
        amount: float = 1.0,
        repeat: int = 1,
        rounds: int = 50,
    ) -> None:
        seconds: dict[str, list[float]] = {name: [] for name in references}

        def time_references() -> None:
            for name, (reference, units, calls) in references.items():
                seconds[name].append(timed(reference, calls) / (calls * units))

        def repeated() -> None:
            for _ in range(repeat):
                ours()

        ours()  # compiled
        benchmark.pedantic(
            repeated, setup=time_references, rounds=rounds, iterations=1, warmup_rounds=1
        )
        each = [t / (repeat * amount) for t in benchmark.stats.stats.data]
        benchmark.group = benchmark.group or "ratios"
        benchmark.extra_info |= {"work": work, "unit": unit, "ours": spread(each), "references": {}}
        for name, taken in seconds.items():
            taken = taken[-len(each) :]  # the warm-up's is not counted
            ratios = [theirs / mine for theirs, mine in zip(taken, each, strict=True)]
            row = {
                "time": spread(taken),
                "of_minima": min(taken) / min(each),
                "median": statistics.median(ratios),
                "noise": noise(ratios),
            }
            benchmark.extra_info["references"][name] = row

    return measure


def timed(work: Work, calls: int) -> float:
    """Return the processor time that some calls take [s]."""
    begin = time.process_time()
    for _ in range(calls):
        work()
    return time.process_time() - begin


def noise(ratios: list[float]) -> float:
    """Return half of the interquartile range of ratios, relative to their median."""
    low, middle, high = statistics.quantiles(ratios, n=4)
    return (high - low) / (2.0 * middle)


def spread(seconds: list[float]) -> dict[str, float]:
    """Return minimum and median."""
    return {"min": min(seconds), "median": statistics.median(seconds)}
