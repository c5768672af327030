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
def copy_members(population: FloatArray, members: IntArray, out: FloatArray, first: int) -> None:
    """Copy some individuals of a population (rows, individuals) to places from `first` on."""
    for row in range(len(out)):
        for k in range(len(members)):
            out[row, first + k] = population[row, members[k]]
