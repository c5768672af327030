"""The comparison of a benchmark's ratios with those that are kept."""

import json
import runpy
from pathlib import Path
from typing import Any

import pytest

RATIOS: dict[str, Any] = runpy.run_path(str(Path(__file__).parent / "benchmarks" / "ratios.py"))


def ratio(value: float, noise: float) -> dict[str, float]:
    return {"ratio": value, "noise": noise}


@pytest.mark.parametrize(
    ("now", "is_worse"),
    [
        (ratio(10.0, 0.01), False),
        (ratio(9.5, 0.01), False),  # within the noise of both
        (ratio(9.0, 0.01), True),
        (ratio(9.0, 0.05), False),  # as this run was noisy
        (ratio(20.0, 0.01), False),
    ],
)
def test_a_ratio_is_worse_beyond_the_noise_of_both_runs(
    now: dict[str, float], is_worse: bool
) -> None:
    lines = RATIOS["worse"]({"a | numpy": ratio(10.0, 0.01)}, {"a | numpy": now, "b | c": now})
    assert len(lines) == is_worse
    assert all("a | numpy" in line for line in lines)


def test_kept_ratios_are_of_benchmarks_that_have_a_noise() -> None:
    kept = json.loads((Path(__file__).parent / "benchmarks" / "ratios.json").read_text())
    assert kept["machine"]
    assert len(kept["ratios"]) >= 5
    assert all(row["ratio"] > 0.0 and row["noise"] >= 0.0 for row in kept["ratios"].values())
