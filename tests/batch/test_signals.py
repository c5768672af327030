"""Ctrl-C in a terminal, once and repeatedly, SIGTERM and a terminal that closes, at any moment.

One line, the exit code that a shell expects, nobody left, and the same command goes on.
"""

import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from batch_samples import WORDS, around_plug_in, digests, run
from process_table import PATIENCE_S, eventually, of_group

from evoexp.cli import KEPT
from evoexp.commands.command_process import Interrupted, Interruption
from evoexp.condition import Condition
from evoexp.errors import Busy
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import read_summaries
from matrix import examples

COMMAND = ["run", *WORDS, "runner.num_workers=2", "--no-report"]
HANGING = "hang:6,7,8,9,10,11"  # these take an hour; the first task of each worker ends
PROGRESS = re.compile(r".{0,20}replicates|.*\d+/12 +\d+ failed")
LINE = f"evoexp: interrupted; {KEPT}"
# The terminal becomes the process's own; signals are handled when Python has started.
IN_TERMINAL = """
import fcntl, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
from evoexp.cli import main
print("begun", flush=True)
sys.exit(main())
"""


class Terminal:
    """A command in a terminal of its own, and all that it shows."""

    def __init__(self, outputs: Path, plug_in: Path, faults: str) -> None:
        self.temporary = Path(tempfile.mkdtemp())  # short: a socket's path is
        environment = around_plug_in(plug_in, outputs)
        environment |= {"FAULTY": faults, "TMPDIR": str(self.temporary)}
        self.shown = ""
        self.screen, own = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-c", IN_TERMINAL, *COMMAND],
            env=environment,
            stdin=own,
            stdout=own,
            stderr=own,
            start_new_session=True,
        )
        os.close(own)

    def look(self, seconds: float) -> None:
        """Read what is shown meanwhile."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0 and self.screen >= 0:
            if select.select([self.screen], [], [], left)[0]:
                try:
                    self.shown += os.read(self.screen, 65536).decode()
                except OSError:  # nobody writes any more
                    return

    def look_until(self, holds: Callable[[], object]) -> None:
        """Read until something holds that is to happen before the command ends."""
        end = time.monotonic() + PATIENCE_S
        while not holds():
            assert self.process.poll() is None and time.monotonic() < end, self.shown
            self.look(0.02)

    def ended(self) -> int:
        """Wait for the command and all of its processes; return its exit code."""
        end = time.monotonic() + PATIENCE_S
        while self.process.poll() is None:
            assert time.monotonic() < end, self.shown
            self.look(0.05)
        self.look(0.2)
        assert eventually(lambda: not of_group(self.process.pid), PATIENCE_S / 4)
        return self.process.returncode


@contextmanager
def terminal(outputs: Path, plug_in: Path, faults: str = HANGING) -> Iterator[Terminal]:
    window = Terminal(outputs, plug_in, faults)
    try:
        window.look_until(lambda: "begun" in window.shown)
        yield window
    finally:
        with suppress(ProcessLookupError):
            os.killpg(window.process.pid, signal.SIGKILL)
        window.process.wait()
        shutil.rmtree(window.temporary)


def once(window: Terminal) -> None:
    with suppress(OSError):
        os.write(window.screen, b"\x03")


def repeatedly(window: Terminal) -> None:
    for _ in range(5):
        once(window)
        window.look(0.04)


def terminate(window: Terminal) -> None:
    os.kill(window.process.pid, signal.SIGTERM)


def terminate_all(window: Terminal) -> None:
    os.killpg(window.process.pid, signal.SIGTERM)


def close(window: Terminal) -> None:
    os.close(window.screen)
    window.screen = -1


WAYS = {once: 130, repeatedly: 130, terminate: 143, terminate_all: 143, close: 129}
# processes there are at the least: it loads libraries, starts its server, has all of its workers
STEPS = {"libraries": 1, "server": 2, "workers": 4, "logs": 4}
EXAMPLES = (
    *((repeatedly, "libraries"), (terminate_all, "server")),
    *((way, "logs") for way in (once, terminate, close)),
)


def check_ended(window: Terminal, way: Callable[[Terminal], None], folder: Path) -> None:
    # where a thread of a library never ends, the signal ends the process: the same to a shell
    assert window.ended() in (WAYS[way], 128 - WAYS[way]), window.shown
    lines = re.sub("\x1b\\[[?0-9;]*[a-zA-Z]|\\^C", "", window.shown).replace("\r", "\n")
    said = [line for line in lines.split("\n") if line.strip() and not PROGRESS.match(line)]
    # a line that is wider than the terminal goes on below, between words
    assert way is close or (said[0], " ".join(said[1:])) == ("begun", LINE), window.shown
    assert list(window.temporary.iterdir()) == [], "no socket is left"
    assert not list(folder.rglob("*.tmp"))


EVERY = [(way, step) for way in WAYS for step in STEPS if way is not close or step == "logs"]


@pytest.mark.parametrize(("way", "step"), examples(EVERY, EXAMPLES.__contains__))
def test_a_batch_ends_in_one_line_and_goes_on(
    way: Callable[[Terminal], None],
    step: str,
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    plug_in: Path,
) -> None:
    outputs = tmp_path / "there" / "outputs"
    directory = RunDirectory(outputs, faulty.id)
    outputs.mkdir(parents=True)
    least = 2 if step == "logs" else 0
    with terminal(outputs, plug_in, HANGING if least else "hang:0,1,2,3") as window:
        window.look_until(lambda: len(of_group(window.process.pid)) >= STEPS[step])
        window.look_until(lambda: len(directory.completed()) >= least)
        if least:
            with pytest.raises(Busy, match="another process is writing it now"):
                run(outputs, (faulty, 12))
        way(window)
        check_ended(window, way, outputs.parent)
    if least:
        kept = digests(outputs, faulty)
        assert least <= len(kept) < 12
        assert read_summaries(directory)["replicate"].tolist() == sorted(kept)
        run(outputs, (faulty, 12))
        assert digests(outputs, faulty) == undisturbed
        assert read_summaries(directory)["digest"].tolist() == list(undisturbed.values())


# The handler by itself


@pytest.fixture
def heard() -> Iterator[Interruption]:
    """Hear signals in this process for the length of a test."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM)
    before = {number: signal.getsignal(number) for number in numbers}
    hooks = sys.unraisablehook, sys.excepthook, threading.excepthook
    interruption = Interruption()
    interruption.hear()
    yield interruption
    interruption.end()
    signal.setitimer(signal.ITIMER_REAL, 0.0)  # which would end this process
    sys.unraisablehook, sys.excepthook, threading.excepthook = hooks
    for number, handler in before.items():
        signal.signal(number, handler)


def test_a_library_that_catches_everything_does_not_keep_a_batch_alive(
    heard: Interruption,
) -> None:
    def go_on() -> None:
        with suppress(BaseException):
            signal.raise_signal(signal.SIGTERM)
        eventually(lambda: False)

    with pytest.raises(Interrupted):
        go_on()
    assert heard.exit_code == 143


def test_cleaning_up_is_not_interrupted(heard: Interruption) -> None:
    cleaned = []

    def generate() -> Iterator[int]:
        try:
            yield 1
        finally:
            time.sleep(0.6)
            signal.raise_signal(signal.SIGINT)
            cleaned.append("generator")

    def interrupted() -> None:
        generator = generate()
        try:
            next(generator)
            signal.raise_signal(signal.SIGINT)
        finally:
            signal.raise_signal(signal.SIGTERM)
            generator.close()
            cleaned.append("finally")

    with pytest.raises(Interrupted):
        interrupted()
    heard.end()
    signal.raise_signal(signal.SIGINT)
    assert cleaned == ["generator", "finally"]
    assert heard.exit_code == 130


COMMANDS = """
import os, signal, sys, threading, time
from evoexp import cli
from evoexp.commands import command_process

def leave_threads(words):
    threading.Thread(target=threading.Event().wait).start()  # whom nobody will tell anything
    interrupted = threading.Event()
    broken = threading.Thread(target=lambda: interrupted.wait() and 1 / 0)
    broken.start()
    try:
        os.kill(os.getpid(), signal.SIGINT)
        interrupted.wait()
    finally:
        interrupted.set()
        broken.join()

def wait_for_ever(words):
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        threading.Event().wait(60)
    finally:
        threading.Event().wait()  # a library that waits for somebody who is gone

class Slow:
    def __del__(self, sleep=time.sleep):
        sleep(1.0)  # what Python takes down last

def interrupt(words):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(60)

def run(command):
    cli.command_function = lambda name: command
    sys.exit(cli.main())

def close_for_ever():
    command_process.Interruption().hear()
    try:
        signal.raise_signal(signal.SIGINT)
    finally:
        time.sleep(600)

def ignore():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    command_process.Interruption().hear()
    signal.raise_signal(signal.SIGHUP)
"""


@pytest.mark.parametrize(
    ("code", "returncode", "complaint"),
    [
        ("command_process.ENDING_S = 0.5; run(leave_threads)", -2, "evoexp: interrupted\n"),
        (
            "command_process.ENDING_S = 0.3; kept = Slow(); run(interrupt)",
            130,
            "evoexp: interrupted\n",
        ),
        ("command_process.PATIENCE_S = 0.5; run(wait_for_ever)", 143, "evoexp: interrupted\n"),
        ("command_process.CLOSING_S = 0.5; close_for_ever()", -2, ""),
        ("ignore()", 0, ""),  # a signal that the process was started to ignore
    ],
)
def test_nothing_keeps_an_interrupted_process(code: str, returncode: int, complaint: str) -> None:
    words = [sys.executable, "-c", COMMANDS + code, "list"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)
    assert (done.returncode, done.stderr) == (returncode, complaint)
