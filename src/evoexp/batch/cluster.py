"""Replicates on a cluster of `distributed`: descriptions go out, bytes come back.

Nothing is shared but the network. Each task tells which code asked for it; a worker with other code
refuses it, as its results could be others.
"""

import hashlib
import logging
import socket
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from evoexp.batch.fan_out import Replicates
from evoexp.batch.jobs import NO_LIMITS, Job, Outcome, run_jobs
from evoexp.batch.replicate_limits import ReplicateLimits
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.batch.workers import Died
from evoexp.errors import EvoexpError, printable
from evoexp.version import __version__

AHEAD = 2  # tasks per worker that are sent before earlier ones come back
DEATHS = 1  # of workers that a task may cause and still be tried again
_ALONE = threading.Lock()  # a worker of several threads runs one replicate at a time


class ClusterError(EvoexpError):
    """A cluster that cannot be used."""


def cluster_fan_out(
    jobs: Sequence[Job], settings: RunnerSettings, limits: ReplicateLimits = NO_LIMITS
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
    # a lost scheduler is told below, in one line
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    with _client(distributed, settings) as client:
        num_workers = max(1, len(client.scheduler_info(n_workers=-1)["workers"]))
        replicates = Replicates(jobs, num_workers, limits)
        sent: dict[str, tuple[list[Job]]] = {}  # by the key of the task
        running: Any = distributed.as_completed(loop=client.loop)
        while True:
            while len(sent) < AHEAD * num_workers and (task := replicates.next_task(len(sent))):
                arguments = (code_identity(), *task, limits)
                future = client.submit(run_checked, *arguments, pure=False, retries=0)
                sent[future.key] = task
                running.add(future)
            if not sent:
                return
            future = next(running)
            try:
                end = future.result()
            except distributed.scheduler.KilledWorker:
                end = Died(0.0)  # the scheduler does not tell when it began
            except (ModuleNotFoundError, distributed.CancelledError) as error:
                reason = printable(str(error).splitlines()[0])
                if "scheduler-" in reason:  # connection-lost, restart
                    raise ClusterError(
                        f"runner.address: the scheduler at {client.scheduler.address} went away; "
                        "finished replicates are stored: run again for the others"
                    ) from None
                must = f"runner.address: a worker cannot run evoexp: {reason}"
                raise ClusterError(must) from None
            finally:
                future.release()
            if outcomes := replicates.end_task(sent.pop(future.key), end):
                yield outcomes


def run_checked(code: str, jobs: Sequence[Job], limits: ReplicateLimits) -> list[Outcome]:
    """Run replicates in a worker of a cluster, if its code is that which asks for them."""
    if code != code_identity():
        raise ClusterError(
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
