"""One thread for linear algebra: with several, BLAS divides its sums otherwise."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any


@contextmanager
def one_thread() -> Iterator[None]:
    """Let BLAS and LAPACK use one thread in the body, however many they use elsewhere.

    OpenBLAS gives other last digits with two threads than with one, and an optimiser that builds on
    them takes other steps. A worker has one thread by its environment, but a replicate also runs
    where numpy was loaded with all of them: `reproduce`, `runner=serial`, a notebook.
    """
    import scipy.linalg  # noqa: F401  # it brings a BLAS of its own, limited once it is loaded

    with _libraries().limit(limits=1, user_api="blas"):
        yield


@cache
def _libraries() -> Any:
    """Look once for the libraries that are loaded; it takes some milliseconds."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
