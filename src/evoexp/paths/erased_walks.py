"""Many random walks over a grid without their loops: drawn, walked and measured side by side.

The walkers are those of `walkers.Walkers` where loops are erased: the same words decide the same
steps. Here the words are drawn while a walker waits for the next row of its table, and every path
keeps its own last exits, so that several are followed at once when all walkers have arrived.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.pcg64 import (
    HIGH_FACTOR,
    LOW_FACTOR,
    Words,
    skip_words,
    step_state,
    word_of_state,
)
from evoexp.paths.grid_choices import Choices
from evoexp.paths.grid_measures import Tolls
from evoexp.paths.grids import NodeArray
from evoexp.paths.walkers import HALF, LANES, LOW, WORDS, next_node
from evoexp.records import IntArray

Exits = NDArray[np.uint16]
ONE, NO_SUM = np.uint64(1), (0, 0, 0)


class Sums(NamedTuple):
    """Sums along paths, in whole numbers.

    Attributes:
        moves: (paths,) tolls of the moves.
        levels: (paths,) tolls of the nodes.
    """

    moves: IntArray
    levels: IntArray


def room_for_exits(count: int, nodes: int) -> Exits:
    """Return memory for the exits of so many paths: (count + LANES, nodes), the last ones unused.

    Raises:
        ValueError: If a node's index does not fit.
    """
    if nodes > 2**16:
        raise ValueError(f"nodes must be at most 65536, were {nodes}")
    return np.empty((count + LANES, nodes), dtype=np.uint16)


@kernel
def walk_all(
    words: Words,
    choices: Choices,
    ends: tuple[int, int],
    blocks: tuple[int, int],
    count: int,
    exits: Exits,
) -> None:
    """Let walkers walk so many paths between different nodes, and keep the last exits of each.

    Args:
        words: The generator; it goes on by whole blocks of words, as if they were drawn before.
        choices: With one row.
        ends: Indices of start and target.
        blocks: Words of the first block, and of each further one; multiples of `WORDS`.
        count: Number of paths.
        exits: (≥ count + LANES, nodes) written: of every path, the node to which it last went from
            each of its nodes.
    """
    choices, exits = borrowed((choices, exits))
    start, target = np.uint64(ends[0]), np.uint64(ends[1])
    one, two, three, four = start, start, start, start
    rows, following, complete = np.arange(LANES), LANES, 0
    exits_one, exits_two, exits_three, exits_four = exits[0], exits[1], exits[2], exits[3]
    # two states, one step apart, which go on by two steps
    add_high, add_low, none = words[2], words[3], np.uint64(0)
    a_high, a_low = step_state(words[0], words[1], HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
    b_high, b_low = step_state(a_high, a_low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
    far_high, far_low = step_state(HIGH_FACTOR, LOW_FACTOR, HIGH_FACTOR, LOW_FACTOR, none, none)
    add_high, add_low = step_state(add_high, add_low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
    taken, drawn = 0, 0
    while complete < count:
        if taken == drawn:
            drawn += blocks[1] if drawn else blocks[0]
        taken += WORDS
        first, second = word_of_state(a_high, a_low), word_of_state(b_high, b_low)
        a_high, a_low = step_state(a_high, a_low, far_high, far_low, add_high, add_low)
        b_high, b_low = step_state(b_high, b_low, far_high, far_low, add_high, add_low)
        # a step of every walker
        to_one = next_node(choices, one, first & LOW)
        to_two = next_node(choices, two, first >> HALF)
        to_three = next_node(choices, three, second & LOW)
        to_four = next_node(choices, four, second >> HALF)
        exits_one[one], exits_two[two] = to_one, to_two
        exits_three[three], exits_four[four] = to_three, to_four
        one, two, three, four = to_one, to_two, to_three, to_four
        if (one == target) | (two == target) | (three == target) | (four == target):
            # who has arrived begins the next path; behind the last one, one that is not kept
            for walker, node in enumerate((one, two, three, four)):
                if node == target:
                    complete += rows[walker] < count
                    rows[walker] = min(following, len(exits) - 1)
                    following += 1
            one, two = start if one == target else one, start if two == target else two
            three, four = start if three == target else three, start if four == target else four
            exits_one, exits_two = exits[rows[0]], exits[rows[1]]
            exits_three, exits_four = exits[rows[2]], exits[rows[3]]
    skip_words(words, drawn)


@kernel
def follow_all(
    exits: Exits, ends: tuple[int, int], tolls: Tolls, paths: NodeArray, sums: Sums
) -> int:
    """Write the paths to which exits lead (Wilson 1996), four at once, and sums along each.

    Args:
        exits: (≥ paths, nodes) of `walk_all`.
        ends: Indices of start and target.
        tolls: Of moves and nodes; a move from a node to itself has none.
        paths: (paths, nodes + 1) written, zeros behind each as far as the longest one reaches.
        sums: (paths,) each, written.

    Returns:
        The number of nodes of the longest path.
    """
    exits, tolls, paths, sums = borrowed((exits, tolls, paths, sums))
    start, target = np.uint64(ends[0]), np.uint64(ends[1])
    count, longest, last_toll = len(paths), 0, tolls.of_node[np.uint64(ends[1])]
    for first in range(0, count, 4):
        # the last path several times where there are no more
        k_two, k_three = min(first + 1, count - 1), min(first + 2, count - 1)
        k_four = min(first + 3, count - 1)
        own = (first, k_two, k_three, k_four)
        for k in own:
            exits[k, target] = target  # who has arrived stays
        one, two, three, four, at = start, start, start, start, ONE
        sum_one, sum_two, sum_three, sum_four = NO_SUM, NO_SUM, NO_SUM, NO_SUM
        while (one != target) | (two != target) | (three != target) | (four != target):
            one, sum_one = _follow(exits[first], one, target, at, sum_one, tolls, paths[first])
            two, sum_two = _follow(exits[k_two], two, target, at, sum_two, tolls, paths[k_two])
            three, sum_three = _follow(
                exits[k_three], three, target, at, sum_three, tolls, paths[k_three]
            )
            four, sum_four = _follow(
                exits[k_four], four, target, at, sum_four, tolls, paths[k_four]
            )
            at += ONE
        for k, (num, moves, level) in zip(own, (sum_one, sum_two, sum_three, sum_four)):  # noqa: B905
            # the target's toll was added until all had arrived, and is due once
            sums.moves[k], sums.levels[k] = moves, level - (np.int64(at) - num - 2) * last_toll
            paths[k, np.uint64(at)] = target
            paths[k, 0] = num + 1
            longest = max(longest, num + 1)
    for k in range(count):
        paths[k, paths[k, 0] + 1 : longest + 1] = 0
    return longest


@inlined
def _follow(
    exits: Exits,
    node: np.uint64,
    target: np.uint64,
    at: np.uint64,
    sums: tuple[int, int, int],
    tolls: Tolls,
    path: NodeArray,
) -> tuple[np.uint64, tuple[int, int, int]]:
    """Write a node and go on, from the target to itself; return the next node, and sums.

    The sums: how many nodes were left, tolls of moves, tolls of the nodes that were written.
    """
    path[at] = node
    following = np.uint64(exits[node])
    move = np.uint64(abs(np.int64(following) - np.int64(node)))
    left, moves, level = sums
    left += node != target
    moves += tolls.of_move[move]
    level += tolls.of_node[node]
    return following, (left, moves, level)
