"""Individuals of a real-coded planner as vectors, and where a search among them may begin."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.compilation import kernel
from evoexp.planners.planner import Planner
from evoexp.records import BoolArray, FloatArray

SHRINKAGE = 0.1  # [-] share of a drawn covariance that is replaced by its diagonal
LEAST = 1e-6  # [-] of the mean variance: directions in which drawn individuals do not differ


class RealVectors(NamedTuple):
    """The numbers of an individual that a search may change."""

    # an individual, individuals' axis left out; what is the same in all of them stays
    template: FloatArray
    changes: BoolArray  # of the same shape: which of its numbers are searched
    mean: FloatArray  # (variables,) of the drawn individuals
    covariance: FloatArray  # (variables, variables) of them, of mean variance 1
    deviation: float  # root of the mean variance of the drawn individuals
    # least and greatest values of an individual's numbers, each of the template's shape
    bounds: tuple[FloatArray, FloatArray]

    def population(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (individuals, variables) as the planner's `cost` takes individuals.

        Numbers beyond the bounds are put there.
        """
        found = np.repeat(self.template[..., None], len(vectors), axis=-1)
        found[self.changes] = vectors.T
        low, high = (bound[..., None] for bound in self.bounds)
        return np.asarray(np.minimum(np.maximum(found, low), high))


def check_real_coded(planner: Planner, name: str) -> None:
    """Refuse a planner whose individuals are no real vectors.

    Args:
        planner: The planner beside which a control stands.

    Raises:
        SettingError: If it is one.
    """
    if not getattr(planner, "is_real_coded", False):
        must = f"left out: individuals of {planner.component} are no vectors of real numbers"
        raise SettingError("control", must, name)


def real_vectors(planner: Planner, problem: Any, drawn: FloatArray) -> RealVectors:
    """Return where a search among individuals begins: as the planner's own first ones are spread.

    Args:
        planner: A real-coded planner, which has `bounds(problem)`.
        drawn: Individuals of its `sample`, individuals last.

    Raises:
        SettingError: If they do not differ.
    """
    template = np.ascontiguousarray(drawn[..., 0])
    changes = np.asarray((drawn != template[..., None]).any(axis=-1))
    vectors = np.ascontiguousarray(drawn[changes])  # (variables, individuals)
    if not vectors.size:
        must = "one whose first individuals differ"
        raise SettingError("planner", must, planner.component)
    mean, covariance = moments(vectors)
    variance = float(trace(covariance)) / len(covariance)
    shrink(covariance, variance)
    bounds = planner.bounds(problem)  # type: ignore[attr-defined]  # real-coded ones have them
    return RealVectors(template, changes, mean, covariance, float(np.sqrt(variance)), bounds)


@kernel
def moments(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean (variables,) and covariance (variables, variables) of (variables, individuals).

    Sums run over individuals in their order.
    """
    variables, count = vectors.shape
    mean, covariance = np.zeros(variables), np.zeros((variables, variables))
    for i in range(variables):
        for k in range(count):
            mean[i] += vectors[i, k]
        mean[i] /= count
    apart = np.empty((count, variables))
    for i in range(variables):
        for k in range(count):
            apart[k, i] = vectors[i, k] - mean[i]
    for k in range(count):
        for i in range(variables):
            own = apart[k, i]
            for j in range(variables):
                covariance[i, j] += own * apart[k, j]
    for i in range(variables):
        for j in range(variables):
            covariance[i, j] /= count
    return mean, covariance


@kernel
def trace(matrix: FloatArray) -> float:
    """Return the sum of the diagonal of a matrix (n, n)."""
    total = 0.0
    for i in range(len(matrix)):
        total += matrix[i, i]
    return total


@kernel
def shrink(covariance: FloatArray, variance: float) -> None:
    """Shrink a covariance (n, n) towards its diagonal, and divide it by the mean variance."""
    for i in range(len(covariance)):
        for j in range(len(covariance)):
            if i == j:
                least = max(covariance[i, i], LEAST * variance)
                covariance[i, i] = (1.0 - SHRINKAGE) * covariance[i, i] + SHRINKAGE * least
            else:
                covariance[i, j] *= 1.0 - SHRINKAGE
            covariance[i, j] /= variance


@kernel
def transposed_root(matrix: FloatArray) -> FloatArray:
    """Return Lᵀ of the Cholesky factor L of a positive definite matrix (n, n)."""
    n = len(matrix)
    root = np.zeros((n, n))  # rows are columns of L
    for k in range(n):
        for j in range(k, n):
            root[k, j] = matrix[k, j]
        for i in range(k):
            own = root[i, k]
            for j in range(k, n):
                root[k, j] -= own * root[i, j]
        pivot = np.sqrt(root[k, k])
        for j in range(k, n):
            root[k, j] /= pivot
    return root


@kernel
def correlated(root: FloatArray, normals: FloatArray, scale: float) -> FloatArray:
    """Return scale · L z for each row z of normals.

    Args:
        root: (n, n) of `transposed_root`.
        normals: (individuals, n).
        scale: A factor.

    Returns:
        (individuals, n).
    """
    count, n = normals.shape
    out = np.zeros((count, n))
    for k in range(count):
        for i in range(n):
            own = scale * normals[k, i]
            for j in range(i, n):
                out[k, j] += own * root[i, j]
    return out
