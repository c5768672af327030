"""A reference has the same bits whatever number of threads linear algebra has."""

import pytest
import scipy.linalg  # noqa: F401  # loads the BLAS whose threads are counted
from threadpoolctl import threadpool_info, threadpool_limits

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.references.reference import one_thread
from masked_logs import masked_log

LABEL = "B platform, conventional"  # whose optimiser takes other steps with two threads


def num_threads() -> list[int]:
    return [each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"]


def test_threads_are_one_inside_and_as_before_outside() -> None:
    with threadpool_limits(2, "blas"):
        assert set(num_threads()) == {2}, "numpy and scipy have a BLAS each"
        with one_thread():
            assert set(num_threads()) == {1}
        assert set(num_threads()) == {2}


@pytest.mark.parametrize("threads", [1, 2])
def test_a_reference_beside_any_number_of_threads(threads: int) -> None:
    condition = composed("experiment=chen_placement", "budget=smoke", label=LABEL)
    plain = masked_log(run_replicate(condition, 0).content)
    with threadpool_limits(threads, "blas"):
        assert masked_log(run_replicate(condition, 0).content) == plain
