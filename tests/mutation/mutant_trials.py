"""Runs the tests near a mutant, in a copy of the tree."""

import contextlib
import functools
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mutants import PACKAGE, Mutant

from evoexp.numeric.cache_folder import cache_root

IMPORT = re.compile(r"^ *from ([\w.]+) import (\([^)]*\)|[^\n]+)$|^ *import ([\w.]+)", re.MULTILINE)
NOT_NEAR = ("tests/mutation", "src/evoexp/assets")  # tests that are none of the module's
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", "outputs", "__pycache__", ".*_cache")
SURVIVES = "survives"
MOST_BROKEN = 3  # tests that fail without the mutant; then its trial is given up
TEST_S = 300  # [s] of one test: a mutant may never end
TRIAL_S = 600  # [s] of one command of tests


class Outcome(NamedTuple):
    """The end of a trial."""

    is_killed: bool
    text: str  # the test that failed, or the reason why none did


def _copy_if_there(file: str, place: str) -> None:
    """Copy a file, unless another process removed it meanwhile."""
    with contextlib.suppress(FileNotFoundError):
        shutil.copy2(file, place)


def near_tests(tree: Path, module: Path) -> list[list[str]]:
    """Choose the tests that may kill the mutants of a module.

    First files that mirror it or import it, through as few other modules as may be; then all others
    of the folder that mirrors its room.
    """
    parts = module.relative_to(PACKAGE).with_suffix("").parts
    folder = tree / "tests"
    for part in parts[:-1]:
        folder = folder / part if (folder / part).is_dir() else folder
    files = folder.glob("test_*.py" if folder == tree / "tests" else "**/test_*.py")
    room = [path.relative_to(tree).as_posix() for path in sorted(files)]
    stems = [f"test_{part.removesuffix('_kernels')}" for part in reversed(parts)]
    near = [file for stem in stems for file in room if Path(file).stem.startswith(stem)]
    imports, edge = _imports(tree), {module.as_posix()}
    reached, levels = set(edge), list[list[str]]()
    while edge:  # what imports the module, what imports that, and so on
        names = {_dotted(one) for one in edge}
        edge = {one for one, modules in imports.items() if modules & names} - reached
        reached |= edge
        tests = sorted(one for one in edge if Path(one).stem.startswith("test_"))
        levels += [tests] if tests else []
    near += sorted(levels[0], key=lambda file: file not in room) if levels else []
    others = [file for level in levels for file in level if file in room]
    near = list(dict.fromkeys(near))
    return [near, [file for file in dict.fromkeys([*others, *room]) if file not in near]]


def _dotted(file: str) -> str:
    """Return a module's name as it is imported: tests by the names of their files."""
    path = Path(file).with_suffix("")
    parts = path.parts[1:] if path.parts[0] == "src" else path.parts[-1:]
    return ".".join(part for part in parts if part != "__init__")


@functools.cache
def _imports(tree: Path) -> dict[str, set[str]]:
    """Return the names that every file of code and tests imports."""
    found: dict[str, set[str]] = {}
    for path in sorted([*(tree / "src").rglob("*.py"), *(tree / "tests").rglob("*.py")]):
        names = found.setdefault(path.relative_to(tree).as_posix(), set())
        for origin, listed, whole in IMPORT.findall(path.read_text()):
            names.update({origin or whole} | {f"{origin}.{x}" for x in re.findall(r"\w+", listed)})
    return {file: names for file, names in found.items() if not file.startswith(NOT_NEAR)}


class Trials:
    """A copy of a tree in which mutants are tried, one after the other."""

    def __init__(self, tree: Path, place: Path) -> None:
        """Copy the tree into an empty folder."""
        self._place = place  # its bytecode lies elsewhere if a prefix is set; it is small
        self.tree = Path(shutil.copytree(tree, place / "tree", ignore=LEFT_OUT))
        shutil.copytree(cache_root(), place / "cache", copy_function=_copy_if_there)
        self._count = 0

    def run(self, mutant: Mutant) -> Outcome:
        """Run the tests near a mutant until one fails that passes without it."""
        broken: list[str] = []
        while len(broken) < MOST_BROKEN:
            with self._applied(mutant):
                outcome = self._outcome(Path(mutant.file), broken)
            passes = outcome.is_killed and "::" in outcome.text and self._pytest([outcome.text])
            if not passes or passes.text == SURVIVES:
                return outcome
            broken.append(outcome.text)
        return Outcome(False, f"fails without the mutant, too: {', '.join(broken)}")

    @contextlib.contextmanager
    def _applied(self, mutant: Mutant) -> Iterator[None]:
        """Change the file of a mutant for as long as the context lasts."""
        path, self._count = self.tree / mutant.file, self._count + 1
        source, times = path.read_text(), path.stat().st_mtime_ns
        path.write_text(mutant.applied(source))
        # bytecode is known by the time and the size of its file: no two mutants share a time
        os.utime(path, ns=(self._count * 10**9, self._count * 10**9))
        try:
            yield
        finally:
            path.write_text(source)
            os.utime(path, ns=(times, times))

    def _outcome(self, module: Path, broken: list[str]) -> Outcome:
        files = [few for few in near_tests(self.tree, module) if few]
        for few in files:
            outcome = self._pytest([*few, *(f"--deselect={test}" for test in broken)])
            if outcome.is_killed:
                return outcome
        return Outcome(False, f"{SURVIVES} {sum(map(len, files))} test files")

    def _pytest(self, names: list[str]) -> Outcome:
        """Run tests with a cache, outputs and temporary files that no other run sees."""
        place = self._place / "run"
        shutil.copytree(self._place / "cache", place / "cache")
        (place / "tmp").mkdir()
        mine = {k: v for k, v in os.environ.items() if not k.startswith(("EVOEXP", "PYTEST"))}
        mine |= {"PYTHONPATH": str(self.tree / "src"), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
        folders = {"EVOEXP_CACHE": "cache", "EVOEXP_OUTPUTS": "outputs", "TMPDIR": "tmp"}
        mine |= {name: str(place / folder) for name, folder in folders.items()}
        options = ["-x", "-q", "-rfE", "--tb=no", "-p", "pytest_timeout", f"--timeout={TEST_S}"]
        process = subprocess.Popen(
            [sys.executable, "-m", "pytest", *options, *names],
            cwd=self.tree,
            env=mine,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        try:
            said, _ = process.communicate(timeout=TRIAL_S)
        except subprocess.TimeoutExpired:
            return Outcome(False, f"is undecided after {TRIAL_S} s")
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            shutil.rmtree(place, ignore_errors=True)
        failed = re.search(r"^(?:FAILED|ERROR) (\S+(?: \S+)*?)(?: - |$)", said, re.MULTILINE)
        if process.returncode in (0, 5):  # 5: all of its tests are left out
            return Outcome(False, SURVIVES)
        return Outcome(True, failed[1] if failed else said[-300:])
