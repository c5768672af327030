"""The notes on conditions on a page."""

from types import SimpleNamespace
from typing import Any

from evoexp.report.pages import motion_pictures


def shown(label: str, *notes: str) -> Any:
    condition = SimpleNamespace(notes=lambda: [f"robot: {note}" for note in notes])
    return SimpleNamespace(condition=SimpleNamespace(label=label, condition=condition))


def test_equal_notes_stand_in_one_row() -> None:
    found = motion_pictures.notes(
        [shown("I", "covers", "pairs"), shown("I", "covers"), shown("II", "covers"), shown("III")]
    )
    assert found == (("I, II", "robot: covers"), ("I", "robot: pairs"))
