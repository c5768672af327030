"""The hash of the code that kept results follow from."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import evoexp

SCRIPT = """
import sys
from evoexp.report.results.proven_answers import NO_PART
from evoexp.store.installed_code import installed_code
print(installed_code().hex(), installed_code(NO_PART).hex())
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("code")
    shutil.copytree(Path(evoexp.__file__).parent, root / "evoexp")
    return root


def hashes(copy: Path) -> list[str]:
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(copy)!r})\n{SCRIPT}"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


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
    copy: Path, file: str, changed: list[bool]
) -> None:
    before, path = hashes(copy), copy / "evoexp" / file
    path.write_text(f"{path.read_text()}# another line\n")
    after = hashes(copy)
    assert [a != b for a, b in zip(before, after, strict=True)] == changed
