"""Files that a condition needs: each process keeps their contents, by hash.

A file is read where a configuration says `{file: path}`, and `{sha256: …}` is put in its place: a
condition's identity is that of the content, wherever the file lay and whatever it was called. The
content travels with the descriptions of replicates, is attached to their logs, and lies beside the
configuration of a stored run.
"""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from evoexp.errors import EvoexpError, SettingError
from evoexp.input_files import MAX_INPUT, read_bounded
from evoexp.validation import Settings

FILE, SHA256 = "file", "sha256"
SHIPPED = "evoexp:"  # of paths
PREFIX = "files/"  # of the names of such attachments in a log

_contents: dict[str, bytes] = {}


class MissingFile(EvoexpError):
    """The content of a file that a condition needs is nowhere to be found."""


class File(Settings):
    """A file, as its content."""

    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]  # of the content, 64 hex digits

    @property
    def content(self) -> bytes:
        """The content; `MissingFile` if this process never saw it."""
        if self.sha256 not in _contents:
            raise MissingFile(
                f"file of sha256 {self.sha256[:12]}…: its content is not there; give the file again"
            )
        return _contents[self.sha256]


def located(path: str) -> str:
    """Return the path of a file; `evoexp:` stands for the folder of files that evoexp ships."""
    if not path.startswith(SHIPPED):
        return path
    return str(Path(__file__).parent / "assets" / path.removeprefix(SHIPPED))


def keep(content: bytes) -> str:
    """Keep the content of a file for as long as the process lives; return its SHA-256."""
    sha256 = hashlib.sha256(content).hexdigest()
    _contents[sha256] = content
    return sha256


def keep_all(contents: Iterable[bytes]) -> None:
    """Keep the contents of several files."""
    for content in contents:
        keep(content)


def read(path: Any, folders: Sequence[Path], field: str) -> str:
    """Read a file, also one that lies in a folder, and keep its content; return the SHA-256."""
    places = [Path(str(path)), *(folder / str(path) for folder in folders)]
    existing = [place for place in places if place.exists()]
    return keep(file_content(existing[0] if existing else path, field))


def file_content(path: Any, field: str, limit: int = MAX_INPUT) -> bytes:
    """Read a file of at most `limit` bytes, which may be one that evoexp ships."""
    try:
        return read_bounded(located(str(path)), limit)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingError(field, f"a file that can be read ({reason})", str(path)) from None


def attached(config: Any) -> dict[str, bytes]:
    """Return the contents that plain data refers to and this process has, by names in a log."""
    return {PREFIX + sha256: _contents[sha256] for sha256 in hashes(config) if sha256 in _contents}


def hashes(config: Any) -> Iterator[str]:
    """Yield the SHA-256 of every file that a plain configuration refers to."""
    if isinstance(config, dict):
        if set(config) == {SHA256}:
            yield str(config[SHA256])
        for value in config.values():
            yield from hashes(value)
    elif isinstance(config, list | tuple):
        for value in config:
            yield from hashes(value)
