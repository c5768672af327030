"""Worker processes that ignore Ctrl-C and SIGTERM, and end with their parent or soon after it."""

import gc
import multiprocessing
import os
import signal
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import chain
from multiprocessing import forkserver, resource_tracker
from multiprocessing.util import get_temp_dir
from typing import Any

import joblib
from joblib.externals.loky import reusable_executor
from joblib.externals.loky.backend import resource_tracker as loky_tracker
from joblib.externals.loky.backend.context import get_start_method, set_start_method
from joblib.externals.loky.process_executor import TerminatedWorkerError

from evoexp.numeric.kept_files import MESSAGES, cache_root

WATCH_S = 1.0  # [s] between two looks whether the parent is alive
LEFT_EARLY = "A worker stopped while some jobs were given to the executor"
"""Beginning of loky's warning of a worker that took ever more memory, and that it replaces."""

_OF_THE_PARENT = ("SIGINT", "SIGTERM", "SIGHUP")  # signals that end a batch in an orderly way
_RARE_SEARCHES, _PRELOADED = "evoexp.batch.rare_searches", "evoexp.batch.preloaded"
_LEAN_TRACKER = "evoexp.batch.lean_tracker"
_SERVED = "forkserver"  # the name of this way to start processes
_NUM_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(2**26), "MALLOC_TRIM_THRESHOLD_": str(2**28)}
_ENVIRONMENT = dict.fromkeys(_NUM_THREADS, "1") | _MEMORY
"""Environment of workers: one thread per library, as the replicates keep all cores busy.

With glibc, memory freed by one generation serves the next, instead of being fetched page by page
from the system.
"""


def start_server(modules: Iterable[str] = ()) -> None:
    """Start a server process that loads all common libraries, and from which workers are forked.

    Only for processes that are evoexp's own: it changes how all of joblib's workers start. Without
    it, or where processes cannot be forked, each worker loads everything by itself, later.

    Args:
        modules: More modules for it to load, which every worker would load.
    """
    if num_cores() == 1 or _SERVED not in multiprocessing.get_all_start_methods():
        return
    cache_root()  # settled here, for the server and the workers too
    loky_tracker.main.__module__ = _LEAN_TRACKER  # from which its process imports it
    multiprocessing.set_forkserver_preload([_RARE_SEARCHES, *modules, _PRELOADED])
    resource_tracker.ensure_running()  # lets signals through when it starts
    # The path of its socket may be too long, or its folder full.
    with suppress(OSError), _children_ignore_signals(), _environment_of_workers():
        forkserver.ensure_running()
        set_start_method(_SERVED, force=True)


def end_all() -> None:
    """End all workers and the server at once, for a process that leaves or starts them anew.

    None of them has anything to save: only this process writes. Nor is any of them waited for: one
    that died with the lock of the queue of tasks would keep all others from hearing that they may
    go.
    """
    _end_pool()
    server: Any = forkserver._forkserver
    if server._forkserver_pid is not None:
        with suppress(OSError):
            os.kill(server._forkserver_pid, signal.SIGKILL)
        server._stop()


def _end_pool() -> None:
    """End all workers at once."""
    pool = reusable_executor._executor
    if pool is None:
        return
    with suppress(RuntimeError):  # the thread that manages them was interrupted while it started
        pool.shutdown(wait=True, kill_workers=True)
    for worker in list(pool._processes.values()):  # there may be no such thread yet
        worker.kill()


def num_cores() -> int:
    """Return how many cores this process may use."""
    return int(joblib.cpu_count())


def in_workers(num_workers: int, tasks: Iterable[Any], ordered: bool = False) -> Iterator[Any]:
    """Start delayed calls in worker processes; yield their results, in order or as they come.

    Raises:
        TerminatedWorkerError: If a worker dies.
    """
    left, taken = iter(tasks), list[Any]()
    try:
        return _started(num_workers, _noted(left, taken), ordered)
    except (EOFError, ConnectionError):  # the server died just when it was to start a worker
        end_all()
        return _started(num_workers, chain(taken, left), ordered)


def _noted(tasks: Iterable[Any], taken: list[Any]) -> Iterator[Any]:
    """Yield tasks; note which were taken."""
    for task in tasks:
        taken.append(task)
        yield task


def _started(num_workers: int, tasks: Iterable[Any], ordered: bool) -> Iterator[Any]:
    """Start workers where there are none, and the server anew if it died; give them the tasks."""
    # Raised as an error, it would end the thread that hears of results, and nobody would know.
    warnings.filterwarnings("ignore", LEFT_EARLY, UserWarning)
    pool = joblib.Parallel(
        n_jobs=num_workers,
        batch_size=1,
        pre_dispatch=2 * num_workers,
        return_as="generator" if ordered else "generator_unordered",
        inner_max_num_threads=1,
        backend="loky",
        max_nbytes=None,  # tasks are bytes, no arrays to be shared
        temp_folder=get_temp_dir(),  # where the server's socket is: nobody else may enter it
        initializer=leave_with_parent,
        initargs=(os.getpid(), get_start_method() == _SERVED),
    )
    for tracker in (resource_tracker, loky_tracker):  # they let signals through when they start
        tracker.ensure_running()
    with _children_ignore_signals(), _environment_of_workers():
        results: Iterator[Any] = pool(tasks)
    return results


@contextmanager
def loading(num_workers: int, load: Callable[..., None], *arguments: Any) -> Iterator[None]:
    """Call `load` in every worker while the body runs; wait for the workers at its end.

    A worker that dies meanwhile, or before it is given anything, is no error: whoever gives work to
    workers starts new ones.
    """
    loaded: Iterator[Any] = iter(())
    with suppress(TerminatedWorkerError):
        loaded = in_workers(
            num_workers, (joblib.delayed(_load)(load, *arguments) for _ in range(num_workers))
        )
    try:
        yield
    finally:
        with suppress(TerminatedWorkerError):
            deque(loaded, maxlen=0)


def _load(load: Callable[..., None], *arguments: Any) -> None:
    """Load, then exempt everything loaded from the garbage collector's searches."""
    load(*arguments)
    gc.freeze()


def leave_with_parent(parent: int, served: bool) -> None:
    """End this process soon after its parent died: nobody takes its results any more."""
    MESSAGES.are_printed = False
    threading.Thread(target=_watch, args=(parent, served), daemon=True).start()


def _watch(parent: int, served: bool) -> None:
    origin = multiprocessing.parent_process()
    if served and origin is not None:  # the parent process is the server, which lives as long
        origin.join()
    else:
        while os.getppid() == parent:
            time.sleep(WATCH_S)
    os._exit(1)


@contextmanager
def _children_ignore_signals() -> Iterator[None]:
    """Let processes that start meanwhile inherit that what is meant for their parent is blocked.

    A signal that comes meanwhile is heard by this process at the end, whichever of its threads the
    system gives it to: some are not blocked, and an ignored signal would end there.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in _OF_THE_PARENT if hasattr(signal, name)]
    noted: list[int] = []
    before = {number: signal.getsignal(number) for number in numbers}
    blocked = _block(numbers)
    for number, handler in before.items():
        if callable(handler):
            signal.signal(number, lambda one, frame: noted.append(one))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if blocked is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        for number in noted[:1]:
            signal.raise_signal(number)


def _block(numbers: Iterable[int]) -> set[Any] | None:
    """Block signals in this thread; return those that were, None where that cannot be done."""
    if not hasattr(signal, "pthread_sigmask"):
        return None
    return signal.pthread_sigmask(signal.SIG_BLOCK, numbers)


@contextmanager
def _environment_of_workers() -> Iterator[None]:
    """Let processes that start meanwhile inherit the environment of workers."""
    before = {name: os.environ.get(name) for name in _ENVIRONMENT}
    os.environ.update(_ENVIRONMENT)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
