"""Files that are either whole or not there, whenever the process or the machine dies."""

import os
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

NUM_THREADS = 8  # that write files at the same time
_SUFFIX = ".tmp"
_NEW = (
    os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
)


class _File(NamedTuple):
    """A file to be written: its temporary path, its final one, its content."""

    temporary: str
    final: str
    content: bytes


def write_files(contents: Mapping[Path, bytes] | Mapping[str, bytes]) -> None:
    """Write files, each atomically and durably.

    Each goes through a temporary file, fsync and rename; then the directory is synced.

    No file is renamed before its bytes are on the disk: a name always means a whole file. A batch
    is cheaper than its files one by one: they are synced at once, which the disk answers together,
    and the directory once.
    """
    ending, files = f".{os.getpid()}{_SUFFIX}", []
    for path, content in contents.items():
        folder, name = os.path.split(path)
        files.append(_File(os.path.join(folder, f".{name}{ending}"), os.fspath(path), content))
    renamed = 0
    try:
        _write_all(files)
        for temporary, final, _ in files:
            os.replace(temporary, final)
            renamed += 1
    finally:
        for temporary, _, _ in files[renamed:]:
            with suppress(FileNotFoundError):
                os.unlink(temporary)
    for directory in {os.path.dirname(final) for _, final, _ in files}:
        sync_directory(directory or ".")


def write_file(path: Path, content: bytes) -> None:
    """Write one file atomically and durably."""
    write_files({path: content})


def _write_all(files: Sequence[_File]) -> None:
    if len(files) == 1:
        _write(files[0])
        return
    from concurrent.futures import wait  # who writes one file needs no threads

    # one task per thread, not per file: handing a task over takes as long as writing a file
    shares = [files[k::NUM_THREADS] for k in range(min(NUM_THREADS, len(files)))]
    stop, locks = threading.Event(), [threading.Lock() for _ in shares]
    try:
        given = zip(shares, locks, strict=True)
        threads = _threads(os.getpid())
        writing = [threads.submit(_write_share, share, stop, lock) for share, lock in given]
        wait(writing)  # for all of them, whatever happens to one
    except BaseException:  # Ctrl-C: no thread writes a file that is then removed
        stop.set()
        for lock in locks:  # also of one that was interrupted while it was given its share
            with lock:
                pass
        raise
    for one in writing:
        one.result()


def _write_share(files: Sequence[_File], stop: threading.Event, lock: threading.Lock) -> None:
    """Write files one after the other until one fails or nobody wants them any more."""
    with lock:
        for file in files:
            if stop.is_set():
                return
            _write(file)


@cache
def _threads(process: int) -> "ThreadPoolExecutor":
    """Return the threads that write; they stay, as starting them takes as long as two files.

    Args:
        process: Whose they are: a copy of a process that has them needs its own.
    """
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(NUM_THREADS, "write")


def _write(file: _File) -> None:
    """Write a file under its temporary name; return when it is on the disk."""
    with _named(file.final):
        descriptor = os.open(file.temporary, _NEW, 0o666)
        try:
            rest = memoryview(file.content)
            while rest:
                rest = rest[os.write(descriptor, rest) :]
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextmanager
def _named(path: str) -> Iterator[None]:
    """Let errors of the system name a path: those of `write` and `fsync` name none."""
    try:
        yield
    except OSError as error:
        error.filename = path
        raise


def sync_directory(path: Path | str) -> None:
    """Make renames and new names in a directory durable.

    Nothing is done where the system cannot open directories.
    """
    with suppress(PermissionError):  # Windows
        descriptor = os.open(path, os.O_RDONLY)
        try:
            with _named(os.fspath(path)):
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
