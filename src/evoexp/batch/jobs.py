"""Replicates as tasks of worker processes: a `Job` goes out, an `Outcome` comes back.

Kernels of conditions are compiled, or loaded, before their replicates are timed: each kind of
condition searches for two generations and judges a motion; the server of worker processes does so
before it forks them.
"""

import contextlib
import functools
import itertools
import json
import os
import re
import time
import traceback
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.attachments import keep_all
from evoexp.batch.replicate_limits import ReplicateLimits, TookTooLong, limited
from evoexp.batch.workers import DIED_TWICE, Died, Workers
from evoexp.condition import Condition
from evoexp.records import Block, ReplicateSummary, generations

NO_LIMITS = ReplicateLimits()
LONGEST_TASK_S = 2.0  # [s] a task that has taken so long begins no further replicate
COMPILING_S = 600.0  # [s] that a short call may take; replicates that compile would be late, too
_NUMBER = re.compile(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?")
# [s] replicates are bundled into tasks of about this length; a task costs the parent some 2 ms
TASK_S = 0.2
MAX_BUNDLE = 64  # replicates per task at most, so that results keep streaming
INTERVAL_S = 0.2  # [s] between two files of a worker
NUM_POINTS = 48  # of a curve, at most

_written: dict[str, float] = {}  # folder → when this process left a curve there last


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
            reason = f"{type(error).__name__}: {error}".splitlines()[0]
            reason = limits.reason if is_late else reason
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


def warm_kernels(jobs: Iterable[Job], limits: ReplicateLimits, *, in_worker: bool = False) -> None:
    """Run every kernel that the conditions of jobs need; errors are left to the replicates."""
    from evoexp.paths.motion import Motion  # and numba
    from evoexp.planners.answers import judge_motion

    limits = limits._replace(timeout_s=max(limits.timeout_s or 0.0, COMPILING_S))
    for job in jobs:
        with contextlib.suppress(Exception), limited(limits, in_worker=in_worker):
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


# many replicates


def fan_out(
    jobs: Sequence[Job],
    workers: Workers | None,
    limits: ReplicateLimits = NO_LIMITS,
    curves: Path | None = None,
) -> Iterator[list[Outcome]]:
    """Run jobs in worker processes, or in this one; yield outcomes as they come.

    A worker that dies costs its own task: each job of that runs again in a task of its own. A job
    whose worker died of it alone, or that took too long or too much memory, runs once more at the
    end, beside no other. See `run_jobs` for the arguments.
    """
    if workers is None:
        for job in jobs:
            outcomes = run_jobs([job], limits, curves=curves)
            yield run_jobs([job], limits) if outcomes[0].may_pass else outcomes
        return
    run = functools.partial(run_jobs, limits=limits, in_worker=True, curves=curves)
    replicates = Replicates(jobs, workers.number, limits)
    yield from workers.results(run, replicates.next_task, replicates.end_task)


class Replicates:
    """Jobs on their way through workers, of this machine or of a cluster.

    They go in tasks of about `TASK_S`, by the times seen of late. Before any is seen, tasks are
    long, and end when they take too long: replicates that need the same library stand together,
    and are best run where it is loaded.
    """

    def __init__(self, jobs: Sequence[Job], num_workers: int, limits: ReplicateLimits) -> None:
        self._limits, self.num_workers, self._waiting = limits, num_workers, deque(jobs)
        self._seconds, self._count = 0.0, 0.0  # of the replicates that ended of late
        self._suspects: deque[Job] = deque()  # of tasks whose workers died; one per task now
        self._last: deque[Job] = deque()  # to be run a last time
        self._tried_last: set[tuple[str, int]] = set()

    def next_task(self, num_running: int) -> tuple[list[Job]] | None:
        """Return the next jobs for a worker; those of a last time run beside nothing."""
        if self._suspects:
            return ([self._suspects.popleft()],)
        if self._waiting:
            mean = self._seconds / self._count if self._count else 0.0
            fair = -(-len(self._waiting) // (2 * self.num_workers))
            size = max(1, min(MAX_BUNDLE, fair, int(TASK_S / max(mean, 1e-6))))
            return ([self._waiting.popleft() for _ in range(min(size, len(self._waiting)))],)
        return ([self._last.popleft()],) if self._last and not num_running else None

    def end_task(self, task: tuple[Any, ...], end: list[Outcome] | Died) -> list[Outcome] | None:
        """Take in the outcomes of jobs; return those that stand."""
        jobs: list[Job] = task[0]
        if isinstance(end, Died):
            if len(jobs) > 1:
                self._suspects += jobs
                return []
            reason, timeout_s = DIED_TWICE, self._limits.timeout_s
            if timeout_s is not None and end.seconds >= timeout_s:
                reason = f"{self._limits.reason}, in compiled code: its process was ended"
            after = f" {end.seconds:.1f} s after it began" if end.seconds else ""
            trace = f"The worker process was terminated{after}."
            end = [Outcome(*jobs[0].key, reason, trace, b"", end.seconds, may_pass=True)]
        # jobs that the task did not begin wait again; earlier times count half from now on, so
        # that slow first jobs are soon forgotten
        self._waiting.extendleft(reversed(jobs[len(end) :]))
        self._seconds = self._seconds / 2.0 + sum(outcome.wall_s for outcome in end)
        self._count = self._count / 2.0 + len(end)
        final = []
        for job, outcome in zip(jobs, end, strict=False):
            if outcome.may_pass and job.key not in self._tried_last:
                self._last.append(job)
                self._tried_last.add(job.key)
            else:
                final.append(outcome)
        return final


# convergence of running replicates: each worker leaves it in a file, now and then


class Curve(NamedTuple):
    """Convergence of a replicate so far."""

    condition_id: str  # 64 hex digits
    replicate: int  # its index
    generation: int  # the last one
    # best cost so far at up to `NUM_POINTS` generations, from the first to the last one; inf where
    # nothing is solved
    costs: list[float]


class CurveFile:
    """Hears the generations of one replicate, and leaves their convergence for others to see."""

    def __init__(self, folder: Path, condition_id: str, replicate: int) -> None:
        self._folder, self._of = folder, (condition_id, replicate)
        self._costs: list[float] = []

    def hear(self, block: Block) -> None:
        """Note generations; write at most every `INTERVAL_S`, whatever replicate is running."""
        self._costs += [float(best.cost) for best in block.best_of_each]
        now, key = time.monotonic(), str(self._folder)
        if now - _written.setdefault(key, now) < INTERVAL_S:
            return
        _written[key] = now
        last = len(self._costs) - 1
        steps = min(NUM_POINTS - 1, last)
        thinned = [self._costs[k * last // steps] for k in range(steps)] + self._costs[-1:]
        with contextlib.suppress(OSError):  # nobody looks any more, or the disk is full
            # read while it is written, it is left out of one frame
            curve = Curve(*self._of, last, thinned)
            (self._folder / f"{os.getpid()}.json").write_text(json.dumps(curve))


def read_curves(folder: Path) -> list[Curve]:
    """Return the curves that the workers left last, one of each."""
    curves = []
    for path in sorted(folder.glob("*.json")):
        with contextlib.suppress(OSError, ValueError, TypeError):
            curves.append(Curve(*json.loads(path.read_text())))
    return curves
