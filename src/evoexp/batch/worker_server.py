"""The process that workers are forked from, and the loop of a worker.

The server loads all libraries once. Each worker has a socket of its own and shares nothing with the
others: whatever it holds when it dies, nobody waits for it.
"""

import gc
import importlib
import mmap
import os
import pickle
import signal
import socket
import struct
import sys
import threading
import traceback
from collections.abc import Iterable
from contextlib import suppress
from queue import SimpleQueue
from typing import Any, NamedTuple

from evoexp.errors import EvoexpError

HEADER = struct.Struct("!Q")  # [B] length of the message behind it


class Answer(NamedTuple):
    """The end of a task: its result, or the error that it raised."""

    result: Any
    error: Exception | None = None


def main() -> None:
    """Load libraries, then fork a worker for every socket that arrives, until the parent ends.

    The words of the process are the number of its own socket, and names of modules to load.
    """
    door = socket.socket(fileno=int(sys.argv[1]))
    try:
        _load(sys.argv[2:])
    except (Exception, SystemExit) as error:
        with suppress(OSError):
            door.sendall(pickle.dumps(_sendable(error)))
        os._exit(1)
    workers: set[int] = set()
    with suppress(OSError):
        while True:
            _, descriptors, _, _ = socket.recv_fds(door, 1, 2)
            if not descriptors:
                break
            _forget_ended(workers)
            with suppress(OSError):  # no more processes or memory: the socket closes unused
                if (worker := os.fork()) == 0:
                    _begin(door, *descriptors)
                workers.add(worker)
            for descriptor in descriptors:
                os.close(descriptor)
    _forget_ended(workers)
    for worker in workers:  # the parent is gone: nobody takes their results
        os.kill(worker, signal.SIGKILL)
    os._exit(0)


def _load(modules: Iterable[str]) -> None:
    """Load what workers share.

    One kernel is called as well: at the first call numba sets up what all compiled kernels need.
    All that is loaded stays. Workers do not look through it for garbage: a search takes a sixteenth
    of a second in each of them, as every page that it touches is copied.
    """
    import coal  # noqa: F401
    import numpy as np
    import pinocchio  # noqa: F401

    from evoexp.batch import jobs, replicate  # noqa: F401
    from evoexp.evolution.cost_statistics import cost_statistics

    for module in modules:
        importlib.import_module(module)
    cost_statistics(np.zeros(1))
    gc.freeze()


def _forget_ended(workers: set[int]) -> None:
    """Remove workers that have ended; the numbers of the others stay theirs."""
    with suppress(ChildProcessError):
        while (ended := os.waitpid(-1, os.WNOHANG)[0]) != 0:
            workers.discard(ended)


def _begin(door: socket.socket, descriptor: int, first: int | None = None) -> None:
    """Work in a new process; never return.

    Args:
        door: The server's socket, which is closed.
        descriptor: Number of the worker's socket.
        first: Number of a file with the call that comes before all tasks; None: there is none.
    """
    try:
        door.close()
        own = socket.socket(fileno=descriptor)
        os.register_at_fork(after_in_child=own.close)  # else a copy would hide the worker's end
        _work(own, first)
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(1)


def _work(own: socket.socket, first: int | None) -> None:
    """Make the first call, tell the parent the number of this process, then do its tasks."""
    tasks: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(own, tasks), daemon=True).start()
    if first is not None:
        with mmap.mmap(first, 0, access=mmap.ACCESS_READ) as call:
            _answer(call)
        os.close(first)
        gc.freeze()
    send(own, pickle.dumps(os.getpid()))
    while True:
        answer = _answer(tasks.get())
        try:
            content = pickle.dumps(answer, pickle.HIGHEST_PROTOCOL)
        except Exception as error:
            content = pickle.dumps(Answer(None, _sendable(error)))
        del answer
        sys.stdout.flush()
        send(own, content)


def _answer(task: bytes | mmap.mmap) -> Answer:
    """Call the function of a task with its argument."""
    try:
        function, arguments = pickle.loads(task)
        return Answer(function(*arguments))
    except Exception as error:
        return Answer(None, _sendable(error))


def _sendable(error: BaseException) -> Exception:
    """Return an error that arrives as it was sent: some cannot be built from their text alone."""
    with suppress(Exception):
        copy = pickle.loads(pickle.dumps(error))
        if isinstance(copy, Exception) and str(copy) == str(error):
            copy.add_note("".join(traceback.format_exception(error)))
            return copy
    if isinstance(error, EvoexpError):
        return EvoexpError(str(error))
    return RuntimeError("".join(traceback.format_exception(error)))


def _receive(own: socket.socket, tasks: "SimpleQueue[bytes]") -> None:
    """Take in tasks; end the process with its parent, whatever it does at that moment."""
    with suppress(OSError), own.makefile("rb") as stream:
        while len(header := stream.read(HEADER.size)) == HEADER.size:
            tasks.put(stream.read(*HEADER.unpack(header)))
    os._exit(0)


def send(own: socket.socket, content: bytes) -> None:
    """Send a message."""
    own.sendall(HEADER.pack(len(content)))
    own.sendall(content)
