"""Reports that stand: nothing that they were drawn from has changed since, nor have their files.

Drawing a report takes seconds, looking at what it depends on milliseconds: code, options, package
data, versions of libraries, all stored runs (a page may tell of other experiments), what was asked
for, and the files that were written, by their sizes and times.
"""

import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.numeric.kept_files import Damaged, cache_root, read_kept, write_kept
from evoexp.store.kept_facts import file_stamps, installed_code
from evoexp.version import version_of

_DRAWERS = ("jinja2", "matplotlib", "numpy", "pandas", "scipy", "pyarrow", "pin", "coal", "numba")
_PACKAGE = Path(__file__).parents[1]


class StandingReport(NamedTuple):
    """A report that may stand."""

    directory: Path  # its folder
    asked: tuple[str, ...]  # what it was asked for in, words and identities that it follows from
    inputs: bytes  # hash of all else that it follows from, as it was before it was drawn

    def stands(self) -> bool:
        """Whether it would be drawn as it is."""
        with contextlib.suppress(FileNotFoundError, Damaged):
            return read_kept(self._path) == self._state()
        return False

    def remember(self) -> None:
        """Note that it has just been drawn; silent where nothing can be kept."""
        with contextlib.suppress(OSError):
            write_kept(self._path, self._state())

    @property
    def _path(self) -> Path:
        name = hashlib.sha256(os.fsencode(self.directory.resolve())).hexdigest()[:32]
        return cache_root() / "reports" / name

    def _state(self) -> bytes:
        """Return the hash of all that it follows from, and of its files."""
        digest = hashlib.sha256(json.dumps(self.asked).encode() + self.inputs)
        _add_stamps(digest, [self.directory])
        return digest.hexdigest().encode()


def inputs_of_reports(outputs: Path, folders: Sequence[Path]) -> bytes:
    """Return the hash of all that reports follow from, now, but what each was asked for in.

    Args:
        outputs: Root of all outputs.
        folders: Folders of options.
    """
    versions = [sys.version, *map(version_of, _DRAWERS)]
    digest = hashlib.sha256(json.dumps(versions).encode() + installed_code())
    _add_stamps(digest, [_PACKAGE / "assets", *folders, outputs / "runs"])
    return digest.digest()


def _add_stamps(digest: Any, roots: Iterable[Path]) -> None:
    for stamp in file_stamps(roots):
        digest.update(json.dumps(stamp).encode(errors="surrogateescape"))
