"""Items that are worked on in copies of this process."""

import gc
import os
import time
from pathlib import Path

import joblib
import pytest

from evoexp.report.drawing_processes import each_on_all_cores, on_all_cores
from evoexp.store.files import write_files


def test_results_come_in_order_whichever_process_made_them() -> None:
    assert on_all_cores(lambda k: k * k, range(20)) == [k * k for k in range(20)]


def test_an_item_whose_copy_died_is_done_here() -> None:
    here = os.getpid()

    def square(k: int) -> int:
        if os.getpid() != here:
            os._exit(1)
        return k * k

    assert on_all_cores(square, range(8)) == [k * k for k in range(8)]


@pytest.fixture
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joblib, "cpu_count", lambda: 2)


def test_items_share_the_cores_with_their_own_items(two_cores: None) -> None:
    def part(k: int) -> tuple[int, int]:
        time.sleep(0.01)
        return k, os.getpid()

    def whole(size: int) -> tuple[int, list[int]]:
        parts = on_all_cores(part, range(size))
        assert [k for k, _ in parts] == list(range(size))
        return os.getpid(), sorted({process for _, process in parts})

    *first, last = (list(each_on_all_cores(whole, [4, 4, 40]))[k] for k in range(3))
    assert all(processes == [own] for own, processes in map(tuple, first))
    own, processes = last
    assert own in processes
    assert len(processes) == 2, "the copy that was left alone with the longest has made one, too"


def test_an_error_of_one_keeps_the_results_of_the_others(two_cores: None) -> None:
    def inverse(k: int) -> float:
        return 1.0 / k

    one, error, half, quarter = each_on_all_cores(inverse, [1, 0, 2, 4])
    assert (one, half, quarter) == (1.0, 0.5, 0.25)
    assert isinstance(error, ZeroDivisionError)


def test_results_that_are_not_taken_end_the_copies(two_cores: None) -> None:
    found = each_on_all_cores(lambda k: time.sleep(30.0 * k) or os.getpid(), [0, 2, 0])
    assert next(found) == os.getpid()
    begun = time.monotonic()
    found.close()
    assert time.monotonic() - begun < 20.0


def test_copies_write_files_although_this_process_has_threads_that_do(
    two_cores: None, tmp_path: Path
) -> None:
    def written(name: str) -> str:
        time.sleep(0.05)
        write_files({tmp_path / f"{name}{k}": name.encode() for k in range(3)})
        return name

    assert written("here") == "here"
    names = list("abcdef")
    assert list(each_on_all_cores(written, names)) == names
    assert len(list(tmp_path.iterdir())) == 3 * 7


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
