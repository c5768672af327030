"""Files that are either whole or not there, whenever the process or the machine dies."""

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

FEW = 8  # files from which on they are synced by that many threads; starting those costs as much as syncing two
_SUFFIX = ".tmp"


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files, each atomically and durably: temporary file, fsync, rename, and then fsync of the directory.

    No file is renamed before its bytes are on the disk: a name always means a whole file. A batch is cheaper than its
    files one by one: they are synced at once, which the disk answers together, and the directory once.
    """
    written: list[tuple[Path, Path]] = []
    try:
        for path, content in contents.items():
            temporary = path.with_name(f".{path.name}.{os.getpid()}{_SUFFIX}")
            written.append((temporary, path))
            temporary.write_bytes(content)
        _sync_files([temporary for temporary, _ in written])
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


def _sync_files(paths: Sequence[Path]) -> None:
    if len(paths) < FEW:
        for path in paths:
            _sync(path)
        return
    with ThreadPoolExecutor(FEW) as threads:
        list(threads.map(_sync, paths))


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


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
