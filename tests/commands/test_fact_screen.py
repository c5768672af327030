"""A screen of facts: long entries are cut, whole ones are not."""

import pytest

from evoexp.commands.fact_screen import INDENT, MAX_LINES, screen


@pytest.mark.parametrize("count", [1, MAX_LINES, MAX_LINES + 1, MAX_LINES + 5])
def test_entries_are_cut_beyond_three_lines_and_say_so(count: int) -> None:
    room = 60 - INDENT
    names = [chr(ord("a") + k) * (room - 3) for k in range(count)]  # each fills a line
    parts = [
        {"component": name, "revision": 1, "installed_revision": 1, "package": "evoexp 1"}
        for name in names
    ]
    facts = {
        "condition": "0" * 64,
        "shipped_as": [],
        "components": parts,
        "origin": {"command": "evoexp run experiment=mine"},
        "environment": None,
        "result": None,
        "verdict": None,
        "settings": {},
        "notes": ["first line\nsecond\nthird\nfourth"],
    }
    lines = list(screen(facts, 60))
    begin = next(k for k, line in enumerate(lines) if line.startswith("components"))
    shown = lines[begin : begin + min(count, MAX_LINES)]
    assert [name in line for name, line in zip(names, shown, strict=False)] == [True] * len(shown)
    assert not lines[begin + len(shown)].startswith(" ")
    assert shown[-1].endswith("…") == (count > MAX_LINES)
    assert not any(line.endswith("…") for line in lines if line not in shown)
    assert [line.split()[-1] for line in lines[-4:]] == ["line", "second", "third", "fourth"]
