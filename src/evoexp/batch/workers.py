"""Worker processes, each with a socket of its own.

They are forked from a server that has loaded all libraries (see `worker_server`). Results are read
as they arrive, from whichever worker has sent some bytes: half a message of a worker that died
keeps nobody waiting. The end of a worker is told by the system, whatever it held.
"""

import contextlib
import os
import pickle
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import IO, Any, NamedTuple, Protocol, Self

from evoexp.batch.worker_server import HEADER, Answer, send
from evoexp.errors import EvoexpError
from evoexp.numeric.cache_folder import cache_root

DIED_TWICE = "worker process died twice"  # the reason of a replicate that kills its worker
MOST_LOST = 5  # [-] times that all workers may die before they have begun
SENDING_S = 60.0  # [s] in which a worker without work takes in a task
_CHUNK = 2**20  # [B] read at once
_OF_THE_PARENT = ("SIGINT", "SIGTERM", "SIGHUP")  # signals that end a batch in an orderly way
_NUM_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(2**26), "MALLOC_TRIM_THRESHOLD_": str(2**28)}
_ENVIRONMENT = dict.fromkeys(_NUM_THREADS, "1") | _MEMORY
"""Environment of workers: one thread per library, as the replicates keep all cores busy.

With glibc, memory freed by one generation serves the next, instead of being fetched page by page
from the system.
"""


class WorkerError(EvoexpError):
    """Worker processes that cannot be started, or that die of a task again and again."""


class Died(NamedTuple):
    """The end of a task whose worker died.

    Attributes:
        seconds: From the beginning of the task to the death [s].
    """

    seconds: float


class Work(Protocol):
    """Tasks for workers, and what becomes of their ends."""

    def next_task(self, num_running: int) -> tuple[Any, ...] | None:
        """Return the arguments of the next call; None if there is none now.

        Args:
            num_running: Tasks that are running.
        """

    def end_task(self, task: tuple[Any, ...], end: Any | Died) -> Any | None:
        """Take in the result of a task; return one for the caller, or None."""


class _Worker:
    """One worker process.

    Attributes:
        socket: Its messages arrive here.
        process: Its number; None before its first message.
        watch: A file that is readable when the process has ended; None where the system has none.
        task: The arguments of what it is doing; None: nothing.
        begun: When it was given that [s].
    """

    def __init__(self, own: socket.socket) -> None:
        own.setblocking(False)
        self.socket = own
        self.process: int | None = None
        self.watch: int | None = None
        self.task: tuple[Any, ...] | None = None
        self.begun = 0.0
        self._received = bytearray()

    def begin(self, process: int) -> None:
        """Note that the process has begun."""
        self.process = process
        if hasattr(os, "pidfd_open"):
            with contextlib.suppress(OSError):  # it has just died, or the system has no such thing
                self.watch = os.pidfd_open(process)

    def give(self, function: Callable[..., Any], task: tuple[Any, ...]) -> None:
        """Send a task; a worker that does not take it in is killed."""
        self.task, self.begun = task, time.monotonic()
        self.socket.settimeout(SENDING_S)
        try:
            send(self.socket, pickle.dumps((function, task), pickle.HIGHEST_PROTOCOL))
        except TimeoutError:
            self.kill()
        except OSError:  # it has died, which is noticed by its watch or its socket
            pass
        self.socket.setblocking(False)

    def receive(self) -> bool:
        """Take in some bytes that wait; return whether there were any."""
        content = b""
        with contextlib.suppress(OSError):
            content = self.socket.recv(_CHUNK)
        self._received += content
        return bool(content)

    def messages(self) -> Iterator[Any]:
        """Yield the messages that have arrived as a whole."""
        while len(self._received) >= HEADER.size:
            (size,) = HEADER.unpack_from(self._received)
            if len(self._received) < (end := HEADER.size + size):
                return
            with memoryview(self._received) as view, view[HEADER.size : end] as content:
                message = pickle.loads(content)
            del self._received[:end]
            yield message

    def kill(self) -> None:
        """End the process at once; it has nothing to save."""
        with contextlib.suppress(OSError):
            if self.watch is not None:
                signal.pidfd_send_signal(self.watch, signal.SIGKILL)
            elif self.process is not None:
                os.kill(self.process, signal.SIGKILL)

    def close(self) -> None:
        """Close its files; a process whose number is not known yet ends by this."""
        self.socket.close()
        if self.watch is not None:
            os.close(self.watch)


class Workers:
    """A number of worker processes, which end with the body of a `with` statement.

    A worker that dies is replaced, and so is the server.

    Attributes:
        number: Of workers.
    """

    def __init__(self, number: int, modules: Iterable[str] = ()) -> None:
        """Start the server, which loads libraries meanwhile.

        Args:
            number: Of workers.
            modules: More modules for it to load, which every worker would load.
        """
        cache_root()  # settled here, for the workers too
        self.number, self._modules = number, tuple(modules)
        self._selector = selectors.DefaultSelector()
        self._workers: list[_Worker] = []
        self._num_lost = 0  # workers in a row that died before they had begun
        self._start_server()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        """End all workers and the server at once, whatever they do."""
        for worker in self._workers:
            worker.kill()
            worker.close()
        self._workers.clear()
        self._selector.close()
        self._end_server()

    def start(self, function: Callable[..., None] | None = None, *arguments: Any) -> None:
        """Start all workers; let each of them call a function before its first task.

        An error that it raises is left to the tasks. A worker that dies of it is replaced by one
        that does not call it.
        """
        if function is None:
            self._fill()
            return
        with tempfile.TemporaryFile() as first:  # a socket holds some kilobytes only
            pickle.dump((function, arguments), first)
            first.flush()
            self._fill(first)

    def results(self, function: Callable[..., Any], work: Work) -> Iterator[Any]:
        """Do tasks as workers become free; yield results as they come.

        Args:
            function: Called in a worker with the arguments that are a task.
            work: The tasks. They are done when there is none and none is running.

        Raises:
            WorkerError: If workers cannot be started.
            Exception: An error that the function raised.
        """
        self._fill()
        finished: list[Any] = []
        while True:
            while worker := self._idle():
                if (task := work.next_task(self._num_running)) is None:
                    break
                worker.give(function, task)
            yield from finished  # the workers are busy meanwhile
            finished = []
            if not self._num_running:
                if (task := work.next_task(0)) is None:
                    return
                while (worker := self._idle()) is None:
                    self._wait()
                worker.give(function, task)
            for task, end in self._wait():
                if isinstance(end, Answer):
                    if end.error is not None:
                        raise end.error
                    end = end.result
                if (result := work.end_task(task, end)) is not None:
                    finished.append(result)

    @property
    def _num_running(self) -> int:
        return sum(worker.task is not None for worker in self._workers)

    def _idle(self) -> _Worker | None:
        """Return a worker that has begun and does nothing."""
        idle = (w for w in self._workers if w.process is not None and w.task is None)
        return next(idle, None)

    def _wait(self) -> list[tuple[tuple[Any, ...], Answer | Died]]:
        """Wait until some workers have said something or died; return the ends of their tasks."""
        ends: list[tuple[tuple[Any, ...], Answer | Died]] = []
        ready: dict[_Worker, set[int]] = {}
        for key, _ in self._selector.select():
            ready.setdefault(key.data, set()).add(key.fd)
        for worker, files in ready.items():
            has_ended = worker.watch in files
            has_said = worker.receive()
            while has_ended and worker.receive():  # all that it had sent
                pass
            for message in worker.messages():
                if worker.process is None:
                    self._begin(worker, message)
                elif worker.task is not None:
                    ends.append((worker.task, message))
                    worker.task = None
            if has_ended or not has_said:
                if worker.task is not None:
                    ends.append((worker.task, Died(time.monotonic() - worker.begun)))
                self._bury(worker)
        self._fill()
        return ends

    def _begin(self, worker: _Worker, process: int) -> None:
        worker.begin(process)
        if worker.watch is not None:
            self._selector.register(worker.watch, selectors.EVENT_READ, worker)
        self._num_lost = 0

    def _bury(self, worker: _Worker) -> None:
        """Forget a worker that has died.

        Raises:
            WorkerError: If none ever begins.
        """
        self._workers.remove(worker)
        for file in (worker.socket, worker.watch):
            if file is not None:
                self._selector.unregister(file)
        worker.kill()  # it may have closed its socket only
        worker.close()
        if worker.process is not None:
            return
        self._num_lost += 1
        reason = b""
        with contextlib.suppress(BlockingIOError, ConnectionError):
            reason = self._door.recv(_CHUNK, socket.MSG_DONTWAIT)
        if reason:  # why the server cannot load libraries
            raise pickle.loads(reason)
        if self._num_lost > MOST_LOST * self.number:
            raise WorkerError("worker processes die before they have begun")

    def _fill(self, first: IO[bytes] | None = None) -> None:
        """Start workers until they are as many as they should be."""
        while len(self._workers) < self.number:
            ours, theirs = socket.socketpair()
            files = [theirs.fileno(), *([first.fileno()] if first else [])]
            with theirs:  # where the server dies now, it is the end of the worker's, too
                if not self._asked(files):
                    self._end_server()
                    self._start_server()
                    self._asked(files)
            worker = _Worker(ours)
            self._workers.append(worker)
            self._selector.register(ours, selectors.EVENT_READ, worker)

    def _asked(self, files: Sequence[int]) -> bool:
        """Ask the server for a worker with these files; return whether it lives."""
        try:
            socket.send_fds(self._door, [b"w"], files)
        except ConnectionError:
            return False
        return True

    def _start_server(self) -> None:
        self._door, theirs = socket.socketpair()
        code = "from evoexp.batch.worker_server import main; main()"
        paths = {"PYTHONPATH": os.pathsep.join(sys.path)}  # as another process would build it
        with theirs, _signals_blocked():
            self._server = subprocess.Popen(
                [sys.executable, "-P", "-c", code, str(theirs.fileno()), *self._modules],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                env=os.environ | _ENVIRONMENT | paths,
            )

    def _end_server(self) -> None:
        self._door.close()
        self._server.kill()
        self._server.wait()


class _InOrder:
    """Calls whose results are yielded in order; one whose worker dies is made once more."""

    def __init__(self, calls: Iterable[tuple[Any, ...]]) -> None:
        self._waiting = deque((place, call) for place, call in enumerate(calls))
        self._died: set[int] = set()

    def next_task(self, num_running: int) -> tuple[int, tuple[Any, ...]] | None:
        return self._waiting.popleft() if self._waiting else None

    def end_task(
        self, task: tuple[int, tuple[Any, ...]], end: Any | Died
    ) -> tuple[int, Any] | None:
        place, _ = task
        if not isinstance(end, Died):
            return place, end
        if place in self._died:
            raise WorkerError(f"a {DIED_TWICE}")
        self._died.add(place)
        self._waiting.appendleft(task)
        return None


def in_order(
    workers: Workers, function: Callable[..., Any], tasks: Iterable[tuple[Any, ...]]
) -> Iterator[Any]:
    """Call a function in workers with the arguments of each task; yield results in order.

    Raises:
        WorkerError: If a task kills its worker twice.
    """
    early: dict[int, Any] = {}
    place = 0
    call = partial(_called, function)
    for ended, result in workers.results(call, _InOrder(tasks)):
        early[ended] = result
        while place in early:
            yield early.pop(place)
            place += 1


def _called(function: Callable[..., Any], place: int, arguments: tuple[Any, ...]) -> Any:
    return function(*arguments)


def num_cores() -> int:
    """Return how many cores this process may use."""
    import joblib  # takes as long as a short command

    return int(joblib.cpu_count())


@contextlib.contextmanager
def _signals_blocked() -> Iterator[None]:
    """Let processes that start meanwhile inherit that what is meant for their parent is blocked."""
    numbers = [getattr(signal, name) for name in _OF_THE_PARENT]
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
