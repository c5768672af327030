"""Items that are worked on in copies of this process."""

import gc
import os

import pytest

from evoexp.report.drawing_processes import on_all_cores


def test_results_come_in_order_whichever_process_made_them() -> None:
    assert on_all_cores(lambda k: k * k, range(20)) == [k * k for k in range(20)]


def test_an_item_whose_copy_died_is_done_here() -> None:
    here = os.getpid()

    def square(k: int) -> int:
        if os.getpid() != here:
            os._exit(1)
        return k * k

    assert on_all_cores(square, range(8)) == [k * k for k in range(8)]


@pytest.mark.parametrize("enabled", [True, False])
def test_the_collector_of_garbage_is_left_as_it_was(enabled: bool) -> None:
    def refuse(k: int) -> int:
        raise ValueError(f"item {k}, collector {gc.isenabled()}")

    before = gc.isenabled()
    try:
        (gc.enable if enabled else gc.disable)()
        with pytest.raises(ValueError, match="collector False"):
            on_all_cores(refuse, range(3))
        assert gc.isenabled() is enabled
        assert gc.get_freeze_count() == 0
    finally:
        (gc.enable if before else gc.disable)()
