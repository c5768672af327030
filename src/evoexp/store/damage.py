"""Damage of stored files: named, set aside, never deleted.

A log is checked against its place when it is first seen: its checksums, its condition, its
replicate. `summary.parquet` then notes its size and time, and it is not decoded again as long as
both are the same. `run`, and whoever reads the logs anyway, compares all checksums besides, which
takes some 30 µs per log of 70 kB; `list` and `show` do not.
"""

import os
import warnings
from collections.abc import Mapping
from pathlib import Path

from evoexp.errors import CorruptLog, DamagedStore, OtherVersion
from evoexp.records import ReplicateSummary
from evoexp.store.files import sync_directory
from evoexp.store.log_reader import read_summary

DAMAGED = ".damaged"  # ends the name of a file that was set aside
MAX_NAMED = 3  # damaged files in one line


def warn(text: str) -> None:
    """Say that something stored is damaged; the command goes on."""
    warnings.warn(text, DamagedStore, stacklevel=3)


def checked_summary(source: Path | bytes, condition_id: str, replicate: int) -> ReplicateSummary:
    """Return the summary of the log in the place of a replicate, or of its bytes.

    Raises:
        CorruptLog: The log is damaged, or it is of another condition or replicate.
    """
    summary = read_summary(source)
    if (summary.condition, summary.replicate) != (condition_id, replicate):
        theirs = f"replicate {summary.replicate} of {summary.condition[:12]}"
        name = "log" if isinstance(source, bytes) else source
        raise CorruptLog(f"{name}: holds {theirs}, which does not belong here")
    return summary


def set_aside(path: Path) -> Path:
    """Rename a damaged file, or whatever stands in its place; return its new path.

    Nothing is overwritten: `0001.mcap.damaged`, then `0001.mcap.damaged.2`, and so on.
    """
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


def listed(damaged: Mapping[str, str]) -> str:
    """Return names of files and what is wrong with them, the first few of many."""
    named = [f"{name} ({why})" for name, why in list(damaged.items())[:MAX_NAMED]]
    more = [f"{len(damaged) - MAX_NAMED} more"] if len(damaged) > MAX_NAMED else []
    return ", ".join([*named, *more])


def is_of_another_version(path: Path) -> bool:
    """Return whether a log cannot be read because another version of evoexp wrote it."""
    try:
        read_summary(path)
    except OtherVersion:
        return True
    except CorruptLog:
        return False
    return False
