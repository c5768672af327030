"""The hash of the code that kept results follow from."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import evoexp

SCRIPT = """
import sys
from evoexp.report.proven_answers import NO_PART
from evoexp.store.kept_facts import installed_code
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
        ("report/style.py", [True, False]),
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


def test_code_that_is_written_while_it_runs_is_nobody_elses(copy: Path) -> None:
    """Facts of the loaded code would be kept as facts of the written one."""
    edit = f"open({str(copy / 'evoexp/report/style.py')!r}, 'a').write('# one more line\\n')"
    command = [sys.executable, "-c"]
    found = [
        subprocess.run(
            [*command, f"import sys; sys.path.insert(0, {str(copy)!r})\nimport evoexp\n{script}"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()[0]
        for script in (f"{edit}\n{SCRIPT}", SCRIPT, SCRIPT)
    ]
    assert found[0] != found[1] == found[2]
    assert found[0].startswith(found[1])


def test_code_whose_files_have_the_same_sizes_and_times_is_read_once(
    copy: Path, tmp_path: Path
) -> None:
    for path in (copy / "evoexp").rglob("*.py"):
        os.utime(path, (1e9, 1e9))  # long ago
    first = f"import sys; sys.path.insert(0, {str(copy)!r})\n"
    refusing = f"{first}import evoexp.store.kept_facts as facts\nfacts.add_files = None\n"

    def run(script: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", script + SCRIPT]
        own = os.environ | {"EVOEXP_CACHE": str(tmp_path)}
        return subprocess.run(command, capture_output=True, text=True, env=own)

    read = run(first).stdout.split()
    assert run(refusing).stdout.split() == read != []
    os.utime(copy / "evoexp/report/style.py", (1e9, 1e9 + 1.0))
    assert "TypeError" in run(refusing).stderr
    assert run(first).stdout.split() == read, "the same content"
