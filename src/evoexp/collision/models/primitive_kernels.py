"""Kernels of bodies made of spheres and capsules: least clearances of batches of configurations.

Per block of `LANES` configurations: forward kinematics; the centres of balls around bodies and
parts of bodies; balls against obstacles and against each other (`ball_tests`). An encounter that no
ball rules out sets one bit of a word per configuration; encounters are listed per body and class of
obstacle, or per pair of parts, gathered into dense rows, and measured exactly, as vectors again
(`encounter_kernels`). The result does not depend on the encounters skipped, nor on the batch.

The number of encounters limits the speed, here for a 6R arm of 59 spheres and ten obstacles: random
configurations have 0.7 with obstacles and 4 between parts of the arm (fewer where only collisions
are asked for), each some 40 ns of gathering and arithmetic, in lists of some ten per batch of 128
that vectors do not fill; they take two thirds of the time. In a population, whose configurations
are alike, encounters are rare: then forward kinematics, the balls, and the call itself, which
unpacks the tables' arrays, take about a third each. A single configuration costs as much as eight,
and the call.

Where robots are made of spheres alone and only yes or no is asked for, `contact_kernels` answers,
in half the time.
"""

from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from evoexp.collision.models.ball_tests import (
    LANES,
    Bits,
    bound_obstacles,
    bound_pairs,
    mark_obstacles,
    mark_pairs,
    middles_of_balls,
)
from evoexp.collision.models.contact_kernels import find_contacts
from evoexp.collision.models.encounter_kernels import body_meets_body, body_meets_obstacles
from evoexp.collision.models.flat_primitives import named_primitives
from evoexp.collision.models.packed_shapes import (
    FIRST_LISTED,
    STOP_LISTED,
    ContactTables,
    PrimitiveTables,
)
from evoexp.collision.models.primitive_distances import FIXED_ROWS, VALUE, WIDTH
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.vectors import LANES as EIGHT
from evoexp.numeric.vectors import spread, store
from evoexp.records import FloatArray, IntArray
from evoexp.robots.forward_kinematics import (
    SPATIAL_FRAME,
    VECTOR,
    eight_of,
    spatial_frames,
)
from evoexp.robots.kinematics import SPATIAL_ROWS, U

WORD = 64
"""Encounters of one configuration that fit a word of bits."""

GROUP = 8
"""Pairs that are marked together where only collisions are asked for: one found spares the next."""

CLASSES = 3

OBSTACLES, BETWEEN, SELF = range(3)
"""Rows of the result: clearance to obstacles, between arms, between parts of one arm."""


def _trailing_zeros() -> Any:
    """Return a function for kernels: the index of the lowest bit that is set."""

    @intrinsic
    def lowest_bit(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.cttz(arguments[0], context.get_constant(types.boolean, True))

        return types.uint64(types.uint64), generate

    return lowest_bit


_lowest_bit = _trailing_zeros()


class Memory(NamedTuple):
    """Scratch for a batch of `LANES` configurations.

    Attributes:
        q: (nq · 8,) the last ones of a batch, padded.
        frames: (LANES / 8 · (joints + 1) · SPATIAL_FRAME,): eight configurations behind eight; the
            last frame is the world's.
        place: (LANES,) offset of each lane in `frames`.
        middles: (units · 3 · LANES,) centres of the balls.
        best: (3 · LANES,) least clearances so far.
        bits: (LANES,) the word of encounters.
        lists: Encounters, gathered.
        work: Rows of `primitive_distances`.
    """

    q: FloatArray
    frames: FloatArray
    place: NDArray[np.uint64]
    middles: FloatArray
    best: FloatArray
    bits: Bits
    lists: NDArray[np.uint64]
    work: FloatArray


@kernel
def primitive_clearances(
    tables: tuple[Any, ...], limit: float, decide: bool, q: FloatArray, out: FloatArray
) -> None:
    """Run the kernel of `PrimitiveCollision`.

    Args:
        tables: `PrimitiveCollision.tables`, of `flat_primitives`.
        limit: Above it no clearance is measured [length unit].
        decide: Whether the first clearance below 0 ends the judgement of a configuration: all rows
            are −inf then. The limit is 0.
        q: (nq, configurations) [rad].
        out: (3, configurations), written: rows OBSTACLES, BETWEEN, SELF.
    """
    named = named_primitives(tables)
    if decide and len(named.contacts.indices) > 0 and _decide(named.contacts, limit, q, out):
        return
    num_joints, num_units = len(named.chain.parent), len(named.units.whole)
    memory = Memory(
        np.zeros(U(q.shape[0]) * VECTOR),
        np.empty(U(LANES * (num_joints + 1)) * SPATIAL_FRAME // VECTOR),
        np.empty(LANES, dtype=np.uint64),
        np.empty(num_units * 3 * LANES),
        np.empty(3 * LANES),
        np.empty(LANES, dtype=np.uint64),
        np.empty(_room(named.units.whole, named.pairs), dtype=np.uint64),
        np.empty((FIXED_ROWS + 3 * named.shapes.most) * WIDTH),
    )
    _clearances(named, limit, decide, q.reshape(-1), q.shape[1], out, memory)


@kernel
def _decide(contacts: ContactTables, limit: float, q: FloatArray, out: FloatArray) -> bool:
    """Write the rows of a robot made of spheres; false if a configuration is in doubt."""
    hits = np.empty(q.shape[1], dtype=np.bool_)
    if find_contacts(contacts.numbers, contacts.indices, False, q, hits) != 0:
        return False
    for row in range(3):
        for n in range(len(hits)):
            out[row, n] = -np.inf if hits[n] else limit
    return True


@kernel
def _clearances(
    tables: PrimitiveTables,
    limit: float,
    decide: bool,
    q: FloatArray,
    total: int,
    out: FloatArray,
    memory: Memory,
) -> None:
    """Do the work of `primitive_clearances` in given memory, so that no loop counts references."""
    tables, q, out, memory = borrowed((tables, q, out, memory))
    units, obstacles, pairs = tables.units, tables.obstacles, tables.pairs
    frames, middles, best = memory.frames, memory.middles, memory.best
    # the world's frame, behind the joints'
    size = U(len(tables.chain.parent) + 1) * SPATIAL_FRAME
    blocks = min(U(LANES), U(total) + VECTOR - U(1)) // VECTOR
    for block in range(blocks):
        world = U(block + 1) * size - SPATIAL_FRAME
        for row in range(SPATIAL_ROWS):
            store(frames, world + U(row) * VECTOR, spread(1.0 if row in (0, 4, 8) else 0.0))
    for lane in range(LANES):
        memory.place[lane] = U(lane) // VECTOR * size + U(lane) % VECTOR
    for first in range(0, total, LANES):
        count = min(LANES, total - first)
        # frames of the joints, centres of the balls, for eight configurations at a time
        lanes = 0
        while lanes < count:
            own, eight = (
                frames[U(lanes) // VECTOR * size :],
                eight_of(q, first + lanes, total, memory.q),
            )
            spatial_frames(tables.chain, eight, 1.0, own)
            middles_of_balls(units, own, U(lanes), middles)
            lanes += EIGHT
        # upper bounds, then exact distances where they are in doubt
        _begin(len(units.whole), limit, count, lanes, middles, best)
        if not decide:
            bound_obstacles(lanes, units, obstacles, middles, memory.work, best)
            bound_pairs(lanes, units, pairs, middles, best)
        _judge_obstacles(lanes, decide, tables, memory)
        _judge_pairs(lanes, decide, tables, memory)
        for row in range(3):
            for lane in range(count):
                out[row, first + lane] = best[row * LANES + lane]


@kernel
def _room(whole: IntArray, pairs: IntArray) -> int:
    """Return the room for the lists of all encounters that one word of bits can hold."""
    longest = 1
    for b in range(len(whole)):
        longest = max(longest, min(whole[b, STOP_LISTED] - whole[b, FIRST_LISTED], WORD))
    return max(2 * CLASSES * longest, min(len(pairs), WORD)) * LANES


@kernel
def _begin(
    num_units: int, limit: float, count: int, lanes: int, middles: FloatArray, best: FloatArray
) -> None:
    """Begin `best`: the limit, NaN where q is NaN, and −inf, which skips a lane, in padding."""
    best[:lanes] = 0.0
    for b in range(3 * num_units):
        for lane in range(lanes):
            best[U(lane)] += middles[U(b * LANES) + U(lane)] * 0.0
    for lane in range(lanes):
        k = U(lane)
        best[k] = limit + best[k] if lane < count else -np.inf
        best[k + U(LANES)] = best[k]
        best[k + U(2 * LANES)] = best[k]


@kernel
def _judge_obstacles(lanes: int, decide: bool, tables: PrimitiveTables, memory: Memory) -> None:
    """Lower `best` to the clearances of all bodies from the obstacles on their lists."""
    tables, memory = borrowed((tables, memory))
    units, shapes, obstacles = tables.units, tables.shapes, tables.obstacles
    listed, whole, lists, bits = obstacles.listed, units.whole, memory.lists, memory.bits
    frames, place, work, best = memory.frames, memory.place, memory.work, memory.best
    capacity = len(lists) // (2 * CLASSES)
    filled = np.empty(CLASSES, dtype=np.int64)
    # from the tip, which is nearest to most obstacles, to the base
    for b in range(len(whole) - 1, -1, -1):
        for first in range(whole[b, FIRST_LISTED], whole[b, STOP_LISTED], WORD):
            stop = min(first + WORD, whole[b, STOP_LISTED])
            if not mark_obstacles(
                lanes, b, units, obstacles, first, stop, memory.middles, best, bits
            ):
                continue
            # the marked encounters, listed by class: lanes, then obstacles
            for c in range(CLASSES):
                filled[c] = 2 * c * capacity
            for lane in range(lanes):
                word = bits[U(lane)]
                while word != U(0):
                    t = U(first) + _lowest_bit(word)
                    word &= word - U(1)
                    at = filled[listed[t, 1]]
                    lists[at], lists[at + capacity] = U(lane), U(listed[t, 0])
                    filled[listed[t, 1]] = at + 1
            # measured in rows of `WIDTH`
            for c in range(CLASSES):
                for at in range(2 * c * capacity, filled[c], WIDTH):
                    width = min(WIDTH, filled[c] - at)
                    lane_of = lists[at : at + width]
                    obstacle_of = lists[at + capacity : at + capacity + width]
                    body_meets_obstacles(
                        width, c, b, units, shapes, obstacles, lane_of, obstacle_of, frames, place,
                        work, best,
                    )  # fmt: skip
        if decide:
            _drop_collided(lanes, best)


@kernel
def _judge_pairs(lanes: int, decide: bool, tables: PrimitiveTables, memory: Memory) -> None:
    """Lower `best` to the clearances of all pairs of units."""
    tables, memory = borrowed((tables, memory))
    units, shapes, pairs = tables.units, tables.shapes, tables.pairs
    lists, bits, work, best = memory.lists, memory.bits, memory.work, memory.best
    filled = np.empty(WORD, dtype=np.int64)
    group = GROUP if decide else WORD
    for first in range(0, len(pairs), group):
        stop = min(first + group, len(pairs))
        if not mark_pairs(lanes, units, pairs, first, stop, memory.middles, best, bits):
            continue
        # the marked encounters, listed by pair
        for t in range(stop - first):
            filled[t] = t * LANES
        for lane in range(lanes):
            word = bits[U(lane)]
            while word != U(0):
                t = _lowest_bit(word)
                word &= word - U(1)
                lists[filled[t]] = U(lane)
                filled[t] += 1
        # measured in rows of `WIDTH`
        for p in range(first, stop):
            one, two, end = pairs[p, 0], pairs[p, 1], filled[p - first]
            for at in range((p - first) * LANES, end, WIDTH):
                width = min(WIDTH, end - at)
                near = lists[at : at + width]
                body_meets_body(
                    width, one, two, units, shapes, near, memory.frames, memory.place, work
                )
                base = U(pairs[p, 2] * LANES)
                for n in range(width):
                    k = base + near[U(n)]
                    best[k] = min(best[k], work[VALUE + U(n)])
        if decide:
            _drop_collided(lanes, best)


@kernel
def _drop_collided(lanes: int, best: FloatArray) -> None:
    """Set the clearances of configurations that collide to −inf, so that they are skipped."""
    for lane in range(lanes):
        k = U(lane)
        drop = best[k] < 0.0 or best[k + U(LANES)] < 0.0 or best[k + U(2 * LANES)] < 0.0
        best[k] = -np.inf if drop else best[k]
        best[k + U(LANES)] = -np.inf if drop else best[k + U(LANES)]
        best[k + U(2 * LANES)] = -np.inf if drop else best[k + U(2 * LANES)]
