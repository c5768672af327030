"""The process that workers are forked from, and the loop of a worker.

The server loads all libraries once, and the kernels of a batch, and has no threads. Each worker has
a socket of its own and shares nothing with the others: whatever it holds when it dies, nobody waits
for it.
"""

import importlib
import os
import pickle
import socket
import struct
import sys
import threading
import traceback
from contextlib import suppress
from queue import SimpleQueue
from typing import Any, NamedTuple

from evoexp.errors import EvoexpError

HEADER = struct.Struct("!Q")  # [B] length of the message behind it
FORK, CALL = b"f", b"c"  # what the server is told: a socket comes along, or a call is behind it


class Answer(NamedTuple):
    """The end of a task: its result, or the error that it raised."""

    result: Any
    error: Exception | None = None


def main() -> None:
    """Load libraries, then make calls and fork a worker for every socket, until the parent ends.

    The words of the process are the number of its own socket, and names of modules to load.
    """
    parent = socket.socket(fileno=int(sys.argv[1]))
    try:
        for name in sys.argv[2:]:
            importlib.import_module(name)
    except Exception as error:
        parent.sendall(pickle.dumps(_sendable(error)))
        return
    # workers that have ended stay zombies: the parent may still send a signal to their numbers
    while (told := socket.recv_fds(parent, 1, 1))[0]:
        word, descriptors, *_ = told
        if word == CALL:
            header = parent.recv(HEADER.size, socket.MSG_WAITALL)
            if len(header) == HEADER.size:  # else the parent has ended
                (size,) = HEADER.unpack(header)
                _answer(parent.recv(size, socket.MSG_WAITALL))
            continue
        with socket.socket(fileno=descriptors[0]) as own:
            try:
                is_worker = os.fork() == 0
            except OSError:  # no more processes or memory: the parent sees that the socket closes
                continue
            if is_worker:
                parent.close()
                _work(own)


def _work(own: socket.socket) -> None:
    """Tell the parent the number of this process, then do its tasks."""
    # a copy of this process that kept the socket open would hide the worker's end
    os.register_at_fork(after_in_child=lambda: os.close(own.detach()))
    tasks: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(own, tasks), daemon=True).start()
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


def _receive(own: socket.socket, tasks: "SimpleQueue[bytes]") -> None:
    """Take in tasks; end the process with its parent, whatever it does at that moment."""
    with suppress(OSError), own.makefile("rb") as stream:
        while len(header := stream.read(HEADER.size)) == HEADER.size:
            tasks.put(stream.read(*HEADER.unpack(header)))
    os._exit(0)


def _answer(task: bytes) -> Answer:
    """Call the function of a task with its arguments."""
    try:
        function, arguments = pickle.loads(task)
        return Answer(function(*arguments))
    except Exception as error:
        return Answer(None, _sendable(error))


def _sendable(error: Exception) -> Exception:
    """Return an error that arrives as it was sent: some cannot be built from their text alone."""
    trace = "".join(traceback.format_exception(error))
    with suppress(Exception):
        copy: Exception = pickle.loads(pickle.dumps(error))
        if str(copy) == str(error):
            copy.add_note(trace)
            return copy
    return EvoexpError(str(error)) if isinstance(error, EvoexpError) else RuntimeError(trace)


def send(own: socket.socket, content: bytes) -> None:
    """Send a message."""
    own.sendall(HEADER.pack(len(content)))
    own.sendall(content)
