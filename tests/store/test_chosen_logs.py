"""The replicate that is meant."""

from collections.abc import Callable
from typing import Any

import pytest

from evoexp.commands.chosen_motions import chosen_log
from evoexp.errors import DamagedStore, NothingStored
from evoexp.store.log import Finished
from evoexp.store.run_directory import RunDirectory

Add = Callable[..., Finished]
RESULTS: tuple[dict[str, Any], ...] = (
    {"best_cost": 3.0, "certified": True},
    {"best_cost": float("inf"), "certified": None},
    {"best_cost": 1.0, "certified": False},
    {"best_cost": 5.0, "certified": False},
)


@pytest.fixture
def filled(run: RunDirectory, add: Add) -> RunDirectory:
    """Return a run with results."""
    for replicate, result in enumerate(RESULTS):
        add(replicate, **result)
    return run


def chosen(run: RunDirectory, choice: str | int) -> str:
    return chosen_log(run, choice).name


def test_choices(filled: RunDirectory) -> None:
    assert [chosen(filled, name) for name in ("best", "worst", "refuted", 1)] == [
        "0002.mcap",
        "0003.mcap",
        "0002.mcap",
        "0001.mcap",
    ]


def test_a_failure_is_not_chosen(filled: RunDirectory) -> None:
    filled.write_failure(9, "ValueError: no", "Traceback")
    assert chosen(filled, "best") == "0002.mcap"


def test_a_damaged_log_is_left_out_and_said(filled: RunDirectory) -> None:
    path = filled.log_path(2)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.warns(DamagedStore, match="left out, damaged: 0002.mcap"):
        assert chosen(filled, "best") == "0000.mcap"


def test_a_damaged_failure_is_said(filled: RunDirectory) -> None:
    filled.failure_path(9).write_text("{")
    with pytest.warns(DamagedStore, match=r"0009\.failed\.json"):
        assert chosen(filled, "best") == "0002.mcap"


def test_nothing_to_choose_from(run: RunDirectory) -> None:
    with pytest.raises(NothingStored, match="no finished replicate among 0"):
        chosen_log(run, "best")


def test_nothing_refuted(run: RunDirectory, add: Add) -> None:
    add(0, certified=True)
    with pytest.raises(NothingStored, match="no refuted replicate among 1"):
        chosen_log(run, "refuted")
