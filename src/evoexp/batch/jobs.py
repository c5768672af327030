"""Replicates as tasks: a description goes out, what became of it comes back.

All that a worker process loads.
"""

import contextlib
import functools
import time
import traceback
from collections.abc import Sequence
from typing import NamedTuple

from evoexp.attachments import keep_all
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.records import ReplicateSummary

LONGEST_TASK_S = 2.0  # [s] a task that has taken so long begins no further replicate


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
        reason: Why it failed, in one line; empty when done.
        traceback: Of the failure.
        content: The finished log; dropped once it is written.
        wall_s: How long it took.
        summary: The row that the log holds; None for a failed one.
    """

    condition_id: str
    replicate: int
    reason: str
    traceback: str
    content: bytes
    wall_s: float
    summary: ReplicateSummary | None = None

    @property
    def failed(self) -> bool:
        """Whether it ended without a log."""
        return bool(self.reason)


def run_jobs(jobs: Sequence[Job]) -> list[Outcome]:
    """Run some replicates, here, one after the other; a failure is an outcome.

    Returns:
        Their outcomes; of fewer than were asked for if they take longer than `LONGEST_TASK_S`, of
        one at least.
    """
    outcomes: list[Outcome] = []
    begun = time.perf_counter()
    for job in jobs:
        start = time.perf_counter()
        if outcomes and start - begun > LONGEST_TASK_S:
            break
        try:
            keep_all(job.files)
            condition = _condition(job.condition_json)
            (content, summary), reason, trace = (
                run_replicate(condition, job.replicate, job.condition_json),
                "",
                "",
            )
        except Exception as error:
            content, summary, trace = b"", None, traceback.format_exc()
            reason = f"{type(error).__name__}: {error}".splitlines()[0]
        seconds = time.perf_counter() - start
        outcomes.append(
            Outcome(job.condition_id, job.replicate, reason, trace, content, seconds, summary)
        )
    return outcomes


def load(config_jsons: Sequence[bytes], files: Sequence[bytes] = ()) -> None:
    """Load what some conditions need, code and compiled kernels.

    What is wrong with one is said by its jobs.
    """
    keep_all(files)
    for config_json in config_jsons:
        with contextlib.suppress(Exception):
            _condition(config_json).prepare()


@functools.lru_cache(maxsize=64)
def _condition(config_json: bytes) -> Condition:
    """Return the condition of a canonical form.

    Checking it takes as long as a short run, hence once per process.
    """
    return Condition.from_json(config_json)
