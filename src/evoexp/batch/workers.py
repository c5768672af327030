"""Worker processes, each with a socket of its own.

They are forked from a server that has loaded all libraries (see `worker_server`), which a script
that uses evoexp is no part of. Results are read as they arrive, from whichever worker has sent
some bytes: half a message of a worker that died keeps nobody waiting.
"""

import contextlib
import os
import pickle
import selectors
import signal
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple, Protocol, Self

from evoexp.batch.worker_server import CALL, FORK, HEADER, Answer, send
from evoexp.errors import EvoexpError
from evoexp.numeric.cache_folder import cache_root

DIED_TWICE = "worker process died twice"  # the reason of a replicate that kills its worker
LIBRARIES = ("coal", "pinocchio", "evoexp.batch.jobs", "evoexp.batch.replicate")  # of all workers
MOST_LOST = 5  # [-] times that all workers may die before they have begun
ENDING_S = 5.0  # [s] in which the system ends a killed process
_CHUNK = 2**20  # [B] read at once
_OF_THE_PARENT = ("SIGINT", "SIGTERM", "SIGHUP")  # signals that end a batch in an orderly way
_NUM_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_ONE_THREAD = dict.fromkeys(_NUM_THREADS, "1")  # per library: the workers keep all cores busy


class WorkerError(EvoexpError):
    """Worker processes that cannot be started, or that die of a task again and again."""


class Died(NamedTuple):
    """The end of a task whose worker died."""

    seconds: float  # [s] from the beginning of the task to the death


class Work(Protocol):
    """Tasks for workers, and what becomes of their ends."""

    def next_task(self, num_running: int) -> tuple[Any, ...] | None:
        """Return the arguments of the next call; None if there is none now."""

    def end_task(self, task: tuple[Any, ...], end: Any | Died) -> Any | None:
        """Take in the result of a task; return one for the caller, or None."""


class _Worker:
    """One worker process.

    Attributes:
        socket: Its messages arrive here.
        process: Its number; None before its first message.
        task: The arguments of what it is doing; None: nothing.
        begun: When it was given that [s].
        has_ended: Whether its socket is closed.
    """

    def __init__(self, own: socket.socket) -> None:
        self.socket = own
        self.process: int | None = None
        self.task: tuple[Any, ...] | None = None
        self.begun, self.has_ended = 0.0, False
        self._received = bytearray()

    def give(self, function: Callable[..., Any], task: tuple[Any, ...]) -> None:
        """Send a task."""
        self.task, self.begun = task, time.monotonic()
        with contextlib.suppress(ConnectionError):  # it has died, which is noticed by its socket
            send(self.socket, pickle.dumps((function, task), pickle.HIGHEST_PROTOCOL))

    def messages(self) -> Iterator[Any]:
        """Read the bytes that wait; yield the messages that have arrived as a whole."""
        content = b""
        with contextlib.suppress(ConnectionError):
            content = self.socket.recv(_CHUNK)
        self.has_ended = not content
        self._received += content
        while len(self._received) >= HEADER.size:
            (size,) = HEADER.unpack_from(self._received)
            if len(self._received) < (end := HEADER.size + size):
                return
            message = pickle.loads(self._received[HEADER.size : end])
            del self._received[:end]
            yield message

    def kill(self) -> None:
        """End the process at once; one whose number is not known ends when its socket closes."""
        if self.process is not None:
            with contextlib.suppress(OSError):
                os.kill(self.process, signal.SIGKILL)


class Workers:
    """A number of worker processes, which end with the body of a `with` statement.

    A worker that dies is replaced, and so is the server.

    Attributes:
        number: Of workers.
    """

    def __init__(self, number: int) -> None:
        """Start the server, which loads libraries meanwhile."""
        cache_root()  # settled here, for the workers too
        self.number = number
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
        self._end_server()
        for worker in self._workers:
            worker.socket.close()
        self._workers.clear()
        self._selector.close()

    def call_first(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Let the server call a function before it forks workers, which find what that loaded.

        What it returns or raises is lost, and where it ends the server, workers find nothing.
        """
        content = pickle.dumps((function, arguments), pickle.HIGHEST_PROTOCOL)
        with contextlib.suppress(ConnectionError):
            self._server_socket.sendall(CALL)
            send(self._server_socket, content)

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
        task = work.next_task(0)
        while task is not None or self._num_running:
            idle = [w for w in self._workers if w.process is not None and w.task is None]
            while idle and task is not None:
                idle.pop().give(function, task)
                task = work.next_task(self._num_running)
            yield from finished  # the workers are busy meanwhile
            finished = []
            for done, end in self._wait():
                if isinstance(end, Answer):
                    if end.error is not None:
                        raise end.error
                    end = end.result
                if (result := work.end_task(done, end)) is not None:
                    finished.append(result)
            if task is None:
                task = work.next_task(self._num_running)
        yield from finished

    @property
    def _num_running(self) -> int:
        return sum(worker.task is not None for worker in self._workers)

    def _wait(self) -> list[tuple[tuple[Any, ...], Answer | Died]]:
        """Wait until some workers have said something or died; return the ends of their tasks."""
        ends: list[tuple[tuple[Any, ...], Answer | Died]] = []
        for key, _ in self._selector.select():
            worker: _Worker = key.data
            for message in worker.messages():
                if worker.process is None:
                    worker.process, self._num_lost = message, 0
                elif worker.task is not None:
                    ends.append((worker.task, message))
                    worker.task = None
            if worker.has_ended:
                if worker.task is not None:
                    ends.append((worker.task, Died(time.monotonic() - worker.begun)))
                self._forget(worker)
        self._fill()
        return ends

    def _forget(self, worker: _Worker) -> None:
        """Forget a worker that has died.

        Raises:
            WorkerError: If none ever begins.
        """
        self._workers.remove(worker)
        self._selector.unregister(worker.socket)
        worker.socket.close()
        self._num_lost += worker.process is None
        if self._num_lost > MOST_LOST * self.number:
            raise WorkerError("worker processes die before they have begun")

    def _fill(self) -> None:
        """Start workers until they are as many as they should be."""
        while len(self._workers) < self.number:
            ours, theirs = socket.socketpair()
            self._workers.append(worker := _Worker(ours))
            self._selector.register(ours, selectors.EVENT_READ, worker)
            with theirs:  # where the server dies now, it is the end of the worker's, too
                try:
                    socket.send_fds(self._server_socket, [FORK], [theirs.fileno()])
                except ConnectionError:
                    self._restart_server()

    def _start_server(self) -> None:
        self._server_socket, theirs = socket.socketpair()
        code = "from evoexp.batch.worker_server import main; main()"
        paths = {"PYTHONPATH": os.pathsep.join(sys.path)}  # as another process would build it
        with theirs, _signals_blocked():
            self._server = subprocess.Popen(
                [sys.executable, "-P", "-c", code, str(theirs.fileno()), *LIBRARIES],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                env=os.environ | _ONE_THREAD | paths,
            )

    def _restart_server(self) -> None:
        reason = b""
        with contextlib.suppress(ConnectionError):
            reason = self._server_socket.recv(_CHUNK)
        self._end_server()
        if reason:
            raise pickle.loads(reason)
        self._start_server()  # somebody killed it

    def _end_server(self) -> None:
        self._server_socket.close()
        self._server.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._server.wait(ENDING_S)


class _Numbered:
    """Calls with their numbers; one whose worker dies is made once more."""

    def __init__(self, calls: Iterable[tuple[Any, ...]]) -> None:
        self._waiting = deque(enumerate(calls))
        self._died = set[int]()

    def next_task(self, num_running: int) -> tuple[int, tuple[Any, ...]] | None:
        return self._waiting.popleft() if self._waiting else None

    def end_task(self, task: tuple[int, tuple[Any, ...]], end: Any) -> tuple[int, Any] | None:
        number, _ = task
        if not isinstance(end, Died):
            return number, end
        if number in self._died:
            raise WorkerError(f"a {DIED_TWICE}")
        self._died.add(number)
        self._waiting.appendleft(task)
        return None


def in_order(
    workers: Workers, function: Callable[..., Any], tasks: Iterable[tuple[Any, ...]]
) -> Iterator[Any]:
    """Call a function in workers with the arguments of each task; give the results in order.

    Raises:
        WorkerError: If a task kills its worker twice.
    """
    results = dict(workers.results(partial(_call, function), _Numbered(tasks)))
    return (results[number] for number in range(len(results)))


def _call(function: Callable[..., Any], number: int, arguments: tuple[Any, ...]) -> Any:
    return function(*arguments)


def num_cores() -> int:
    """Return how many cores this process may use."""
    import joblib  # takes as long as a short command

    return int(joblib.cpu_count())


@contextlib.contextmanager
def _signals_blocked() -> Iterator[None]:
    """Block the signals that end a batch in processes started meanwhile: the parent has them."""
    numbers = [getattr(signal, name) for name in _OF_THE_PARENT]
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
