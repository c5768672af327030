"""Tables at any width: no word is broken, nothing is left out, no line is too long."""

import io

import pytest
from rich.console import Console

from evoexp.commands.console import add_columns, add_hash_column, new_table

ROWS = [
    ("98b2a65c957f", "corsepius_pick_and_place, via-point GA, paper (changed)", "30", "176.25"),
    ("b810144907f3", "rana_planar, random search, paper", "2", "–"),
]
NAMES = ("hash", "condition", "done", "median\nbest cost")


def shown(width: int) -> str:
    table = new_table("runs")
    add_hash_column(table)
    add_columns(table, "condition")
    add_columns(table, *NAMES[2:], right=True)
    for row in ROWS:
        table.add_row(*row)
    console = Console(file=io.StringIO(), width=width, markup=False, color_system=None)
    console.print(table)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


@pytest.mark.parametrize("width", range(44, 161, 4))
def test_no_word_is_broken(width: int) -> None:
    text = shown(width)
    assert max(map(len, text.splitlines())) <= width
    words = text.split()
    for word in " ".join((*NAMES, *(" ".join(row) for row in ROWS))).split():
        assert word in words


def test_narrow_tables_lose_their_lines_then_are_stacked() -> None:
    assert "┃" in shown(80)
    assert "┃" not in shown(50)
    assert shown(50).splitlines()[2].split() == ["best"]
    assert [line.split()[:2] for line in shown(44).splitlines()[1:3]] == [
        ["hash", "98b2a65c957f"],
        ["condition", "corsepius_pick_and_place,"],
    ]


def test_a_table_without_rows_has_its_headers() -> None:
    table = new_table()
    add_columns(table, "name", "what")
    console = Console(file=io.StringIO(), width=60, color_system=None)
    console.print(table)
    assert isinstance(console.file, io.StringIO)
    assert console.file.getvalue().count("name") == 1
