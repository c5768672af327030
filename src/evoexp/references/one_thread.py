"""One thread for linear algebra: with several, BLAS divides its sums otherwise."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_thread() -> Iterator[None]:
    """Let BLAS and LAPACK use one thread in the body, however many they use elsewhere.

    OpenBLAS gives other last digits with two threads than with one, and an optimiser that builds on
    them takes other steps. A worker has one thread by its environment, but a replicate also runs
    where numpy was loaded with all of them: `reproduce`, `runner=serial`, a notebook.
    """
    import scipy.linalg  # noqa: F401  # it brings a BLAS of its own, limited once it is loaded
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"):
        yield
