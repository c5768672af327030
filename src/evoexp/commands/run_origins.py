"""Experiment, label and budget of a stored run."""

from typing import Any

from evoexp.errors import EvoexpError
from evoexp.store.run_context import origin
from evoexp.store.run_directory import RunDirectory


def origin_of(run: RunDirectory) -> dict[str, Any]:
    """Return `run_context.origin` of a run; of one whose manifest is lost by its hash alone."""
    try:
        notes = run.manifest()
    except EvoexpError:
        notes = {}
    return origin(notes, run.condition_id)
