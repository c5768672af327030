"""Individuals of a real-coded planner as vectors, and where a search among them may begin."""

from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.planners.planner import COPIES, WrappedPlanner, num_values
from evoexp.records import BoolArray, FloatArray
from evoexp.validation import Count

SHRINKAGE = 0.1  # [-] share of a drawn covariance that is replaced by its diagonal
LEAST = 1e-6  # [-] of the mean variance: directions in which drawn individuals do not differ


class RealVectors(NamedTuple):
    """The numbers of an individual that a search may change."""

    # an individual, individuals' axis left out; what is the same in all of them stays
    template: FloatArray
    changes: BoolArray  # of the same shape: which of its numbers are searched
    drawn: FloatArray  # (variables, individuals) those of the drawn individuals
    # least and greatest values of an individual's numbers, each of the template's shape
    bounds: tuple[FloatArray, FloatArray]

    def population(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (individuals, variables) as `cost` takes them, put within bounds."""
        found = np.repeat(self.template[..., None], len(vectors), axis=-1)
        found[self.changes] = vectors.T
        low, high = (bound[..., None] for bound in self.bounds)
        return np.asarray(np.minimum(np.maximum(found, low), high))

    def distribution(self) -> "Distribution":
        """Return the normal distribution of the drawn individuals, shrunk towards its diagonal."""
        count, diagonal = self.drawn.shape[1], np.eye(len(self.drawn), dtype=bool)
        mean = matrix_product(self.drawn, np.ones(count)) / count
        apart = self.drawn - mean[:, None]
        covariance = matrix_product(apart, np.ascontiguousarray(apart.T)) / count
        own = np.diag(covariance).copy()
        variance = float(matrix_product(own, np.ones(len(own)))) / len(own)
        covariance *= 1.0 - SHRINKAGE
        least = np.maximum(own, LEAST * variance)
        covariance[diagonal] = (1.0 - SHRINKAGE) * own + SHRINKAGE * least
        covariance /= variance
        return Distribution(mean, covariance, float(np.sqrt(variance)))


class Distribution(NamedTuple):
    """A normal distribution of vectors."""

    mean: FloatArray  # (variables,)
    covariance: FloatArray  # (variables, variables), of mean variance 1
    deviation: float  # root of the mean variance


class RealVectorControl(WrappedPlanner):
    """Base of the controls that search among the real vectors of a planner's individuals."""

    matrices: ClassVar[int] = 1  # of (variables, variables) that a search keeps
    fewest: ClassVar[int] = 2  # individuals of a generation that a search takes

    num_drawn: Count  # individuals drawn to know where vectors differ and how; not judged

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        if not self.planner.is_real_coded:
            of = self.planner.component
            must = f"left out: individuals of {of} are no vectors of real numbers"
            raise SettingError("control", must, self.component)
        return super().prepare(robot, scenario)

    def num_evaluations(self, index: int) -> int:
        """Return the planner's evaluations of a later generation, or the fewest there may be."""
        return max(self.fewest, int(self.planner.num_evaluations(max(1, index))))

    def memory(self, problem: Any) -> int:
        """Return the planner's estimate, and that of the drawn individuals and of matrices."""
        values = num_values(self.shape(problem))
        own = 8 * values * (COPIES * self.num_drawn + self.matrices * values)
        return int(self.planner.memory(problem)) + own


def real_vectors(planner: Any, problem: Any, drawn: FloatArray) -> RealVectors:
    """Return where a search begins, by a real-coded planner's `sample` `drawn`, individuals last.

    SettingError: the individuals do not differ.
    """
    template = np.ascontiguousarray(drawn[..., 0])
    changes = np.asarray((drawn != template[..., None]).any(axis=-1))
    vectors = np.ascontiguousarray(drawn[changes])  # (variables, individuals)
    if not vectors.size:
        must = "one whose first individuals differ"
        raise SettingError("planner", must, planner.component)
    bounds = planner.bounds(problem)  # real-coded ones have them
    return RealVectors(template, changes, vectors, bounds)


def transposed_root(matrix: FloatArray) -> FloatArray:
    """Return Lᵀ of the Cholesky factor L of a matrix; LAPACK's bits depend on processors."""
    root = np.triu(matrix)  # rows are columns of L
    for k in range(len(root)):
        for i in range(k):
            root[k, k:] -= root[i, k] * root[i, k:]
        root[k, k:] /= np.sqrt(root[k, k])
    return root
