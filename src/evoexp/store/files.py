"""Files that are either whole or not there, whenever the process or the machine dies."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

NUM_THREADS = 8  # that write files at the same time
_SUFFIX = ".tmp"


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files, each atomically and durably.

    Each goes through a temporary file, fsync and rename; then the directory is synced.

    No file is renamed before its bytes are on the disk: a name always means a whole file. A batch
    is cheaper than its files one by one: they are synced at once, which the disk answers together,
    and the directory once.
    """
    files = [(path.with_name(f".{path.name}.{os.getpid()}{_SUFFIX}"), path) for path in contents]
    renamed = 0
    try:
        _write_all(
            [(*file, content) for file, content in zip(files, contents.values(), strict=True)]
        )
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


def _write_all(files: Sequence[tuple[Path, Path, bytes]]) -> None:
    if len(files) == 1:
        _write(*files[0])
        return
    writing = [_threads().submit(_write, *file) for file in files]
    try:
        wait(writing)  # for all of them, whatever happens to one
    except BaseException:  # Ctrl-C: no thread writes a file that is then removed
        for one in writing:
            one.cancel()
        wait(writing)
        raise
    for one in writing:
        one.result()


@cache
def _threads() -> ThreadPoolExecutor:
    """Return the threads that write; they stay, as starting them takes as long as two files."""
    return ThreadPoolExecutor(NUM_THREADS, "write")


def _write(temporary: Path, path: Path, content: bytes) -> None:
    """Write a file under its temporary name; return when it is on the disk."""
    with _named(path), open(temporary, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Let errors of the system name a path: those of `write` and `fsync` name none."""
    try:
        yield
    except OSError as error:
        error.filename = str(path)
        raise


def sync_directory(path: Path) -> None:
    """Make renames and new names in a directory durable.

    Nothing is done where the system cannot open directories.
    """
    with suppress(PermissionError):  # Windows
        descriptor = os.open(path, os.O_RDONLY)
        try:
            with _named(path):
                os.fsync(descriptor)
        finally:
            os.close(descriptor)


def is_temporary(name: str) -> bool:
    """Return whether a file's name, or the last part of its path, is one of a temporary file."""
    last = name.rsplit("/", 1)[-1]
    return last.startswith(".") and last.endswith(_SUFFIX)


def remove_stale(directories: Iterable[Path]) -> None:
    """Remove the temporary files that killed writers left; only for who holds the lock."""
    for directory in directories:
        for path in directory.glob(f".*{_SUFFIX}"):
            path.unlink(missing_ok=True)
