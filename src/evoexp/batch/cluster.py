"""Replicates on a cluster of `distributed`: descriptions go out, bytes come back.

Nothing is shared but the network: a worker writes nothing but its own cache of kernels, and the
parent alone writes results. Each task tells which code asked for it; a worker with other code
refuses it, as its results could be others.
"""

import hashlib
import logging
import socket
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from evoexp.batch.fan_out import Bundles
from evoexp.batch.jobs import NO_LIMITS, Job, Outcome, run_jobs
from evoexp.batch.replicate_limits import ReplicateLimits
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.errors import EvoexpError, printable
from evoexp.version import __version__

AHEAD = 2  # tasks per worker that are sent before earlier ones come back
DEATHS = 1  # of workers that a task may cause and still be tried again
_ALONE = threading.Lock()  # a worker of several threads runs one replicate at a time


class ClusterError(EvoexpError):
    """A cluster that cannot be used."""


class OtherCode(EvoexpError):
    """A worker with another version of evoexp."""


def cluster_fan_out(
    jobs: Sequence[Job], settings: RunnerSettings, limits: ReplicateLimits = NO_LIMITS
) -> Iterator[list[Outcome]]:
    """Run jobs on a cluster; yield outcomes as they come.

    A worker that dies costs its own replicate one retry; so does a replicate that takes too long or
    too much memory.

    Args:
        jobs: The replicates.
        settings: Address of the scheduler, or the number of workers of a cluster on this machine.
        limits: Of each replicate.

    Raises:
        ClusterError: If there is no such cluster, or a worker has another version of evoexp.
    """
    try:
        import distributed
    except ImportError:
        must = "runner=dask needs distributed: pip install 'evoexp[cluster]'"
        raise ClusterError(must) from None
    with _client(distributed, settings) as client:
        yield from _Spread(distributed, client, jobs, limits).outcomes()


class _Spread:
    """Jobs on their way through a cluster."""

    def __init__(
        self, distributed: Any, client: Any, jobs: Sequence[Job], limits: ReplicateLimits
    ) -> None:
        self._distributed, self._client, self._limits = distributed, client, limits
        self._waiting, self._in_flight = deque(jobs), dict[tuple[str, int], Job]()
        self._num_workers = max(1, len(client.scheduler_info(n_workers=-1)["workers"]))
        self._bundles = Bundles(self._waiting, self._in_flight, self._num_workers)
        self._sent: dict[str, list[Job]] = {}  # by the key of the task
        self._alone: deque[Job] = deque()  # those that run once more, one per task
        self._tried: set[tuple[str, int]] = set()
        # A scheduler blames whatever waits on a worker that dies: whoever is blamed when it ran in
        # a task of its own runs a last time, beside nothing.
        self._blamed: deque[Job] = deque()
        self._judged: set[tuple[str, int]] = set()
        self._running: Any = distributed.as_completed(loop=client.loop)

    def outcomes(self) -> Iterator[list[Outcome]]:
        """Send tasks, and yield their outcomes."""
        while self._send():
            future = next(self._running)
            bundle = self._sent.pop(future.key)
            try:
                done = future.result()
            except self._distributed.scheduler.KilledWorker as error:
                yield list(self._after_death(bundle, str(error).splitlines()[0]))
                continue
            except OtherCode as error:
                raise ClusterError(str(error)) from None
            except (ModuleNotFoundError, self._distributed.CancelledError) as error:
                reason = printable(str(error).splitlines()[0])
                raise ClusterError(
                    f"runner.address: a worker cannot run evoexp: {reason}"
                ) from None
            finally:
                future.release()
            if len(bundle) > 1 or bundle[0].key not in self._tried:
                self._bundles.took(done)
            yield list(self._final(done, {job.key: job for job in bundle}))

    def _send(self) -> bool:
        """Keep every worker busy; return whether anything runs."""
        while len(self._sent) < AHEAD * self._num_workers:
            bundle = next(iter(self._bundles), None)
            if bundle is None and self._alone:
                bundle = [self._alone.popleft()]
            if bundle is None and self._blamed and not self._sent:
                bundle = [self._blamed.popleft()]
                self._judged.add(bundle[0].key)
            if bundle is None:
                break
            future = self._client.submit(
                run_checked, code_identity(), bundle, self._limits, pure=False, retries=0
            )
            self._sent[future.key] = bundle
            self._running.add(future)
        return bool(self._sent)

    def _final(
        self, done: Sequence[Outcome], jobs: dict[tuple[str, int], Job]
    ) -> Iterator[Outcome]:
        """Yield the outcomes that stand; what may pass another time waits for it."""
        for outcome in done:
            if outcome.may_pass and outcome.key not in self._tried:
                self._tried.add(outcome.key)
                self._alone.append(jobs[outcome.key])
            else:
                yield outcome

    def _after_death(self, bundle: list[Job], reason: str) -> Iterator[Outcome]:
        """Let the jobs of a task whose workers died run alone; yield the one that killed them."""
        if bundle[0].key not in self._tried:
            self._bundles.lost(bundle)
        for job in bundle:
            if job.key in self._tried and job.key not in self._judged:
                self._blamed.append(job)
            elif job.key in self._judged:
                text = "worker process died twice"
                yield Outcome(job.condition_id, job.replicate, text, reason, b"", 0.0)
            else:
                self._tried.add(job.key)
                self._alone.append(job)


def run_checked(code: str, jobs: Sequence[Job], limits: ReplicateLimits) -> list[Outcome]:
    """Run replicates in a worker of a cluster, if its code is that which asks for them.

    Raises:
        OtherCode: If it is not.
    """
    if code != code_identity():
        raise OtherCode(
            f"runner.address: the worker on {socket.gethostname()} must have evoexp {code}, has "
            f"{code_identity()}"
        )
    with _ALONE:
        return run_jobs(jobs, limits, in_worker=True)


@cache
def code_identity() -> str:
    """Return version and hash of evoexp's code, wherever it is installed."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(f"{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes())
    return f"{__version__} ({digest.hexdigest()[:12]})"


@contextmanager
def _client(distributed: Any, settings: RunnerSettings) -> Iterator[Any]:
    """Connect to a scheduler, or to workers on this machine that end with the body."""
    if settings.address is not None:
        try:
            client = distributed.Client(settings.address, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            reason = printable(str(error).splitlines()[0]) if str(error) else "no answer"
            must = "runner.address: must be the address of a scheduler that answers"
            raise ClusterError(f"{must}, was {printable(settings.address)} ({reason})") from None
        with client:
            yield client
        return
    import dask

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": DEATHS}),
        distributed.LocalCluster(
            n_workers=settings.num_workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client
