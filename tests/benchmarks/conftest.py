"""Ours and a reference in turns.

The clock speed of a shared machine changes during a run, their ratio hardly does.
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
            }
            benchmark.extra_info["references"][name] = row

    return measure


def timed(work: Work, calls: int) -> float:
    """Return the seconds that some calls take."""
    begin = time.perf_counter()
    for _ in range(calls):
        work()
    return time.perf_counter() - begin


def spread(seconds: list[float]) -> dict[str, float]:
    """Return minimum and median."""
    return {"min": min(seconds), "median": statistics.median(seconds)}
