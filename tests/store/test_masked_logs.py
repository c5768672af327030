"""Masking a log takes its times out, and nothing else."""

import math

import pytest
from store_samples import generations, summary, write

from evoexp.records import ReplicateSummary
from masked_logs import TIMES, masked_log

CONTENT = write(generations(80)).content
# of condition and replicate, a log refuses others; the digest is its own
OTHERS = [
    f for f in ReplicateSummary._fields if f not in (*TIMES, "condition", "replicate", "digest")
]


@pytest.mark.parametrize("seconds", [0.0, 1e-9, 12345.678901234567])
@pytest.mark.parametrize("name", TIMES)
def test_times_do_not_matter(name: str, seconds: float) -> None:
    other = write(generations(80), **{name: seconds}).content
    assert other != CONTENT
    assert masked_log(other) == masked_log(CONTENT)


@pytest.mark.parametrize("name", OTHERS)
def test_everything_else_of_the_summary_does(name: str) -> None:
    value = getattr(summary(), name)
    nudged: object = {"x": 1.0} if name == "terms" else f"{value}x"
    if isinstance(value, float):
        nudged = 0.0 if math.isnan(value) or math.isinf(value) else math.nextafter(value, math.inf)
    elif value is None or isinstance(value, int):
        nudged = 1 if value in (None, 0) else not value if value is True else value + 1
    assert masked_log(write(generations(80), **{name: nudged}).content) != masked_log(CONTENT)


def test_the_times_at_which_generations_were_logged_do_not_matter() -> None:
    other = write(generations(80), seconds=[1.5 * k for k in range(80)]).content
    assert other != CONTENT
    assert masked_log(other) == masked_log(CONTENT)


def test_generations_do() -> None:
    assert masked_log(write(generations(80, seed=1)).content) != masked_log(CONTENT)
