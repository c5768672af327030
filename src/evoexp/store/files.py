"""Files that are either whole or not there, whenever the process or the machine dies."""

import os
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

FEW = 8  # files from which on they are written by that many threads; starting those costs as much as syncing two
_SUFFIX = ".tmp"


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files, each atomically and durably: temporary file, fsync, rename, and then fsync of the directory.

    No file is renamed before its bytes are on the disk: a name always means a whole file. A batch is cheaper than its
    files one by one: they are synced at once, which the disk answers together, and the directory once.
    """
    files = [(path.with_name(f".{path.name}.{os.getpid()}{_SUFFIX}"), path) for path in contents]
    renamed = 0
    try:
        _write_all([temporary for temporary, _ in files], list(contents.values()))
        for temporary, path in files:
            os.replace(temporary, path)
            renamed += 1
    finally:
        for temporary, _ in files[renamed:]:
            temporary.unlink(missing_ok=True)
    for directory in {path.parent for path in contents}:
        sync_directory(directory)


def write_file(path: Path, content: bytes) -> None:
    """Write one file atomically and durably."""
    write_files({path: content})


def _write_all(paths: Sequence[Path], contents: Sequence[bytes]) -> None:
    if len(paths) < FEW:
        deque(map(_write, paths, contents), maxlen=0)
        return
    with ThreadPoolExecutor(FEW) as threads:
        deque(threads.map(_write, paths, contents), maxlen=0)


def _write(path: Path, content: bytes) -> None:
    """Write a file; return when it is on the disk."""
    with open(path, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


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
