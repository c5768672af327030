"""A command's process ends as Python would end it, but for what nobody sees."""

import subprocess
import sys


def ended(code: str) -> tuple[int, str]:
    """Run code that ends by `leave(3)`; return exit code and what was printed."""
    whole = f"from evoexp.commands.quick_end import leave\n{code}\nleave(3)\nprint('went on')"
    found = subprocess.run([sys.executable, "-c", whole], capture_output=True, text=True)
    assert not found.stderr
    return found.returncode, found.stdout


def test_what_is_registered_for_the_end_is_called() -> None:
    code = "import atexit; atexit.register(lambda: print('registered', flush=True))"
    assert ended(code) == (3, "registered\n")


def test_threads_are_waited_for() -> None:
    code = (
        "from concurrent.futures import ThreadPoolExecutor; from time import sleep\n"
        "ThreadPoolExecutor(1).submit(lambda: (sleep(0.2), print('written', flush=True)))"
    )
    assert ended(code) == (3, "written\n")
