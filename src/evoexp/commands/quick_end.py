"""Start and end of a short process: no search for garbage at the start, no taking apart at the end.

Imported modules stay, so searches for garbage while Python imports find none. And freeing
one by one the objects of numba, LLVM and Pinocchio takes a quarter of a second when Python ends.
"""

import atexit
import gc
import os
import sys
import threading
from typing import NoReturn

NEW_OBJECTS = 100_000  # [-] between two searches for garbage; by default 700


def search_less() -> None:
    """Look for garbage more rarely."""
    gc.set_threshold(NEW_OBJECTS, 20, 100)


def leave(code: int) -> None:
    """End this process as Python does: threads first, then functions registered for its end.

    Nothing is done where there are worker processes. Standard output and error are flushed already.
    """
    if "evoexp.batch.workers" in sys.modules:
        return
    getattr(threading, "_shutdown", lambda: None)()
    leave_at_once(code)


def leave_at_once(code: int) -> NoReturn:
    """End this process without its threads: they may wait for what an interrupted one left undone.

    Nothing is lost by that: what they write are files that nobody has the name of yet.
    """
    atexit._run_exitfuncs()
    os._exit(code)
