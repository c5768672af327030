"""Fans jobs out to worker processes."""

from collections import deque
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from evoexp.batch.jobs import NO_LIMITS, Job, Outcome, run_jobs
from evoexp.batch.replicate_limits import ReplicateLimits
from evoexp.batch.workers import DIED_TWICE, Died, Workers

# [s] replicates are bundled into tasks of about this length; a task costs the parent some 2 ms
TASK_S = 0.2
MAX_BUNDLE = 64  # replicates per task at most, so that results keep streaming


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
    run = partial(run_jobs, limits=limits, in_worker=True, curves=curves)
    replicates = Replicates(jobs, workers.number, limits)
    yield from workers.results(run, replicates.next_task, replicates.end_task)


class Replicates:
    """Jobs on their way through workers, of this machine or of a cluster.

    They go in tasks of about `TASK_S`, by the times seen of late. Before any is seen, tasks are
    long, and end when they take too long: replicates that need the same library stand together,
    and are best run where it is loaded.
    """

    def __init__(self, jobs: Sequence[Job], num_workers: int, limits: ReplicateLimits) -> None:
        self._limits, self._num_workers, self._waiting = limits, num_workers, deque(jobs)
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
            fair = -(-len(self._waiting) // (2 * self._num_workers))
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
            trace = f"The worker process was terminated {end.seconds:.1f} s after it began."
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
