"""Replicates as tasks of worker processes: a `Job` goes out, an `Outcome` comes back."""

import functools
import itertools
import math
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from evoexp.attachments import keep_all
from evoexp.batch.live_curves import CurveFile
from evoexp.batch.replicate_limits import ReplicateLimits, TookTooLong, limited
from evoexp.condition import Condition
from evoexp.records import Generation, ReplicateSummary

NO_LIMITS = ReplicateLimits()
LONGEST_TASK_S = 2.0  # [s] a task that has taken so long begins no further replicate
SHORT_S = 0.05  # [s] replicates shorter than this run step by step, several together:
TOGETHER = 16  # so many at most, and as many as take
MEMORY = 1 << 28  # [B] at most


class Job(NamedTuple):
    """One replicate to run.

    Attributes:
        condition_id: 64 hex digits.
        condition_json: Canonical form of the condition.
        replicate: Its index.
        files: Contents of the files that the condition refers to.
    """

    condition_id: str
    condition_json: bytes
    replicate: int
    files: tuple[bytes, ...] = ()

    @property
    def key(self) -> tuple[str, int]:
        """Names it among all jobs."""
        return self.condition_id, self.replicate


class Outcome(NamedTuple):
    """One replicate that ended.

    Attributes:
        condition_id: 64 hex digits.
        replicate: Its index.
        reason: Reason of a failure, in one line; empty when done.
        traceback: Of the failure.
        content: The finished log; dropped once it is written.
        wall_s: Duration [s].
        summary: The row that the log holds; None for a failed one.
        may_pass: Whether a failed one may be done another time: it took too long, or too much
            memory.
    """

    condition_id: str
    replicate: int
    reason: str
    traceback: str
    content: bytes
    wall_s: float
    summary: ReplicateSummary | None = None
    may_pass: bool = False

    @property
    def key(self) -> tuple[str, int]:
        """Names it among all jobs."""
        return self.condition_id, self.replicate

    @property
    def failed(self) -> bool:
        """Whether it ended without a log."""
        return bool(self.reason)


def run_jobs(
    jobs: Sequence[Job],
    limits: ReplicateLimits = NO_LIMITS,
    *,
    in_worker: bool = False,
    curves: Path | None = None,
) -> list[Outcome]:
    """Run replicates in this process, one after the other; a failure is an outcome.

    Args:
        jobs: The replicates.
        limits: Of each.
        in_worker: Whether this process is a worker.
        curves: Folder for their convergence while they run; None: it is not told.

    Returns:
        Their outcomes, one at least; no further replicate begins after `LONGEST_TASK_S`.
    """
    outcomes: list[Outcome] = []
    begun, mean_s = time.perf_counter(), math.inf
    while (done := len(outcomes)) < len(jobs):
        if outcomes and time.perf_counter() - begun > LONGEST_TASK_S:
            break
        are_short = mean_s < SHORT_S and limits.timeout_s is None and curves is None
        some = _alike(jobs[done - 1], jobs[done:]) if are_short else []
        new = _run_together(some, limits, in_worker) if some else None
        new = new or [_run_one(job, limits, in_worker, curves) for job in some or [jobs[done]]]
        outcomes += new
        mean_s = sum(each.wall_s for each in new) / len(new)
    return outcomes


def _alike(before: Job, jobs: Sequence[Job]) -> list[Job]:
    """Return the first jobs that may run together, behind one of the same condition."""
    alike = itertools.takewhile(lambda job: job.condition_id == before.condition_id, jobs)
    return list(itertools.islice(alike, TOGETHER))


def _run_together(
    jobs: Sequence[Job], limits: ReplicateLimits, in_worker: bool
) -> list[Outcome] | None:
    """Run short replicates of a condition step by step; None: one failed."""
    from evoexp.batch.replicate import run_together

    start, config_json = time.perf_counter(), jobs[0].condition_json
    try:
        condition = _condition(config_json)
        planner, problem = condition.prepare()
        jobs = jobs[: max(1, int(MEMORY // max(planner.memory(problem), 1.0)))]
        with limited(limits, in_worker=in_worker):
            found = run_together(condition, [job.replicate for job in jobs], config_json)
    except Exception:  # then each runs by itself, and tells its own failure
        return None
    seconds = (time.perf_counter() - start) / len(jobs)
    return [
        Outcome(job.condition_id, job.replicate, "", "", content, seconds, summary)
        for job, (content, summary) in zip(jobs, found, strict=True)
    ]


def _run_one(job: Job, limits: ReplicateLimits, in_worker: bool, curves: Path | None) -> Outcome:
    """Run one replicate; a failure is an outcome."""
    from evoexp.batch.replicate import run_replicate  # and numba: a parent needs neither

    start = time.perf_counter()
    try:
        keep_all(job.files)
        condition = _condition(job.condition_json)
        condition.prepare()
        with limited(limits, in_worker=in_worker):
            content, summary = run_replicate(
                condition, job.replicate, job.condition_json, _heard(curves, job)
            )
        reason, trace, may_pass = "", "", False
    except Exception as error:
        content, summary, trace = b"", None, traceback.format_exc()
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        reason = str(error) if isinstance(error, TookTooLong) else reason
        may_pass = isinstance(error, TookTooLong | MemoryError)
    seconds = time.perf_counter() - start
    return Outcome(
        job.condition_id, job.replicate, reason, trace, content, seconds, summary, may_pass
    )


def _heard(curves: Path | None, job: Job) -> Callable[[Generation], None] | None:
    return None if curves is None else CurveFile(curves, *job.key).hear


@functools.lru_cache(maxsize=64)
def _condition(config_json: bytes) -> Condition:
    """Build a condition once per process: checking it takes as long as a short run."""
    return Condition.from_json(config_json)
