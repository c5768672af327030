"""Recordings of stored replicates: the condition attached to a log, and the best solution in it."""

import math
from collections.abc import Iterable
from pathlib import Path

from evoexp.attachments import PREFIX, keep_all
from evoexp.condition import Condition
from evoexp.errors import NothingStored
from evoexp.playback.recording import Heading, Recording, record
from evoexp.playback.timing import SpeedLimits
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import summary_table

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
        finished = sorted(run.completed())
        if choice not in finished:
            raise NothingStored(
                f"run {run.hash12}: no finished replicate {choice} (finished: {_listed(finished)})"
            )
        return run.log_path(choice)
    names = ["replicate", "status", "best_cost", "certified"]
    table = summary_table(run, thorough=True).select(names).to_pylist()
    done = sorted((r for r in table if r["status"] == "done"), key=lambda row: row["replicate"])
    if choice == "refuted":
        rows = [row for row in done if row["certified"] is False]
    else:
        sign = 1.0 if choice == "best" else -1.0
        rows = sorted(done, key=lambda row: _rank(row["best_cost"], sign))
    if not rows:
        what = "refuted replicate" if choice == "refuted" else "finished replicate"
        raise NothingStored(f"run {run.hash12}: no {what} among {len(done)}")
    return run.log_path(int(rows[0]["replicate"]))


def _rank(cost: float | None, sign: float) -> tuple[bool, float]:
    """Return the key by which replicates are sorted: those of no finite cost come last."""
    is_finite = cost is not None and math.isfinite(cost)
    return not is_finite, sign * cost if cost is not None and is_finite else 0.0


def _listed(done: Iterable[int]) -> str:
    names = [str(k) for k in done]
    return ", ".join(names[:8]) + (", …" if len(names) > 8 else "") if names else "none"
