"""Experiment, label and budget of a stored run."""

from typing import Any

from evoexp import shipped
from evoexp.errors import EvoexpError
from evoexp.store.run_directory import RunDirectory


def origin_of(run: RunDirectory) -> dict[str, Any]:
    """Return experiment, label and budget of a run as it was asked for: experiments share runs."""
    try:
        notes = run.manifest()
    except EvoexpError:
        notes = {}
    table, asked = shipped.shipped(), (notes.get("experiment"), notes.get("label"))
    rows = [row for row in table if row.condition_id == run.condition_id]
    if rows:
        row = next((row for row in rows if (row.experiment, row.label) == asked), rows[0])
        return {"experiment": row.experiment, "label": row.label, "budget": row.budget}
    names = {name: notes.get(name) for name in ("experiment", "label", "budget")}
    return names | {"changed": any(row.experiment == asked[0] for row in table)}
