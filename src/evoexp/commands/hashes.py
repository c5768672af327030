"""Suggestions for a hash that belongs to no stored run."""

from pathlib import Path

from evoexp.errors import EvoexpError, UnknownHash
from evoexp.store.run_directory import RunDirectory, open_run, run_names

MAX_LISTED = 8  # candidates in an error; `evoexp list` shows all


def stored_runs(outputs: Path) -> list[tuple[str, RunDirectory | EvoexpError]]:
    """Return all stored runs by name; in place of a damaged one, the text of its error."""
    found: list[tuple[str, RunDirectory | EvoexpError]] = []
    for name in run_names(outputs):
        try:
            found.append((name, open_run(outputs, name)))
        except EvoexpError as error:
            found.append((name, error))
    return found


def with_candidates(error: UnknownHash, outputs: Path) -> UnknownHash:
    """Return an error about a hash with the candidates: the runs that are stored."""
    names = run_names(outputs)
    more = f", … {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
    stored = ", ".join(names[:MAX_LISTED]) + more if names else "none"
    return UnknownHash(f"{error}; no shipped condition either (stored: {stored}; see: evoexp list)")
