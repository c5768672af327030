"""Masking a log takes its times out, and nothing else."""

import math

from store_samples import generations, write

from masked_logs import TIMES, masked_log

CONTENT = write(generations(80)).content


def test_times_do_not_matter() -> None:
    other = write(generations(80), **dict.fromkeys(TIMES, 12345.678901234567)).content
    assert other != CONTENT
    assert masked_log(other) == masked_log(CONTENT)


def test_the_times_at_which_generations_were_logged_do_not_matter() -> None:
    other = write(generations(80), seconds=[1.5 * k for k in range(80)]).content
    assert other != CONTENT
    assert masked_log(other) == masked_log(CONTENT)


def test_numbers_of_generations_and_of_the_summary_do() -> None:
    nudged = math.nextafter(2.5, math.inf)
    assert masked_log(write(generations(80), clearance_at=nudged).content) != masked_log(CONTENT)
    assert masked_log(write(generations(80, seed=1)).content) != masked_log(CONTENT)
