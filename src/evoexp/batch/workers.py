"""Worker processes, each with a pipe of its own.

They are forked from a server, which a script that uses evoexp is no part of. It loads all libraries
once, and the kernels of a batch, and has no threads. A worker that dies closes its pipe: nobody
waits for it.
"""

import contextlib
import importlib
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection, Pipe, wait
from multiprocessing.reduction import recv_handle, send_handle
from queue import SimpleQueue
from typing import Any, NamedTuple, Self

from evoexp.errors import EvoexpError
from evoexp.numeric.cache_folder import cache_root

DIED_TWICE = "worker process died twice"  # the reason of a replicate that kills its worker
LIBRARIES = ("coal", "pinocchio", "evoexp.batch.jobs", "evoexp.batch.replicate")  # of all workers
MOST_LOST = 5  # [-] times that all workers may die before they have begun
ENDING_S = 5.0  # [s] in which the system ends a killed process
# signals that end a batch in an orderly way: the parent has them
_OF_THE_PARENT = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_NUM_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_ONE_THREAD = dict.fromkeys(_NUM_THREADS, "1")  # per library: the workers keep all cores busy


class WorkerError(EvoexpError):
    """Worker processes that cannot be started, or that die of a task again and again."""


class Answer(NamedTuple):
    """The end of a task: its result, or the error that it raised."""

    result: Any
    error: Exception | None = None


class Died(NamedTuple):
    """The end of a task whose worker died."""

    seconds: float  # [s] from the beginning of the task to the death


@dataclass(eq=False)
class _Worker:
    pipe: Connection
    process: int | None = None  # its number; None before its first message
    task: tuple[Any, ...] | None = None  # the arguments of what it is doing; None: nothing
    begun: float = 0.0  # when it was given that [s]


class Workers:
    """A number of worker processes, which end with the body of a `with` statement.

    A worker that dies is replaced, and so is the server.
    """

    def __init__(self, number: int) -> None:
        """Start the server, which loads libraries meanwhile."""
        cache_root()  # settled here, for the workers too
        self.number = number
        self._workers: dict[Connection, _Worker] = {}  # by their pipes
        self._num_lost = 0  # workers in a row that died before they had begun
        self._start_server()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        """End all workers and the server at once, whatever they do."""
        for worker in self._workers.values():
            if worker.process is not None:  # else it ends when its pipe closes
                with contextlib.suppress(OSError):
                    os.kill(worker.process, signal.SIGKILL)
        self._end_server()
        for pipe in self._workers:
            pipe.close()
        self._workers.clear()

    def call_first(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Let the server call a function before it forks workers; what it raises is lost."""
        with contextlib.suppress(ConnectionError):
            self._server_pipe.send(partial(function, *arguments))

    def results(
        self,
        function: Callable[..., Any],
        next_task: Callable[[int], tuple[Any, ...] | None],
        end_task: Callable[[tuple[Any, ...], Any | Died], Any | None],
    ) -> Iterator[Any]:
        """Do tasks as workers become free; yield results as they come, until none is left.

        A function is called in a worker with the arguments that are a task; its error is raised
        here. `next_task` gets the number of running tasks; `end_task` takes in a result and returns
        one for the caller, or None.
        """
        self._fill()
        finished: list[Any] = []
        task = next_task(0)
        while task is not None or self._num_running:
            workers = self._workers.values()
            idle = [w for w in workers if w.process is not None and w.task is None]
            while idle and task is not None:
                worker = idle.pop()
                worker.task, worker.begun = task, time.monotonic()
                content = pickle.dumps((function, task), pickle.HIGHEST_PROTOCOL)
                with contextlib.suppress(ConnectionError):  # it has died: its pipe tells
                    worker.pipe.send_bytes(content)
                task = next_task(self._num_running)
            yield from finished  # the workers are busy meanwhile
            finished = []
            for done, end in self._ends():
                if isinstance(end, Answer):
                    if end.error is not None:
                        raise end.error
                    end = end.result
                if (result := end_task(done, end)) is not None:
                    finished.append(result)
            if task is None:
                task = next_task(self._num_running)
        yield from finished

    @property
    def _num_running(self) -> int:
        return sum(worker.task is not None for worker in self._workers.values())

    def _ends(self) -> Iterator[tuple[tuple[Any, ...], Answer | Died]]:
        """Wait until some workers have said something or died; yield the ends of their tasks."""
        ready = wait(list(self._workers))
        for worker in [worker for pipe, worker in self._workers.items() if pipe in ready]:
            task, message = worker.task, None
            try:
                message = worker.pipe.recv()
            except (EOFError, OSError):  # it has died
                del self._workers[worker.pipe]
                worker.pipe.close()
                self._num_lost += worker.process is None
                if self._num_lost > MOST_LOST * self.number:
                    raise WorkerError("worker processes die before they start") from None
            if message is not None and worker.process is None:
                worker.process, self._num_lost = message, 0
            elif task is not None:
                worker.task = None
                yield task, message or Died(time.monotonic() - worker.begun)
        self._fill()

    def _fill(self) -> None:
        while len(self._workers) < self.number:
            ours, theirs = Pipe()
            self._workers[ours] = _Worker(ours)
            with theirs:  # where the server dies now, it is the end of the worker's, too
                try:
                    self._server_pipe.send(None)
                    send_handle(self._server_pipe, theirs.fileno(), self._server.pid)
                except ConnectionError:
                    reason = None
                    with contextlib.suppress(EOFError, ConnectionError):
                        reason = self._server_pipe.recv()
                    self._end_server()
                    if reason is not None:
                        raise reason from None
                    self._start_server()  # somebody killed it

    def _start_server(self) -> None:
        self._server_pipe, theirs = Pipe()
        code = "from evoexp.batch.workers import worker_server; worker_server()"
        paths = {"PYTHONPATH": os.pathsep.join(sys.path)}  # as another process would build it
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _OF_THE_PARENT)
        try:
            with theirs:
                self._server = subprocess.Popen(
                    [sys.executable, "-P", "-c", code, str(theirs.fileno()), *LIBRARIES],
                    pass_fds=[theirs.fileno()],
                    stdin=subprocess.DEVNULL,
                    env=os.environ | _ONE_THREAD | paths,
                )
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def _end_server(self) -> None:
        self._server_pipe.close()
        self._server.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._server.wait(ENDING_S)


def in_order(
    workers: Workers, function: Callable[..., Any], tasks: Iterable[tuple[Any, ...]]
) -> list[Any]:
    """Call a function in workers with the arguments of each task; return the results in order.

    A call whose worker dies is made once more; WorkerError is raised where it dies again.
    """
    waiting, died = deque(enumerate(tasks)), set[int]()

    def end_task(task: tuple[Any, ...], end: Any | Died) -> tuple[int, Any] | None:
        number = task[0]
        if not isinstance(end, Died):
            return number, end
        if number in died:
            raise WorkerError(f"a {DIED_TWICE}")
        died.add(number)
        waiting.appendleft((number, task[1]))
        return None

    def next_task(num_running: int) -> tuple[Any, ...] | None:
        return waiting.popleft() if waiting else None

    results = dict(workers.results(partial(_call, function), next_task, end_task))
    return [results[number] for number in sorted(results)]


def _call(function: Callable[..., Any], number: int, arguments: tuple[Any, ...]) -> Any:
    return function(*arguments)


def num_cores() -> int:
    """Return how many cores this process may use."""
    import joblib  # takes as long as a short command

    return int(joblib.cpu_count())


# the server, and the loop of a worker


def worker_server() -> None:
    """Load libraries, then make calls and fork a worker for every pipe, until the parent ends.

    The words of the process are the number of its own pipe, and names of modules to load.
    """
    parent = Connection(int(sys.argv[1]))
    try:
        for name in sys.argv[2:]:
            importlib.import_module(name)
    except Exception as error:
        parent.send(_sendable(error))
        return
    # workers that have ended stay zombies: the parent may still send a signal to their numbers
    with contextlib.suppress(EOFError, ConnectionError):
        while True:
            if (call := parent.recv()) is not None:
                with contextlib.suppress(Exception):
                    call()
                continue
            with Connection(recv_handle(parent)) as own:
                try:
                    is_worker = os.fork() == 0
                except OSError:  # no more processes or memory: the parent sees that the pipe closes
                    continue
                if is_worker:
                    parent.close()
                    _work(own)


def _work(own: Connection) -> None:
    """Tell the parent the number of this process, then do its tasks."""
    # a copy of this process that kept the pipe open would hide the worker's end
    os.register_at_fork(after_in_child=own.close)
    tasks: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(own, tasks), daemon=True).start()
    own.send(os.getpid())
    while True:
        try:
            function, arguments = pickle.loads(tasks.get())
            answer = pickle.dumps(Answer(function(*arguments)), pickle.HIGHEST_PROTOCOL)
        except Exception as error:
            answer = pickle.dumps(Answer(None, _sendable(error)))
        sys.stdout.flush()
        own.send_bytes(answer)


def _receive(own: Connection, tasks: "SimpleQueue[bytes]") -> None:
    """Take in tasks; end the process with its parent, whatever it does at that moment."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            tasks.put(own.recv_bytes())
    os._exit(0)


def _sendable(error: Exception) -> Exception:
    """Return an error that arrives as it was sent: some cannot be built from their text alone."""
    trace = "".join(traceback.format_exception(error))
    with contextlib.suppress(Exception):
        copy: Exception = pickle.loads(pickle.dumps(error))
        if str(copy) == str(error):
            copy.add_note(trace)
            return copy
    return EvoexpError(str(error)) if isinstance(error, EvoexpError) else RuntimeError(trace)
