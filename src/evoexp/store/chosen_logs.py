"""The log of a run that is meant: of a replicate, of the best one, of the first refuted one."""

import contextlib
import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from evoexp.errors import CorruptLog, NothingStored, StoreError
from evoexp.store.damage import checked_summary
from evoexp.store.run_directory import RunDirectory

CHOICES = ("best", "worst", "refuted")
DONE = "done"  # status of a replicate that did not fail
FEW = 100  # logs that are read in less time than pyarrow is loaded to read their table


class _Finished(NamedTuple):
    """A replicate that is done: all that a choice looks at.

    Attributes:
        replicate: Its index.
        best_cost: Of its last best solution; None: it has none.
        certified: Verdict on its motion; None: undecided, or there is no motion.
    """

    replicate: int
    best_cost: float | None
    certified: bool | None


def chosen_log(run: RunDirectory, choice: str | int) -> Path:
    """Return the log of one replicate of a run.

    Args:
        run: The run.
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
    done = _finished(run)
    if choice == "refuted":
        rows = [row for row in done if row.certified is False]
    else:
        sign = 1.0 if choice == "best" else -1.0
        rows = sorted(done, key=lambda row: _rank(row.best_cost, sign))
    if not rows:
        what = "refuted replicate" if choice == "refuted" else "finished replicate"
        raise NothingStored(f"run {run.hash12}: no {what} among {len(done)}")
    return run.log_path(rows[0].replicate)


def _finished(run: RunDirectory) -> list[_Finished]:
    """Return the replicates of a run that are done, in order; all logs are checked on the way.

    Logs tell it themselves where they are few and nothing is damaged. Else the table of summaries
    does, which says what is damaged and leaves it out.
    """
    replicates = sorted(run.completed())
    if len(replicates) <= FEW:
        with contextlib.suppress(CorruptLog, StoreError):
            for failed in run.failed():
                run.failure(failed)
            summaries = [checked_summary(run.log_path(k), run.condition_id, k) for k in replicates]
            return [
                _Finished(each.replicate, each.best_cost, each.certified)
                for each in summaries
                if each.status == DONE
            ]
    from evoexp.store.summaries import summary_table  # pyarrow

    table = summary_table(run, thorough=True).select(["status", *_Finished._fields]).to_pylist()
    rows = [[row[name] for name in _Finished._fields] for row in table if row["status"] == DONE]
    return sorted(_Finished(*row) for row in rows)


def _rank(cost: float | None, sign: float) -> tuple[bool, float]:
    """Return the key by which replicates are sorted: those of no finite cost come last."""
    is_finite = cost is not None and math.isfinite(cost)
    return not is_finite, sign * cost if cost is not None and is_finite else 0.0


def _listed(done: Iterable[int]) -> str:
    names = [str(k) for k in done]
    return ", ".join(names[:8]) + (", …" if len(names) > 8 else "") if names else "none"
