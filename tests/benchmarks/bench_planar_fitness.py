"""The fitness of two planar arms, beside careful C with the vector sines of the C library."""

from typing import Any

import numpy as np
import pytest

from benchmarks import reference_planar_fitness as reference


@pytest.mark.skipif(reference.compiler() is None, reason="there is no C compiler")
@pytest.mark.parametrize("when", ["fresh", "finished"])
def bench_planar_fitness(beside: Any, when: str) -> None:
    """The kernel alone: lengths, unevenness, collisions at all instants and the cost."""
    one = reference.prepared(when)
    assert np.allclose(one.ours(), one.theirs(), rtol=0.0, atol=1e-9)
    assert np.array_equal(one.ours(), one.by_planner())
    beside(
        f"fitness of {reference.INDIVIDUALS} individuals, {reference.POINTS} instants, two arms of "
        f"{reference.CIRCLES} circles, {when}",
        one.ours,
        {"C, -O3 -march=native, vector sines": (one.theirs, reference.INDIVIDUALS, 20)},
        unit="individual",
        amount=reference.INDIVIDUALS,
        repeat=20,
        rounds=200,
    )
