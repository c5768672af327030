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
from batch_samples import digests, run
from test_interruptions import COMMAND, HANGING, HERE, PATIENCE_S, alive

from evoexp.cli import KEPT
from evoexp.commands.interruption import Interrupted, Interruption
from evoexp.condition import Condition
from evoexp.store.run_directory import RunDirectory
from matrix import examples

PROGRESS = re.compile(r".{0,20}replicates|.*\d+/12 +\d+ failed")
LINE = f"evoexp: interrupted; {KEPT}"


class Terminal:
    """A command in a terminal of its own, and all that it shows."""

    def __init__(self, outputs: Path, plug_in: Path, faults: str) -> None:
        self.temporary = Path(tempfile.mkdtemp())  # short: a socket's path is
        paths = (str(plug_in), str(HERE), os.environ.get("PYTHONPATH", ""))
        environment = os.environ | {
            "EVOEXP_OUTPUTS": str(outputs),
            "PYTHONPATH": os.pathsep.join(paths),
            "FAULTY": faults,
            "TMPDIR": str(self.temporary),
        }
        self.shown = ""
        self._screen, own = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-c", _IN_TERMINAL, *COMMAND],
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
        while (left := end - time.monotonic()) > 0 and self._screen >= 0:
            if select.select([self._screen], [], [], left)[0]:
                try:
                    self.shown += os.read(self._screen, 65536).decode()
                except OSError:  # nobody writes any more
                    return

    def press_ctrl_c(self) -> None:
        """Press it."""
        with suppress(OSError):
            os.write(self._screen, b"\x03")

    def close(self) -> None:
        """Close its window."""
        os.close(self._screen)
        self._screen = -1

    def ended(self) -> int:
        """Wait for the command; return its exit code."""
        end = time.monotonic() + PATIENCE_S
        while self.process.poll() is None:
            assert time.monotonic() < end, self.shown
            self.look(0.05)
        self.look(0.2)
        return self.process.returncode

    def left(self) -> list[str]:
        """Return the processes that stay."""
        end = time.monotonic() + PATIENCE_S / 4
        while alive(self.process.pid) and time.monotonic() < end:
            time.sleep(0.05)
        return alive(self.process.pid)


# The terminal becomes the process's own; signals are handled when Python has started.
_IN_TERMINAL = """
import fcntl, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
from evoexp.cli import main
print("begun", flush=True)
sys.exit(main())
"""


@contextmanager
def terminal(outputs: Path, plug_in: Path, faults: str = HANGING) -> Iterator[Terminal]:
    window = Terminal(outputs, plug_in, faults)
    try:
        while "begun" not in window.shown:
            window.look(0.05)
            assert window.process.poll() is None, window.shown
        yield window
    finally:
        with suppress(ProcessLookupError):
            os.killpg(window.process.pid, signal.SIGKILL)
        window.process.wait()
        shutil.rmtree(window.temporary)


def once(window: Terminal) -> None:
    window.press_ctrl_c()


def repeatedly(window: Terminal) -> None:
    for _ in range(5):
        window.press_ctrl_c()
        window.look(0.04)


def terminate(window: Terminal) -> None:
    os.kill(window.process.pid, signal.SIGTERM)


def terminate_all(window: Terminal) -> None:
    os.killpg(window.process.pid, signal.SIGTERM)


WAYS = {once: 130, repeatedly: 130, terminate: 143, terminate_all: 143}


def check_ended(window: Terminal, way: Callable[[Terminal], None], folder: Path) -> None:
    # where a thread of a library never ends, the signal ends the process: the same to a shell
    assert window.ended() in (WAYS[way], 128 - WAYS[way]), window.shown
    lines = re.sub("\x1b\\[[?0-9;]*[a-zA-Z]|\\^C", "", window.shown).replace("\r", "\n")
    said = [line for line in lines.split("\n") if line.strip() and not PROGRESS.match(line)]
    # a line that is wider than the terminal goes on below, between words
    assert (said[0], " ".join(said[1:])) == ("begun", LINE), window.shown
    assert window.left() == []
    assert list(window.temporary.iterdir()) == [], "no socket is left"
    assert not list(folder.rglob("*.tmp"))


@pytest.mark.parametrize("way", examples(WAYS, lambda way: way is terminate))
def test_a_batch_ends_in_one_line_and_goes_on(
    way: Callable[[Terminal], None],
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    plug_in: Path,
) -> None:
    outputs = tmp_path / "there" / "outputs"
    outputs.mkdir(parents=True)
    with terminal(outputs, plug_in) as window:
        wait_for_logs(RunDirectory(outputs, faulty.id), 2, window)
        way(window)
        check_ended(window, way, outputs.parent)
    kept = digests(outputs, faulty)
    assert 2 <= len(kept) < 12
    run(outputs, (faulty, 12))
    assert digests(outputs, faulty) == undisturbed


def wait_for_logs(directory: RunDirectory, count: int, window: Terminal) -> None:
    end = time.monotonic() + PATIENCE_S
    while len(directory.completed()) < count:
        assert window.process.poll() is None, window.shown
        assert time.monotonic() < end
        window.look(0.02)


STARTING = {"libraries": 1, "server": 2, "workers": 4}  # processes there are at the least
EXAMPLES = ((repeatedly, "libraries"), (terminate_all, "server"))


@pytest.mark.parametrize(
    ("way", "step"),
    examples([(way, step) for way in WAYS for step in STARTING], EXAMPLES.__contains__),
)
def test_a_batch_that_starts_ends_in_one_line(
    way: Callable[[Terminal], None], step: str, tmp_path: Path, plug_in: Path
) -> None:
    """While it loads libraries, starts its server, or has all of its workers."""
    with terminal(tmp_path / "outputs", plug_in, "hang:0,1,2,3") as window:
        while len(alive(window.process.pid)) < STARTING[step]:
            window.look(0.01)
            assert window.process.poll() is None, window.shown
        way(window)
        check_ended(window, way, tmp_path)


def test_a_terminal_that_closes_ends_the_batch(
    faulty: Condition, tmp_path: Path, plug_in: Path
) -> None:
    outputs = tmp_path / "outputs"
    with terminal(outputs, plug_in) as window:
        wait_for_logs(RunDirectory(outputs, faulty.id), 2, window)
        window.close()
        assert window.ended() == 128 + signal.SIGHUP
        assert window.left() == []


# The handler by itself


@pytest.fixture
def heard() -> Iterator[Interruption]:
    """Hear signals in this process for the length of a test."""
    names = ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM")
    before = {getattr(signal, name): signal.getsignal(getattr(signal, name)) for name in names}
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
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            pass

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


LEFT = """
import os, signal, sys, threading
from evoexp import cli
from evoexp.commands import interruption

def command(words):
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

interruption.ENDING_S = 0.5
cli.command_module = lambda name: type("", (), {"main": command})
sys.exit(cli.main())
"""


def test_threads_that_an_interruption_leaves_behind_keep_nobody_waiting_and_say_nothing() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LEFT, "list"], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (-signal.SIGINT, "evoexp: interrupted\n")


def test_closing_that_never_ends_ends_the_process() -> None:
    code = (
        "import signal, time\nfrom evoexp.commands import interruption\n"
        "interruption.CLOSING_S = 0.5\ninterruption.Interruption().hear()\n"
        "try:\n    signal.raise_signal(signal.SIGINT)\nfinally:\n    time.sleep(600)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (-signal.SIGINT, "")


def test_signals_that_a_process_was_started_to_ignore_stay_ignored() -> None:
    code = (
        "import signal\nsignal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from evoexp.commands.interruption import Interruption\nInterruption().hear()\n"
        "signal.raise_signal(signal.SIGHUP)\nprint('still here')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "still here\n"
