"""References: deterministic truths about the problem of the planner that they stand beside.

A truth is an exact optimum, a frontier, a landscape, or the end of a conventional method. It is
computed once, run and stored like a condition of one replicate, its arrays attached to the log.
Libraries such as scipy may compute it, which are not reproducible bit by bit; so `reproduce`
compares its numbers, to 1e-9, and not its digest.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.planners.planner import Candidate, Keeper, Reproducibility, WrappedPlanner
from evoexp.records import Block, FloatArray


class Truth(NamedTuple):
    """The result of a reference."""

    best: FloatArray  # flat solution in the shape of the planner beside it
    cost: float  # its cost, as the planner's own; lower is better, inf: there is none
    solved: bool  # whether the planner's own model accepts it
    evaluations: int  # evaluations of the planner's cost that it took
    # numbers of its own (the share of starts that end at the optimum, say), beside those of
    # `evaluate`
    terms: Mapping[str, float] = {}
    # arrays for figures and tables, by name: attached to the log as `<name>.npy`, any shape,
    # float64 or int64
    arrays: Mapping[str, np.ndarray] = {}


class Reference(WrappedPlanner, is_base=True):
    """Base of every reference; a subclass writes `truth`."""

    reproducibility: ClassVar[Reproducibility] = "environment"
    is_reference: ClassVar[bool] = True

    def truth(self, problem: Any) -> Truth:
        """Return the truth about a problem, the same at every call."""
        raise NotImplementedError

    @property
    def num_generations(self) -> int:
        """None follows the one that there is."""
        return 0

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the truth as the one generation that there is; no number is drawn."""
        with one_thread():
            found, keeper = self.truth(problem), Keeper()
        cost = float(found.cost)
        terms = {name: float(value) for name, value in found.terms.items()}
        keeper.keep(cost, Candidate(found.best, terms, found.solved))
        yield keeper.record(
            np.array([cost]),
            found.best[None, :],
            0,
            num_feasible=int(found.solved),
            evaluations=found.evaluations,
            arrays=dict(found.arrays),
        )


@contextmanager
def one_thread() -> Iterator[None]:
    """Let BLAS and LAPACK use one thread in the body, however many they use elsewhere.

    OpenBLAS gives other last digits with two threads than with one, and an optimiser takes other
    steps. A worker has one thread, but a replicate also runs in `reproduce`, `runner=serial`, a
    notebook.
    """
    import scipy.linalg  # noqa: F401  # it brings a BLAS of its own, limited once it is loaded
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield
