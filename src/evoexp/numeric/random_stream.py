"""Uniform numbers in blocks, for kernels that cannot say before how many they take.

A block that is asked for more numbers than it has gives zeros, and `used_up` says so: the caller
then repeats the step that took them, from the same place of a longer block. So the numbers drawn do
not depend on where blocks end.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import kernel


class Block(NamedTuple):
    """Uniform numbers, some of them taken."""

    uniforms: NDArray[np.float64]  # (numbers,) in [0, 1)
    taken: NDArray[np.int64]  # (1,) how many were asked for since the block begins


class Draws:
    """The blocks of one run, each drawn into the same memory when the last one is used up."""

    def __init__(self, least: int) -> None:
        """Start with an empty block; at least `least` numbers are drawn at once."""
        self._least, self._memory = least, np.empty(0)
        self.block = Block(self._memory, np.zeros(1, dtype=np.int64))

    def extend(self, rng: np.random.Generator) -> None:
        """Put new numbers behind those that are left, at least as many as are left."""
        left = self.block.uniforms[self.block.taken[0] :]
        count = len(left) + max(self._least, len(left))
        if count > len(self._memory):
            self._memory = np.empty(2 * count)
        self._memory[: len(left)] = left
        rng.random(out=self._memory[len(left) : count])
        self.block = Block(self._memory[:count], self.block.taken)
        self.block.taken[0] = 0


@kernel
def draw(draws: Block) -> float:
    """Return the next uniform number of a block; 0 behind its end."""
    uniforms, taken = draws.uniforms, draws.taken
    taken[0] += 1
    return uniforms[taken[0] - 1] if taken[0] <= len(uniforms) else 0.0


@kernel
def draw_many(draws: Block, count: int) -> NDArray[np.float64]:
    """Return the next uniform numbers of a block as a view; none at all, if not all are there."""
    uniforms, taken = draws.uniforms, draws.taken
    first = taken[0]
    taken[0] += count
    return uniforms[first : taken[0]] if taken[0] <= len(uniforms) else uniforms[:0]


@kernel
def draw_index(draws: Block, count: int) -> int:
    """Return one of 0 … count − 1."""
    return min(int(draw(draws) * count), count - 1)


@kernel
def used_up(draws: Block) -> bool:
    """Return whether more numbers were asked for than the block has."""
    return bool(draws.taken[0] > len(draws.uniforms))
