"""Files that are either whole or not there, whenever the process or the machine dies."""

import os
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

from evoexp.errors import DamagedStore

NUM_THREADS = 8  # that write files at the same time
_SUFFIX = ".tmp"
DAMAGED = ".damaged"  # ends the name of a file that was set aside
MAX_NAMED = 3  # damaged files in one line


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files, each atomically and durably: a temporary file, fsync, rename.

    Their folders are made. No file is renamed before the bytes of all are on the disk, which
    answers their syncs together.
    """
    ending = f".{os.getpid()}{_SUFFIX}"
    files = {path: path.with_name(f".{path.name}{ending}") for path in contents}  # temporary
    for directory in {path.parent for path in files}:
        directory.mkdir(parents=True, exist_ok=True)
    try:
        with ThreadPoolExecutor(NUM_THREADS) as threads:  # none begins a file after an error
            list(threads.map(_write, files, files.values(), contents.values()))
        for path, temporary in files.items():
            temporary.replace(path)
    finally:
        for temporary in files.values():
            temporary.unlink(missing_ok=True)
    for directory in {path.parent for path in files}:
        sync_directory(directory)


def write_file(path: Path, content: bytes) -> None:
    """Write one file atomically and durably."""
    write_files({path: content})


def _write(path: Path, temporary: Path, content: bytes) -> None:
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
    """Make renames and new names in a directory durable, where the system can open one."""
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


def warn(text: str) -> None:
    """Say that something stored is damaged; the command goes on."""
    warnings.warn(text, DamagedStore, stacklevel=3)


def set_aside(path: Path) -> Path:
    """Rename a damaged file to `1.mcap.damaged`, or `1.mcap.damaged.2`, …; return its path."""
    count, aside = 1, path.with_name(path.name + DAMAGED)
    while os.path.lexists(aside):
        count += 1
        aside = path.with_name(f"{path.name}{DAMAGED}.{count}")
    path.rename(aside)
    sync_directory(path.parent)
    return aside


def is_set_aside(name: str) -> bool:
    """Return whether a file's name is one that `set_aside` gives."""
    head, found, tail = name.rpartition(DAMAGED)
    return bool(head and found) and (not tail or tail.removeprefix(".").isdecimal())


def reason(path: Path, error: Exception) -> str:
    """Return the text of an error about a file without the file's path, in one line."""
    return " ".join(str(error).removeprefix(f"{path}: ").split())


def first_of(texts: Sequence[str], most: int) -> list[str]:
    """Return the first of many texts, and the number of the others: `… 3 more`."""
    others = [f"… {len(texts) - most} more"] if len(texts) > most else []
    return [*texts[:most], *others]


def listed(damaged: Mapping[str, str]) -> str:
    """Return names of files and what is wrong with them, the first few of many."""
    return ", ".join(first_of([f"{name} ({why})" for name, why in damaged.items()], MAX_NAMED))
