"""The process that workers are forked from, and the loop of a worker.

The server loads all libraries once, and the kernels of a batch, and has no threads; see `workers`.
"""

import importlib
import os
import pickle
import sys
import threading
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle
from queue import SimpleQueue
from typing import Any, NamedTuple

from evoexp.errors import EvoexpError


class Answer(NamedTuple):
    """The end of a task: its result, or the error that it raised."""

    result: Any
    error: Exception | None = None


def main() -> None:
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
    with suppress(EOFError, ConnectionError):
        while True:
            if (call := parent.recv()) is not None:
                with suppress(Exception):
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
    with suppress(EOFError, OSError):
        while True:
            tasks.put(own.recv_bytes())
    os._exit(0)


def _sendable(error: Exception) -> Exception:
    """Return an error that arrives as it was sent: some cannot be built from their text alone."""
    trace = "".join(traceback.format_exception(error))
    with suppress(Exception):
        copy: Exception = pickle.loads(pickle.dumps(error))
        if str(copy) == str(error):
            copy.add_note(trace)
            return copy
    return EvoexpError(str(error)) if isinstance(error, EvoexpError) else RuntimeError(trace)
