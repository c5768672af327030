"""Draws reports and their figures, and judges answers, on all cores, in copies of this process.

All of it works on results that this process has read. A copy made by fork has them already; a
worker process would have to be sent them, and to load matplotlib first. A copy that draws a report
makes copies of its own for the figures, whenever another core has nothing to do.
"""

import contextlib
import ctypes
import gc
import multiprocessing
import os
import signal
import sys
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from multiprocessing import connection
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

_DIE_WITH_PARENT = 1  # what Linux calls PR_SET_PDEATHSIG


def on_all_cores(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Call a function for every item, on all cores; return the results in order.

    An item whose copy of the process failed or died is done again here: an error shows as if there
    were no copies.

    Args:
        function: Called here or in a copy of this process; its results are pickled.
        items: Taken one by one, by whichever process is free.
    """
    with _collecting_between_items():
        return list(_shared(lambda item: _then_collect(function(item)), items, sent_at_once=False))


def each_on_all_cores(
    function: Callable[[Item], Result], items: Sequence[Item]
) -> Generator[Result | Exception, None, None]:
    """Do the same for items that use `on_all_cores` themselves; yield each result when it is there.

    An error is yielded in the place of the result, so that those of the others are not lost.

    Args:
        function: As above; its results are a few words.
        items: As above.
    """
    here = os.getpid()

    def attempted(item: Item) -> Result | Exception:
        try:
            return function(item)
        except Exception as error:
            if os.getpid() != here:  # where it is raised again
                raise
            return error

    return _shared(attempted, items, sent_at_once=True)


def num_cores() -> int:
    """Return how many cores this process may use."""
    import joblib  # takes as long as a command that has nothing to draw

    return int(joblib.cpu_count())


def _shared(
    function: Callable[[Item], Result], items: Sequence[Item], sent_at_once: bool
) -> Generator[Result, None, None]:
    """Yield the results of all items in order."""
    # elsewhere libraries do not survive a fork
    if sys.platform != "linux" or len(items) < 2 or num_cores() < 2:
        yield from map(function, items)
        return
    with _CORES.counted():
        yield from _SharedItems(function, items, sent_at_once).in_order()


class _Cores:
    """The cores of this machine, as this process and its copies share them.

    A semaphore counts those without work: whoever is killed holds no lock of it.
    """

    def __init__(self) -> None:
        """Count nothing yet."""
        self._idle: Any = None
        self._has_one = True

    @contextlib.contextmanager
    def counted(self) -> Iterator[None]:
        """Count the cores meanwhile, unless they are counted already."""
        if self._idle is not None:
            yield
            return
        context = multiprocessing.get_context("fork")
        self._idle, self._has_one = context.Semaphore(num_cores() - 1), True
        try:
            yield
        finally:
            self._idle = None

    def take(self) -> bool:
        """Take an idle core for a copy; return whether there was one."""
        return bool(self._idle.acquire(block=False))

    def begin_copy(self) -> None:
        """Note, in a copy, that a core was taken for it."""
        self._has_one = True

    def leave(self) -> None:
        """Leave this process's core to others."""
        if self._has_one:
            self._idle.release()
        self._has_one = False

    @contextlib.contextmanager
    def left(self) -> Iterator[None]:
        """Leave this process's core to others while it waits for them."""
        self.leave()
        try:
            yield
        finally:
            self._has_one = self.take()


_CORES = _Cores()


class _SharedItems(Generic[Item, Result]):
    """Items that this process and its copies take one by one."""

    def __init__(
        self, function: Callable[[Item], Result], items: Sequence[Item], sent_at_once: bool
    ) -> None:
        self._function, self._items, self._sent_at_once = function, items, sent_at_once
        self._context = multiprocessing.get_context("fork")
        self._taken = self._context.Value("q", 0)
        self._copies: list[tuple[Any, Any]] = []  # (end of the pipe that it answers by, process)
        self._waited_for: list[Any] = []  # the pipes of those that have not ended
        self._results: dict[int, Result] = {}

    def in_order(self) -> Iterator[Result]:
        """Yield the results in order, each as soon as this process can."""
        told = 0
        try:
            for number in self._numbers():
                self._start_copies()
                self._results[number] = self._function(self._items[number])
                self._hear(timeout=0.0)
                while told in self._results:
                    yield self._results.pop(told)
                    told += 1
            while self._waited_for:
                with _CORES.left():
                    self._hear(timeout=None)
                while told in self._results:
                    yield self._results.pop(told)
                    told += 1
        finally:
            for inlet, process in self._copies:
                inlet.close()
                process.kill()
                process.join()
        for number in range(told, len(self._items)):
            again = number not in self._results
            yield self._function(self._items[number]) if again else self._results.pop(number)

    def _numbers(self) -> Iterator[int]:
        """Yield the numbers of items that nobody else has taken."""
        while True:
            with self._taken.get_lock():
                number = self._taken.value
                self._taken.value += 1
            if number >= len(self._items):
                return
            yield number

    def _start_copies(self) -> None:
        """Start a copy of this process for every idle core, as long as there are items."""
        while self._taken.value < len(self._items) and _CORES.take():
            inlet, outlet = self._context.Pipe(duplex=False)
            process = self._context.Process(target=self._work, args=(outlet, os.getpid()))
            with warnings.catch_warnings():
                # A copy has no other threads; locks that these hold stay locked. Drawing needs none
                # of them: threads of a batch wait for tasks meanwhile.
                warnings.simplefilter("ignore", DeprecationWarning)
                process.start()
            outlet.close()
            self._copies.append((inlet, process))
            self._waited_for.append(inlet)

    def _work(self, outlet: Any, parent: int) -> None:
        """Work on items in a copy, as long as there are any and its parent lives."""
        # whatever stops a copy, Ctrl-C among it, is met again by the process that it is a copy of
        with contextlib.suppress(BaseException):
            ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
            if os.getppid() != parent:
                return
            _CORES.begin_copy()
            found: dict[int, Result] = {}
            try:
                for number in self._numbers():
                    found[number] = self._function(self._items[number])
                    if self._sent_at_once:
                        outlet.send(found)
                        found = {}
            finally:
                _CORES.leave()
            outlet.send(found)

    def _hear(self, timeout: float | None) -> None:
        """Take in what copies have sent.

        Args:
            timeout: How long to wait for it [s]; None: until there is something.
        """
        ready: list[Any] = connection.wait(self._waited_for, timeout)
        for inlet in ready:
            try:
                self._results |= inlet.recv()
            except (EOFError, OSError):
                self._waited_for.remove(inlet)


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
