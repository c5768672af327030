"""Recordings of stored replicates: the condition attached to a log, and the best solution in it."""

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from evoexp.attachments import PREFIX, keep_all
from evoexp.condition import Condition
from evoexp.errors import NothingStored
from evoexp.playback.recording import Heading, Recording, record
from evoexp.playback.timing import SpeedLimits
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.store.tables import read_summaries

CHOICES = ("best", "worst", "refuted")


def stored_recording(log: Path, title: str = "", limits: SpeedLimits | None = None) -> Recording:
    """Return the motion of a log's best solution; the log alone is enough.

    Args:
        log: Path of a finished log.
        title: Title of the recording; by default the hash of the condition.
        limits: Speed limits of the joints.

    Raises:
        CorruptLog: The log cannot be trusted.
        RevisionMismatch: It was made by another revision of a component.
        NoMotion: Its solution is no motion.
    """
    contents = read_log(log)
    keep_all(data for name, data in contents.attachments.items() if name.startswith(PREFIX))
    condition = Condition.from_json(contents.config_json)
    improvements = tuple((row.generation, row.cost) for row in contents.solutions)
    heading = Heading(title or contents.condition_id[:12], contents.replicate, improvements)
    found = record(condition, contents.solutions[-1].values, heading, limits)
    return found._replace(condition_id=contents.condition_id, config_json=contents.config_json)


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
        done = sorted(run.completed())
        if choice not in done:
            raise NothingStored(
                f"run {run.hash12}: no finished replicate {choice} (finished: {_listed(done)})"
            )
        return run.log_path(choice)
    rows = read_summaries(run, thorough=True)
    rows = rows[rows["status"] == "done"].sort_values("replicate")
    num_done = len(rows)
    if choice == "refuted":
        rows = rows[rows["certified"].fillna(True) == False]  # noqa: E712  # a column, not a truth
    else:
        rows = rows.sort_values("best_cost", ascending=choice == "best", kind="stable")
        rows = _finite_first(rows)
    if rows.empty:
        what = "refuted replicate" if choice == "refuted" else "finished replicate"
        raise NothingStored(f"run {run.hash12}: no {what} among {num_done}")
    return run.log_path(int(rows["replicate"].iloc[0]))


def _finite_first(rows: pd.DataFrame) -> pd.DataFrame:
    """Move the replicates without a feasible solution behind the others, in either order."""
    infinite = rows["best_cost"].astype("float64") == float("inf")
    return pd.concat([rows[~infinite], rows[infinite]])


def _listed(done: Iterable[int]) -> str:
    names = [str(k) for k in done]
    return ", ".join(names[:8]) + (", …" if len(names) > 8 else "") if names else "none"
