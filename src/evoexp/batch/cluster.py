"""Replicates on a cluster of `distributed`, whose workers share nothing but the network.

Each task tells which code asked for it; a worker with other code refuses it, as its results could
be others.
"""

import contextlib
import functools
import hashlib
import logging
import math
import socket
import threading
import time
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from evoexp.batch.jobs import Job, Outcome, Replicates, one_of_each_kind, run_jobs, warm_kernels
from evoexp.batch.replicate_limits import ReplicateLimits
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.batch.workers import Died
from evoexp.errors import EvoexpError, Notice, printable
from evoexp.version import __version__

AHEAD = 2  # tasks per worker that are sent before earlier ones come back
POLL_S = 0.01  # [s] between looks for results of a cluster
COUNT_S = 5.0  # [s] between counts of its workers
SAY_S = 30.0  # [s] between two lines about them; a scheduler that is silent so long is named
DEATHS = 1  # of workers that a task may cause and still be tried again
_ALONE = threading.Lock()  # a worker of several threads runs one replicate at a time


class ClusterError(EvoexpError):
    """A cluster that cannot be used."""


def cluster_fan_out(
    jobs: Sequence[Job], settings: RunnerSettings, limits: ReplicateLimits
) -> Iterator[list[Outcome]]:
    """Run jobs on a cluster; yield outcomes as they come.

    Replicates are run again as in `fan_out`. A scheduler blames whatever waits on a worker that
    dies: the last time, a replicate runs beside no other.
    """
    try:
        import distributed
    except ImportError:
        must = "runner=dask needs distributed: pip install 'evoexp[cluster]'"
        raise ClusterError(must) from None
    kept = "finished replicates are kept, the same command runs the others"
    lost = distributed.CancelledError, distributed.comm.core.CommClosedError, ImportError
    # either is told below, in one line
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    place = f"at {printable(settings.address)}" if settings.address else "on this machine"
    with _client(distributed, settings) as client:
        workers, replicates = ClusterWorkers(client, place, limits), Replicates(jobs, 1, limits)
        sent: dict[str, tuple[list[Job]]] = {}  # by the key of the task
        with client.as_current():
            running: Any = distributed.as_completed()
        while True:
            replicates.num_workers = num_workers = max(1, workers.number())
            while len(sent) < AHEAD * num_workers and (task := replicates.next_task(len(sent))):
                arguments = (code_identity(), *task, limits)
                future = client.submit(run_checked, *arguments, pure=False, retries=0)
                sent[future.key] = task
                running.add(future)
            if not sent:
                return
            if not running.has_ready():
                time.sleep(POLL_S)
                continue
            future = next(running)
            try:
                with workers.patience():
                    end = future.result()
            except distributed.scheduler.KilledWorker:
                end = Died(0.0)  # the scheduler does not tell when it began
            except lost as error:
                reason = printable(str(error).splitlines()[0])
                must = f"a worker cannot run evoexp: {reason}"
                if isinstance(error, OSError) or "scheduler-" in reason:  # connection-lost, restart
                    must = f"the scheduler {place} went away; {kept}"
                raise ClusterError(f"runner.address: {must}") from None
            finally:
                future.release()
            if outcomes := replicates.end_task(sent.pop(future.key), end):
                yield outcomes


class ClusterWorkers:
    """Counts the workers of a cluster, which come and go, and says how many there are."""

    def __init__(self, client: Any, place: str, limits: ReplicateLimits) -> None:
        self._client, self._place, self._limits = client, place, limits
        self._number, self._line = 0, ""  # counted last; said last
        self._counted_at = self._said_at = -math.inf  # [s]

    def number(self) -> int:
        """Return the number of workers, counted at most `COUNT_S` ago."""
        if time.monotonic() - self._counted_at >= COUNT_S:
            with self.patience(), contextlib.suppress(OSError):  # it went away: the tasks tell
                self._number = len(self._client.nthreads())
                # distributed empties these now and then, until they are asked for again
                workers = self._client.scheduler_info(n_workers=-1)["workers"].values()
                num_alone = sum(not worker["nanny"] for worker in workers)
                line = f"{self._number} worker{'s' * (self._number != 1)}"
                if not self._number:
                    line = f"no workers at {time.strftime('%H:%M:%S')}, waiting for some"
                if num_alone and self._limits.timeout_s is not None:
                    line += (
                        f"; {num_alone} have no nanny and are lost if runner.timeout_s ends them"
                    )
                self._say(line)
            self._counted_at = time.monotonic()
        return self._number

    @contextlib.contextmanager
    def patience(self) -> Iterator[None]:
        """Say it if the scheduler, which may be suspended, does not answer what the body asks."""
        silence = f"the scheduler has not answered for {SAY_S:.0f} s, waiting for it"
        timer = threading.Timer(SAY_S, self._say, [silence])
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def _say(self, line: str) -> None:
        now = time.monotonic()
        if line != self._line and now - self._said_at >= SAY_S:
            warnings.warn(f"cluster {self._place}: {line}", Notice, stacklevel=2)
            self._line, self._said_at = line, now


def run_checked(code: str, jobs: Sequence[Job], limits: ReplicateLimits) -> list[Outcome]:
    """Run replicates in a worker of a cluster, if its code is that which asks for them."""
    if code != code_identity():
        must = f"must have evoexp {code}, has {code_identity()}"
        raise ClusterError(f"runner.address: the worker on {socket.gethostname()} {must}")
    with _ALONE:
        if limits.timeout_s is not None:  # no replicate is late because its worker compiles
            for job in one_of_each_kind(jobs):
                _warm(job._replace(replicate=0), limits)
        return run_jobs(jobs, limits, in_worker=True)


@functools.lru_cache(maxsize=64)
def _warm(job: Job, limits: ReplicateLimits) -> None:
    warm_kernels([job], limits, in_worker=True)


@functools.cache
def code_identity() -> str:
    """Return version and hash of evoexp's code, wherever it is installed."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(f"{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes())
    return f"{__version__} ({digest.hexdigest()[:12]})"


@contextlib.contextmanager
def _client(distributed: Any, settings: RunnerSettings) -> Iterator[Any]:
    """Connect to a scheduler, or to workers on this machine that end with the body."""
    if settings.address is not None:
        try:
            client = distributed.Client(settings.address, set_as_default=False)
        except (OSError, ValueError) as error:
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
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client
