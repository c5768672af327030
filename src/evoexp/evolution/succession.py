"""Succession: how offspring and elites make up the next population."""

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray


@kernel
def choose_elites(costs: FloatArray, chosen: IntArray) -> None:
    """Write the indices of the lowest costs, best first; among equals the lower index wins.

    By insertion: a later equal cost stays behind.
    """
    count, filled = len(chosen), 0
    for k in range(len(costs)):
        if filled == count and (count == 0 or not costs[k] < costs[chosen[count - 1]]):
            continue
        place = filled if filled < count else count - 1
        while place > 0 and costs[k] < costs[chosen[place - 1]]:
            chosen[place] = chosen[place - 1]
            place -= 1
        chosen[place] = k
        filled = min(filled + 1, count)


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
