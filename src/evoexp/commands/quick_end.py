"""The end of a short process, without taking it apart.

Freeing one by one the objects of numba, LLVM and Pinocchio takes a quarter of a second when Python
ends.
"""

import atexit
import os
import threading
from typing import NoReturn


def leave(code: int) -> NoReturn:
    """End this process as Python does: threads first, then functions registered for its end.

    Standard output and error are flushed already.
    """
    getattr(threading, "_shutdown", lambda: None)()
    leave_at_once(code)


def leave_at_once(code: int) -> NoReturn:
    """End this process without its threads: they may wait for what an interrupted one left undone.

    Nothing is lost by that: what they write are files that nobody has the name of yet.
    """
    atexit._run_exitfuncs()
    os._exit(code)
