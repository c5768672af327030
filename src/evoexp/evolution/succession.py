"""Succession: how offspring and elites make up the next population."""

import math

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray


def succeed(
    population: FloatArray, offspring: FloatArray, num_offspring: int, elites: IntArray
) -> None:
    """Put the elites of a population behind the offspring, in place.

    Args:
        population: (…, individuals, padding allowed), replaced: the offspring, then the elites in
            the order given.
        offspring: (…, offspring, padding allowed).
        num_offspring: Number of offspring.
        elites: (elites,) indices into the population.

    Raises:
        ValueError: If they do not fit.
    """
    rows = population.reshape(math.prod(population.shape[:-1]), -1)
    lanes = offspring.reshape(math.prod(offspring.shape[:-1]), offspring.shape[-1])
    if (
        len(rows) != len(lanes)
        or num_offspring > lanes.shape[1]
        or num_offspring + len(elites) > rows.shape[1]
    ):
        raise ValueError(
            f"{num_offspring} of {offspring.shape} and {len(elites)} do not fit {population.shape}"
        )
    succeed_rows(rows, lanes, num_offspring, elites)


@kernel
def succeed_rows(
    population: FloatArray, offspring: FloatArray, num_offspring: int, elites: IntArray
) -> None:
    """The kernel of `succeed`, for other kernels; populations as (rows, individuals)."""
    kept = np.empty(len(elites))
    for row in range(len(population)):
        for k in range(len(elites)):
            kept[k] = population[row, elites[k]]
        for k in range(num_offspring):
            population[row, k] = offspring[row, k]
        for k in range(len(elites)):
            population[row, num_offspring + k] = kept[k]


@kernel
def follow_rows(
    population: FloatArray,
    offspring: FloatArray,
    num_offspring: int,
    elites: IntArray,
    following: FloatArray,
) -> None:
    """Write the population that follows another one, which stays as it is.

    Args:
        population: (rows, individuals, padding allowed).
        offspring: (rows, offspring, padding allowed).
        num_offspring: Number of offspring.
        elites: (elites,) indices into the population.
        following: Like population, written: the offspring, then the elites in the order given.
    """
    for row in range(len(population)):
        given, new, written = population[row], offspring[row], following[row]
        for k in range(num_offspring):
            written[k] = new[k]
        for k in range(len(elites)):
            written[num_offspring + k] = given[elites[k]]
