"""Start and end of a short process: no search for garbage at the start, no taking apart at the end.

Imported modules stay, so searches for garbage while Python imports find none. And freeing
one by one the objects of numba, LLVM and Pinocchio takes a quarter of a second when Python ends.
"""

import atexit
import gc
import os
import sys
import threading

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
    atexit._run_exitfuncs()
    os._exit(code)
