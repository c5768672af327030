"""Files that are either whole or not there, whenever the process or the machine dies."""

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

_SUFFIX = ".tmp"


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files, each atomically and durably: temporary file, fsync, rename, and then fsync of the directory.

    A batch costs one fsync of the directory instead of one per file.
    """
    written: list[tuple[Path, Path]] = []
    try:
        for path, content in contents.items():
            temporary = path.with_name(f".{path.name}.{os.getpid()}{_SUFFIX}")
            written.append((temporary, path))
            with open(temporary, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        for temporary, path in written:
            os.replace(temporary, path)
    finally:
        for temporary, _ in written:
            temporary.unlink(missing_ok=True)
    for directory in {path.parent for path in contents}:
        sync_directory(directory)


def write_file(path: Path, content: bytes) -> None:
    """Write one file atomically and durably."""
    write_files({path: content})


def sync_directory(path: Path) -> None:
    """Make renames and new names in a directory durable; where the system cannot open directories, do nothing."""
    with suppress(PermissionError):  # Windows
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def remove_stale(directories: Iterable[Path]) -> None:
    """Remove the temporary files that killed writers left; only for who holds the lock."""
    for directory in directories:
        for path in directory.glob(f".*{_SUFFIX}"):
            path.unlink(missing_ok=True)
