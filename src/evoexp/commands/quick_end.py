"""The ends of a short process: a start without searches for garbage, an end without taking apart.

What is imported stays, so the many searches for garbage while Python imports find none. And freeing
one by one what numba, LLVM and Pinocchio hold takes a quarter of a second when Python ends.
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
    """End this process with an exit code, once all that waits for its end is called.

    Nothing is done where worker processes or threads are left: Python ends these in its own order.
    Standard output and error are flushed already.
    """
    if "evoexp.batch.workers" in sys.modules or threading.active_count() > 1:
        return
    atexit._run_exitfuncs()
    os._exit(code)
