"""Fans jobs out to worker processes."""

import contextlib
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, cast

from evoexp.batch.jobs import NO_LIMITS, Job, Outcome, run_jobs
from evoexp.batch.replicate_limits import ReplicateLimits

# [s] replicates are bundled into tasks of about this length; a task costs the parent some 2 ms
TASK_S = 0.2
MAX_BUNDLE = 64  # replicates per task at most, so that results keep streaming


def fan_out(
    jobs: Sequence[Job],
    num_workers: int,
    limits: ReplicateLimits = NO_LIMITS,
    curves: Path | None = None,
) -> Iterator[list[Outcome]]:
    """Run jobs in worker processes; yield outcomes as they come.

    A worker that dies takes the pool with it, and everything in flight: each of those jobs then
    runs alone, so that only the one that kills its worker fails; the others go on in a new pool.
    A job that took too long or too much memory runs once more at the end, alone.

    Args:
        jobs: The replicates.
        num_workers: Worker processes; 1: they run in this process.
        limits: Of each replicate.
        curves: Folder for the convergence of those that are running; None: it is not told.
    """
    if num_workers == 1:
        for job in jobs:
            outcomes = run_jobs([job], limits, curves=curves)
            yield run_jobs([job], limits) if outcomes[0].may_pass else outcomes
        return
    import joblib  # which takes long to load
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    from evoexp.batch.workers import in_workers

    waiting = deque(jobs)
    by_key = {job.key: job for job in jobs}
    again: list[Job] = []
    run = joblib.delayed(partial(run_jobs, limits=limits, in_worker=True, curves=curves))
    while waiting:
        in_flight: dict[tuple[str, int], Job] = {}
        bundles = Bundles(waiting, in_flight, num_workers)
        try:
            for outcomes in in_workers(num_workers, (run(bundle) for bundle in bundles)):
                bundles.took(outcomes)
                again += [by_key[each.key] for each in outcomes if each.may_pass]
                yield [each for each in outcomes if not each.may_pass]
        except TerminatedWorkerError:
            for job in list(in_flight.values()):
                yield [_run_alone(job, limits)]
    for job in again:
        yield [_run_alone(job, limits)]


def loading(
    num_workers: int, load: Callable[..., None], *arguments: Any
) -> contextlib.AbstractContextManager[None]:
    """Call `load` in every worker while the body runs; without workers do nothing."""
    if num_workers == 1:
        return contextlib.nullcontext()
    from evoexp.batch import workers

    return workers.loading(num_workers, load, *arguments)


class Bundles:
    """Takes waiting jobs into tasks of about `TASK_S`, by the times seen of late.

    Before any is seen, tasks are long, and end when they take too long: replicates that need the
    same library stand together, and are best run where it is loaded.
    """

    def __init__(
        self, waiting: deque[Job], in_flight: dict[tuple[str, int], Job], num_workers: int
    ) -> None:
        self._waiting, self._in_flight, self._num_workers = waiting, in_flight, num_workers
        self._bundles: dict[tuple[str, int], list[Job]] = {}  # those in flight, by their first jobs
        self._seconds, self._count = 0.0, 0.0

    def __iter__(self) -> Iterator[list[Job]]:
        while self._waiting:
            mean = self._seconds / self._count if self._count else 0.0
            fair = -(-len(self._waiting) // (2 * self._num_workers))
            size = max(1, min(MAX_BUNDLE, fair, int(TASK_S / max(mean, 1e-6))))
            bundle = [self._waiting.popleft() for _ in range(min(size, len(self._waiting)))]
            for job in bundle:
                self._in_flight[job.key] = job
            self._bundles[bundle[0].key] = bundle
            yield bundle

    def took(self, outcomes: Sequence[Outcome]) -> None:
        """Note the outcomes of a task; jobs that it did not begin wait again.

        Earlier times count half from now on, so that slow first jobs are soon forgotten.
        """
        left = self._bundles.pop((outcomes[0].condition_id, outcomes[0].replicate))[len(outcomes) :]
        for job in reversed(left):
            del self._in_flight[job.key]
            self._waiting.appendleft(job)
        self._seconds, self._count = self._seconds / 2.0, self._count / 2.0
        for outcome in outcomes:
            self._seconds += outcome.wall_s
            self._count += 1
            self._in_flight.pop((outcome.condition_id, outcome.replicate), None)

    def lost(self, bundle: Sequence[Job]) -> None:
        """Forget a task whose jobs are run in another way."""
        self._bundles.pop(bundle[0].key)
        for job in bundle:
            self._in_flight.pop(job.key, None)


def _run_alone(job: Job, limits: ReplicateLimits) -> Outcome:
    """Run one job in a process of its own, and once more if that dies.

    Which job had brought the pool down is not known.
    """
    import joblib
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    from evoexp.batch.workers import in_workers

    run = joblib.delayed(partial(run_jobs, limits=limits, in_worker=True))
    trace, begun = "", time.perf_counter()
    for _ in range(2):
        begun = time.perf_counter()
        try:
            ((outcome,),) = in_workers(2, [run([job])])
            return cast(Outcome, outcome)
        except TerminatedWorkerError as error:
            trace = str(error)
    reason = "worker process died twice"
    if limits.timeout_s is not None and time.perf_counter() - begun >= limits.timeout_s:
        reason = f"{limits.reason}, in compiled code: its process was ended"
    return Outcome(job.condition_id, job.replicate, reason, trace, b"", 0.0)
