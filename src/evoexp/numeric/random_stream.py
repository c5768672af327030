"""Uniform numbers in blocks, for kernels that cannot say before how many they take.

A block that is asked for more numbers than it has gives zeros, and `used_up` says so: the caller
then repeats the step that took them, from the same place of a longer block. So the numbers drawn do
not depend on where blocks end.
"""

from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import kernel
from evoexp.numeric.generator_state import state_reader, states_behind


class Block(NamedTuple):
    """Uniform numbers, some of them taken.

    Attributes:
        uniforms: (numbers,) in [0, 1).
        taken: (1,) how many were asked for since the block begins.
    """

    uniforms: NDArray[np.float64]
    taken: NDArray[np.int64]


class Draws:
    """The blocks of one run, each drawn when the last one is used up, into the same memory.

    Attributes:
        block: The block that kernels take numbers of; valid until the next one.
    """

    def __init__(self, least: int) -> None:
        """Start with an empty block.

        Args:
            least: Numbers that are drawn at once, at least.
        """
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


def twin(rng: np.random.Generator) -> np.random.Generator:
    """Return a generator that draws what another one will draw."""
    bits = type(rng.bit_generator)(0)
    bits.state = rng.bit_generator.state
    return np.random.Generator(bits)


def passer(rng: np.random.Generator) -> Callable[[int], object]:
    """Return a function that lets a generator pass uniform numbers, as if they were drawn.

    Advancing a PCG64 takes a third of the time. It forgets half a number that is left of drawing
    32 bits, which drawing uniform numbers does not.
    """
    bits: Any = rng.bit_generator
    if isinstance(bits, np.random.PCG64) and not bits.state["has_uint32"]:
        return bits.advance
    return rng.random


class DrawnAhead:
    """Uniform numbers for several steps at once, drawn ahead of a generator by a twin of it.

    The generator follows step by step: between two steps it is where it would be if each step had
    drawn its own numbers.
    """

    def __init__(self, rng: np.random.Generator, count: int) -> None:
        """Begin where a generator is.

        Args:
            rng: The generator.
            count: Numbers that each step takes.
        """
        self._twin, self._pass, self._count = twin(rng), passer(rng), count
        self._bits = rng.bit_generator

    def draw(self, steps: int) -> NDArray[np.float64]:
        """Return the numbers of the next steps, (steps, count)."""
        return self._twin.random((steps, self._count))

    def follow(self) -> None:
        """Let the generator pass the numbers of one step."""
        self._pass(self._count)

    def follow_all(self, steps: int) -> list[bytes]:
        """Let the generator pass the numbers of some steps; return its state behind each."""
        states = states_behind(self._bits, self._count, steps)
        self._pass(steps * self._count)
        return states


class DrawnByNeed:
    """Uniform numbers for several steps at once, as `DrawnAhead`, of steps that take more or less.

    How many each one took is known only behind it; what is left is for the next steps.
    """

    def __init__(self, rng: np.random.Generator, most: int) -> None:
        """Begin where a generator is.

        Args:
            rng: The generator.
            most: Numbers that a step takes at most.
        """
        self._twin, self._pass, self._most = twin(rng), passer(rng), most
        self._bits = rng.bit_generator
        self._left, self._taken = np.empty(0), deque[int]()

    def draw(self, steps: int) -> NDArray[np.float64]:
        """Return at least as many numbers as the next steps may take."""
        missing = max(0, steps * self._most - len(self._left))
        self._left = np.concatenate([self._left, self._twin.random(missing)])
        return self._left

    def took(self, counts: list[int]) -> None:
        """Tell how many of these numbers each of the steps took."""
        self._taken.extend(counts)
        self._left = self._left[sum(counts) :]

    def follow(self) -> None:
        """Let the generator pass the numbers of one step."""
        self._pass(self._taken.popleft())

    def follow_all(self, steps: int) -> list[bytes]:
        """Let the generator pass the numbers of some steps; return its state behind each."""
        read, found = state_reader(self._bits), list[bytes]()
        for _ in range(steps):
            self.follow()
            found.append(read())
        return found


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
