"""Uniform numbers in blocks, for kernels that cannot say before how many they take.

In a kernel, `draws` is a block: its numbers and, as an array of one, how many were taken. Asked for
more than it has, it gives zeros: whatever was made with them is to be made again from the same
place of a longer block. So what is drawn does not depend on where blocks end.
"""

import numpy as np

from evoexp.numeric.compilation import kernel


class Draws:
    """The blocks of one run, each drawn when the last one is used up.

    Attributes:
        block: See above; for kernels.
    """

    def __init__(self, least: int) -> None:
        """Start with an empty block.

        Args:
            least: Numbers that are drawn at once, at least.
        """
        self._least = least
        self.block = np.empty(0), np.zeros(1, dtype=np.int64)

    def extend(self, rng: np.random.Generator) -> None:
        """Put new numbers behind those that are left, as many as these at least."""
        uniforms, taken = self.block
        left = uniforms[taken[0] :]
        self.block = np.concatenate([left, rng.random(max(self._least, len(left)))]), taken
        taken[0] = 0


@kernel
def draw(draws):  # type: ignore[no-untyped-def]
    """Return the next uniform number of a block; 0 behind its end."""
    uniforms, taken = draws
    taken[0] += 1
    return uniforms[taken[0] - 1] if taken[0] <= len(uniforms) else 0.0


@kernel
def draw_many(draws, count):  # type: ignore[no-untyped-def]
    """Return the next uniform numbers of a block as a view; none at all, if not all are there."""
    uniforms, taken = draws
    first = taken[0]
    taken[0] += count
    return uniforms[first : taken[0]] if taken[0] <= len(uniforms) else uniforms[:0]


@kernel
def draw_index(draws, count):  # type: ignore[no-untyped-def]
    """Return one of 0 … count − 1."""
    return min(int(draw(draws) * count), count - 1)


@kernel
def used_up(draws):  # type: ignore[no-untyped-def]
    """Return whether more numbers were asked for than the block has."""
    return draws[1][0] > len(draws[0])
