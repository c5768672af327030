"""Pages that play motions, kept: drawing one takes most of a second, looking it up milliseconds.

A page follows from the content of its logs, what it was asked for, the installed code, package data
and versions of libraries. It is kept under the hash of all of these.
"""

import contextlib
import hashlib
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from evoexp.input_files import read_bounded
from evoexp.numeric.kept_files import Damaged, cache_root, read_kept, write_kept
from evoexp.store.kept_facts import file_stamps, installed_code
from evoexp.version import version_of

MOST = 64  # pages that are kept; those drawn longest ago are removed
_DRAWERS = ("numpy", "numba", "scipy", "pin", "coal")
_ASSETS = Path(__file__).parents[1] / "assets"


class KeptPage(NamedTuple):
    """A page that plays motions.

    Attributes:
        names: Of the motions, for the name of a file.
        content: HTML.
    """

    names: list[str]
    content: bytes


def kept_page(
    logs: Sequence[tuple[Path, str]], asked: str, draw: Callable[[], KeptPage]
) -> KeptPage:
    """Return the page of some logs, drawn only where it is not kept.

    Args:
        logs: Path and title of each.
        asked: All else that it follows from.
        draw: Draws it; what it raises is not kept.
    """
    place = _place(logs, asked)
    with contextlib.suppress(FileNotFoundError, Damaged):
        names, _, content = read_kept(place).partition(b"\n")
        return KeptPage(json.loads(names), content)
    found = draw()
    if _place(logs, asked) == place:  # no log was written meanwhile
        with contextlib.suppress(OSError):
            write_kept(place, json.dumps(found.names).encode() + b"\n" + found.content)
            _keep_newest(place.parent)
    return found


def _place(logs: Sequence[tuple[Path, str]], asked: str) -> Path:
    """Return the file that a page is kept in."""
    versions = [sys.version, *map(version_of, _DRAWERS)]
    told = [asked, *versions, *(title for _, title in logs), *file_stamps([_ASSETS])]
    digest = hashlib.sha256(json.dumps(told).encode(errors="surrogateescape"))
    digest.update(installed_code())
    for path, _ in logs:
        with contextlib.suppress(OSError):  # who draws the page says so
            digest.update(hashlib.sha256(read_bounded(path)).digest())
    return cache_root() / "pages" / digest.hexdigest()[:32]


def _keep_newest(folder: Path) -> None:
    """Remove the pages that were drawn longest ago, all but `MOST`."""
    pages = sorted((path.stat().st_mtime_ns, path) for path in folder.iterdir())
    for _, path in pages[:-MOST]:
        path.unlink(missing_ok=True)
