"""Replicates as tasks of worker processes: a `Job` goes out, an `Outcome` comes back."""

import functools
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from evoexp.attachments import keep_all
from evoexp.batch.live_curves import CurveFile
from evoexp.batch.replicate_limits import ReplicateLimits, TookTooLong, limited
from evoexp.condition import Condition
from evoexp.records import ReplicateSummary

NO_LIMITS = ReplicateLimits()
LONGEST_TASK_S = 2.0  # [s] a task that has taken so long begins no further replicate


class Job(NamedTuple):
    """One replicate to run."""

    condition_id: str  # 64 hex digits
    condition_json: bytes  # canonical form of the condition
    replicate: int  # its index
    files: tuple[bytes, ...] = ()  # contents of the files that the condition refers to

    @property
    def key(self) -> tuple[str, int]:
        """Names it among all jobs."""
        return self.condition_id, self.replicate


class Outcome(NamedTuple):
    """One replicate that ended."""

    condition_id: str  # 64 hex digits
    replicate: int  # its index
    reason: str  # reason of a failure, in one line; empty when done
    traceback: str  # of the failure
    content: bytes  # the finished log; dropped once it is written
    wall_s: float  # duration [s]
    summary: ReplicateSummary | None = None  # the row that the log holds; None for a failed one
    # whether a failed one may be done another time: it took too long, or too much memory
    may_pass: bool = False


def run_jobs(
    jobs: Sequence[Job],
    limits: ReplicateLimits = NO_LIMITS,
    *,
    in_worker: bool = False,
    curves: Path | None = None,
) -> list[Outcome]:
    """Run replicates in this process, one after the other; a failure is an outcome.

    One at least is run; no further one begins after `LONGEST_TASK_S`. Convergence is told in the
    folder `curves`, if there is one.
    """
    from evoexp.batch.replicate import run_replicate  # and numba: a parent needs neither

    outcomes: list[Outcome] = []
    begun = time.perf_counter()
    for job in jobs:
        start = time.perf_counter()
        if outcomes and start - begun > LONGEST_TASK_S:
            break
        content, summary, reason, trace, may_pass = b"", None, "", "", False
        try:
            condition = condition_of(job)
            condition.prepare()
            with limited(limits, in_worker=in_worker):
                hear = None if curves is None else CurveFile(curves, *job.key).hear
                content, summary = run_replicate(condition, job.replicate, job.condition_json, hear)
        except Exception as error:
            trace = traceback.format_exc()
            is_late = isinstance(error, TookTooLong)
            reason = str(error) if is_late else f"{type(error).__name__}: {error}".splitlines()[0]
            may_pass = is_late or isinstance(error, MemoryError)
        wall_s = time.perf_counter() - start
        outcomes.append(Outcome(*job.key, reason, trace, content, wall_s, summary, may_pass))
    return outcomes


def condition_of(job: Job) -> Condition:
    """Build the condition of a job, with its files."""
    keep_all(job.files)
    return _condition(job.condition_json)


@functools.lru_cache(maxsize=64)
def _condition(config_json: bytes) -> Condition:
    """Build a condition once per process: checking it takes as long as a short run."""
    return Condition.from_json(config_json)
