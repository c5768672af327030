"""The log of a run that is meant: of a replicate, of the best one, of the first refuted one."""

import math
from collections.abc import Iterable
from pathlib import Path

from evoexp.errors import NothingStored
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import summary_table

CHOICES = ("best", "worst", "refuted")
DONE = "done"  # status of a replicate that did not fail


def chosen_log(run: RunDirectory, choice: str | int) -> Path:
    """Return the log of one replicate of a run.

    Args:
        choice: Index of the replicate, or "best" or "worst" (by cost), or "refuted": the first
            replicate that the certifier refutes.

    Raises:
        NothingStored: If there is no such replicate.
    """
    if isinstance(choice, int):
        finished = sorted(run.completed())
        if choice not in finished:
            raise NothingStored(
                f"run {run.hash12}: no finished replicate {choice} (finished: {_listed(finished)})"
            )
        return run.log_path(choice)
    table = summary_table(run, thorough=True).to_pylist()
    done = [row for row in table if row["status"] == DONE]
    if choice == "refuted":
        rows = [row for row in done if row["certified"] is False]
    else:
        sign = 1.0 if choice == "best" else -1.0
        rows = sorted(done, key=lambda row: _rank(row["best_cost"], sign))
    if not rows:
        what = "refuted replicate" if choice == "refuted" else "finished replicate"
        raise NothingStored(f"run {run.hash12}: no {what} among {len(done)}")
    return run.log_path(rows[0]["replicate"])


def _rank(cost: float | None, sign: float) -> tuple[bool, float]:
    """Return the key by which replicates are sorted: those of no finite cost come last."""
    is_finite = cost is not None and math.isfinite(cost)
    return not is_finite, sign * cost if cost is not None and is_finite else 0.0


def _listed(done: Iterable[int]) -> str:
    names = [str(k) for k in done]
    return ", ".join(names[:8]) + (", …" if len(names) > 8 else "") if names else "none"
