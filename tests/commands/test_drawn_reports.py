"""Reports that are drawn are named in order, and none is lost with another."""

from collections.abc import Callable

import pytest

from evoexp.commands.console import plain_console
from evoexp.commands.drawn_reports import name_reports
from evoexp.errors import NothingStored


def place(name: str) -> Callable[[], str]:
    def drawn() -> str:
        return name

    return drawn


def refused(error: Exception) -> Callable[[], str]:
    def drawn() -> str:
        raise error

    return drawn


def test_they_are_named_in_order(capsys: pytest.CaptureFixture[str]) -> None:
    draws = [place("one"), place("two"), place("three")]
    console = plain_console()
    assert name_reports(draws, console, lambda number: console.print(f"table {number}")) == 0
    said = capsys.readouterr()
    lines = ["table 0", "report: one", "table 1", "report: two", "table 2", "report: three"]
    assert said.out.splitlines() == lines
    assert said.err == ""


def test_one_that_is_refused_keeps_no_other(capsys: pytest.CaptureFixture[str]) -> None:
    draws = [place("one"), refused(NothingStored("two: nothing stored")), place("three")]
    assert name_reports(draws, plain_console()) == 2
    said = capsys.readouterr()
    assert said.out.splitlines() == ["report: one", "report: three"]
    assert said.err == "evoexp: two: nothing stored\n"


def test_a_programming_error_is_raised_once_the_others_are_drawn(
    capsys: pytest.CaptureFixture[str],
) -> None:
    draws = [refused(ZeroDivisionError("here")), place("two"), refused(NothingStored("three"))]
    with pytest.raises(ZeroDivisionError, match="here"):
        name_reports(draws, plain_console())
    said = capsys.readouterr()
    assert said.out.splitlines() == ["report: two"]
    assert said.err == "evoexp: three\n"
