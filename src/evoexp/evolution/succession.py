"""Succession: how offspring and elites make up the next population."""

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray


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
