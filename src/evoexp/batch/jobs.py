"""Replicates as tasks of worker processes: a `Job` goes out, an `Outcome` comes back.

Kernels of conditions are compiled, or loaded, before their replicates are timed: each kind of
condition searches for two generations and judges a motion; the server of worker processes does so
before it forks them.
"""

import contextlib
import functools
import itertools
import re
import time
import traceback
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from evoexp.attachments import keep_all
from evoexp.batch.live_curves import CurveFile
from evoexp.batch.replicate_limits import ReplicateLimits, TookTooLong, limited
from evoexp.condition import Condition
from evoexp.records import ReplicateSummary, generations

NO_LIMITS = ReplicateLimits()
LONGEST_TASK_S = 2.0  # [s] a task that has taken so long begins no further replicate
COMPILING_S = 600.0  # [s] that a short call may take; replicates that compile would be late, too
_NUMBER = re.compile(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?")


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


def one_of_each_kind(jobs: Iterable[Job]) -> list[Job]:
    """Return jobs that need all kernels that any needs: numbers make no difference."""
    texts = {job.condition_json: job for job in jobs}
    return list({_NUMBER.sub(b"0", text): job for text, job in texts.items()}.values())


def warm_kernels(jobs: Iterable[Job], limits: ReplicateLimits) -> None:
    """Run every kernel that the conditions of jobs need; errors are left to the replicates."""
    from evoexp.paths.motion import Motion  # and numba
    from evoexp.planners.proofs import judge_motion

    limits = limits._replace(timeout_s=max(limits.timeout_s or 0.0, COMPILING_S))
    for job in jobs:
        with contextlib.suppress(Exception), limited(limits, in_worker=False):
            condition = condition_of(job)
            planner, problem = condition.prepare()
            # a reference takes long; it needs the kernels of the planner beside it
            searching = planner.planner if condition.is_reference else planner
            search = generations(searching.evolve(problem, condition.rng(0)))
            *_, solution = [generation.best.copy() for generation in itertools.islice(search, 2)]
            searching.evaluate(problem, solution)
            motion = searching.motion(problem, solution)
            judge_motion(searching, problem, motion)
            if motion is not None:  # what touches nothing needs the kernels of the closest approach
                judge_motion(searching, problem, Motion(motion.q[[0, 0]]))
