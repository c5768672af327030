"""The runs of a store, as tests look them up."""

from pathlib import Path

from evoexp.commands.stored_runs import stored_runs
from evoexp.store.run_directory import RunDirectory


def find_runs(outputs: Path) -> list[RunDirectory]:
    """Return all stored runs in the order of their hashes; those without identity are left out."""
    return [run for _, run in stored_runs(outputs) if isinstance(run, RunDirectory)]
