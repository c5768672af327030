"""Memory for the frames of Python's calls, in one piece.

CPython keeps frames in pieces of 16 kB: it asks the system for another piece where one is full, and
gives it back when the call returns. A loop that calls functions from the edge of a piece does so at
every call. Imports within imports come there: while a command's modules are loaded, thousands of
pieces are asked for, which takes a tenth of the time. A piece is larger where a frame needs more,
and it then holds all calls from there.
"""

from collections.abc import Callable
from types import FunctionType
from typing import TypeVar, cast

WORDS = 2**16 + 1  # [8 B] that a frame claims and never touches; as much again is left behind it

Value = TypeVar("Value")


def _call(function: Callable[[], Value]) -> Value:
    return function()


_roomy = FunctionType(_call.__code__.replace(co_stacksize=WORDS), globals())


def called_in_one_piece(function: Callable[[], Value]) -> Value:
    """Call a function such that its frame and those of all calls within share a piece of memory."""
    return cast(Value, _roomy(function))
