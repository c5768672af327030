"""The hash of the code that kept results follow from."""

import shutil
from pathlib import Path

import pytest

import evoexp
from evoexp.report.results.proven_answers import NO_PART
from evoexp.store import installed_code as module
from evoexp.store.installed_code import installed_code


@pytest.mark.parametrize(
    ("file", "changed"),
    [
        ("report/figures/style.py", [True, False]),
        ("papers/lavoie/measures.py", [True, False]),
        ("planners/planner.py", [True, True]),
        ("collision/certifier/verdict.py", [True, True]),
    ],
)
def test_pages_do_not_count_where_verdicts_are_kept(
    file: str, changed: list[bool], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "evoexp"
    for folder in ("report", "papers", "planners", "collision"):
        shutil.copytree(Path(evoexp.__file__).parent / folder, copy / folder)
    monkeypatch.setattr(module, "__file__", str(copy / "store" / "installed_code.py"))
    before = [installed_code(), installed_code(NO_PART)]
    with (copy / file).open("a") as edited:
        edited.write("# another line\n")
    after = [installed_code(), installed_code(NO_PART)]
    assert [a != b for a, b in zip(before, after, strict=True)] == changed
