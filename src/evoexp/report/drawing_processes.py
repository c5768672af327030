"""Draws the figures of a page, and judges answers, on all cores, in copies of this process.

Both work on results that this process has read. A copy made by fork has them already; a worker
process would have to be sent them, and to load matplotlib first.
"""

import contextlib
import gc
import multiprocessing
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import joblib

Item = TypeVar("Item")
Result = TypeVar("Result")


def on_all_cores(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Call a function for every item, on all cores; return the results in order.

    An item whose copy of the process failed or died is done again here: an error shows as if there
    were no copies.

    Args:
        function: Called here or in a copy of this process; its results are pickled.
        items: Taken one by one, by whichever process is free.
    """
    with _collecting_between_items():
        return _on_all_cores(lambda item: _then_collect(function(item)), items)


def _on_all_cores(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Do what `on_all_cores` says, whatever collects garbage."""
    num_copies = min(int(joblib.cpu_count()), len(items)) - 1
    if num_copies < 1 or sys.platform != "linux":  # elsewhere libraries do not survive a fork
        return [function(item) for item in items]
    context = multiprocessing.get_context("fork")
    taken = context.Value("q", 0)

    def next_items() -> Iterator[int]:
        while True:
            with taken.get_lock():
                number = taken.value
                taken.value += 1
            if number >= len(items):
                return
            yield number

    def work(outlet: Any) -> None:
        # whatever stops a copy, Ctrl-C among it, is met again by the process that it is a copy of
        with contextlib.suppress(BaseException):
            outlet.send({number: function(items[number]) for number in next_items()})

    copies = [_start(context, work) for _ in range(num_copies)]
    try:
        results = {number: function(items[number]) for number in next_items()}
        for inlet, _ in copies:
            with contextlib.suppress(EOFError, OSError):
                results |= inlet.recv()
    finally:
        for inlet, process in copies:
            inlet.close()
            process.kill()
            process.join()
    return [
        results[number] if number in results else function(item)
        for number, item in enumerate(items)
    ]


@contextlib.contextmanager
def _collecting_between_items() -> Iterator[None]:
    """Let Python look for garbage after each item, among what is made from now on.

    While a figure is drawn it would look through all modules and tables again and again, a tenth of
    the time, and find nothing.
    """
    if not gc.isenabled():
        yield
        return
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()


def _then_collect(result: Result) -> Result:
    gc.collect()
    return result


def _start(context: Any, work: Callable[[Any], None]) -> tuple[Any, Any]:
    """Start a copy of this process; return the end of the pipe that it answers by, and itself."""
    inlet, outlet = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(outlet,), daemon=True)
    with warnings.catch_warnings():
        # A copy has no other threads; locks that these hold stay locked. Drawing needs none of
        # them: threads of a batch wait for tasks meanwhile.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    outlet.close()
    return inlet, process
