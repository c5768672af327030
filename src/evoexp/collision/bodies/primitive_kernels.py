"""Kernels of bodies made of spheres and capsules: least clearances of batches of configurations.

Per batch of `BATCH` configurations: forward kinematics; the centres of balls around bodies and
parts of bodies; balls against obstacles and against each other (`ball_tests`). Encounters that no
ball rules out are listed, per body and class of obstacle or per pair of parts, and measured
exactly, eight at a time (`encounter_kernels`). The result does not depend on the encounters
skipped, nor on the batch.

Where robots are made of spheres alone and only yes or no is asked for, `contact_kernels` answers.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.bodies.ball_tests import (
    BATCH,
    WORD,
    bound_obstacles,
    bound_pairs,
    middles_of_balls,
    near_obstacle,
    near_pair,
)
from evoexp.collision.bodies.center_kernels import POINT
from evoexp.collision.bodies.contact_kernels import find_contacts
from evoexp.collision.bodies.encounter_kernels import (
    Encounters,
    body_meets_body,
    body_meets_obstacles,
    fill_up,
    listed_from,
)
from evoexp.collision.bodies.packed_shapes import (
    FIRST_LISTED,
    STOP_LISTED,
    ContactTables,
    PrimitiveTables,
    named_primitives,
)
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import LANES as EIGHT
from evoexp.numeric.vectors import Vector, load, select, spread, store
from evoexp.records import FloatArray
from evoexp.robots.forward_kinematics import (
    SPATIAL_FRAME,
    VECTOR,
    eight_of,
    spatial_frames,
)
from evoexp.robots.kinematics import SPATIAL_ROWS, U

CLASSES = 3

ROOM = 4 * BATCH
"""Encounters with obstacles of one class that are listed at most before they are measured."""

OBSTACLES, BETWEEN, SELF = range(3)
"""Rows of the result: clearance to obstacles, between arms, between parts of one arm."""


class Memory(NamedTuple):
    """Scratch for a batch of `BATCH` configurations."""

    q: FloatArray  # (nq · 8,) the last ones of a batch, padded
    # (BATCH / 8 · (joints + 1) · SPATIAL_FRAME,): eight configurations behind eight; the last frame
    # is the world's
    frames: FloatArray
    middles: FloatArray  # (units · 3 · BATCH,) centres of the balls
    best: FloatArray  # (3 · BATCH,) least clearances so far
    near: Encounters  # (CLASSES · ROOM,) encounters, listed
    centers: FloatArray  # (most + 1 · POINT,) moved spheres, and clearances to be handed out


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
    room = CLASSES * ROOM
    memory = Memory(
        np.zeros(U(q.shape[0]) * VECTOR),
        np.empty(U(BATCH * (num_joints + 1)) * SPATIAL_FRAME // VECTOR),
        np.empty(num_units * 3 * BATCH),
        np.empty(3 * BATCH),
        Encounters(
            np.empty(room, dtype=np.uint64),
            np.empty(room, dtype=np.uint64),
            np.empty(room, dtype=np.uint64),
        ),
        np.empty(U(named.shapes.most + 1) * POINT),
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
    blocks = min(U(BATCH), U(total) + VECTOR - U(1)) // VECTOR
    for block in range(blocks):
        world = U(block + 1) * size - SPATIAL_FRAME
        for row in range(SPATIAL_ROWS):
            store(frames, world + U(row) * VECTOR, spread(1.0 if row in (0, 4, 8) else 0.0))
    for first in range(0, total, BATCH):
        count = min(BATCH, total - first)
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
            bound_obstacles(lanes, units, obstacles, middles, best)
            bound_pairs(lanes, units, pairs, middles, best)
        _judge_obstacles(lanes, decide, tables, memory, size)
        _judge_pairs(lanes, decide, tables, memory, size)
        for row in range(3):
            for lane in range(count):
                out[row, first + lane] = best[row * BATCH + lane]


@inlined
def _begin(
    num_units: int, limit: float, count: int, lanes: int, middles: FloatArray, best: FloatArray
) -> None:
    """Begin `best`: the limit, NaN where q is NaN, and −inf, which skips a lane, in padding."""
    for n in range(0, lanes, EIGHT):
        nothing = spread(0.0)
        for row in range(3 * num_units):
            nothing = nothing + load(middles, U(row * BATCH + n)) * 0.0
        for row in range(3):
            store(best, U(row * BATCH + n), limit + nothing)
    for lane in range(count, lanes):
        for row in range(3):
            best[U(row * BATCH + lane)] = -np.inf


@kernel
def _judge_obstacles(
    lanes: int, decide: bool, tables: PrimitiveTables, memory: Memory, size: np.uint64
) -> None:
    """Lower `best` to the clearances of all bodies from the obstacles on their lists."""
    tables, memory = borrowed((tables, memory))
    units, shapes, obstacles = tables.units, tables.shapes, tables.obstacles
    listed, whole, data, near = obstacles.listed, units.whole, obstacles.data, memory.near
    ends = np.empty(CLASSES, dtype=np.int64)
    # from the tip, which is nearest to most obstacles, to the base
    for b in range(len(whole) - 1, -1, -1):
        for kind in range(CLASSES):
            ends[kind] = kind * ROOM
        for t in range(whole[b, FIRST_LISTED], whole[b, STOP_LISTED]):
            o, own = listed[t, 0], listed[t, 1]
            for first in range(0, lanes, WORD):
                stop = min(first + WORD, lanes)
                word = near_obstacle(
                    units, b, data[o], own, first, stop, memory.middles, memory.best
                )
                place = U(o) * U(data.shape[1])
                ends[own] = listed_from(word, first, size, place, ends[own], near)
            # measured where no other obstacle's would find room, and behind the last obstacle
            for kind in range(CLASSES):
                begin, end = kind * ROOM, ends[kind]
                if end > begin and (t + 1 == whole[b, STOP_LISTED] or end > begin + ROOM - BATCH):
                    ends[kind] = begin
                    fill_up(begin, end, near)
                    for at in range(begin, end, EIGHT):
                        found = body_meets_obstacles(
                            at, kind, b, units, shapes, obstacles, near, memory.frames
                        )
                        _hand_out(found, at, 0, decide, memory)


@kernel
def _judge_pairs(
    lanes: int, decide: bool, tables: PrimitiveTables, memory: Memory, size: np.uint64
) -> None:
    """Lower `best` to the clearances of all pairs of units."""
    tables, memory = borrowed((tables, memory))
    units, shapes, pairs, near = tables.units, tables.shapes, tables.pairs, memory.near
    for p in range(len(pairs)):
        one, two, row, end = pairs[p, 0], pairs[p, 1], pairs[p, 2], 0
        for first in range(0, lanes, WORD):
            stop = min(first + WORD, lanes)
            word = near_pair(units, one, two, row, first, stop, memory.middles, memory.best)
            end = listed_from(word, first, size, U(0), end, near)
        if end > 0:
            fill_up(0, end, near)
            for at in range(0, end, EIGHT):
                found = body_meets_body(
                    at, one, two, units, shapes, near, memory.frames, memory.centers
                )
                _hand_out(found, at, row, decide, memory)


@inlined
def _hand_out(found: Vector, at: int, row: int, decide: bool, memory: Memory) -> None:
    """Lower `best` to what was found in eight encounters.

    Where only yes or no is asked for, a collision sets all rows to −inf: nothing else of that
    configuration is measured.
    """
    if decide:
        found = select(found < 0.0, spread(-np.inf), found)
    best, own = memory.best, U(len(memory.centers)) - VECTOR
    store(memory.centers, own, found)
    for n in range(EIGHT):
        lane, value = memory.near.lanes[U(at + n)], memory.centers[own + U(n)]
        if value < best[U(row * BATCH) + lane]:
            best[U(row * BATCH) + lane] = value
            if decide:
                best[lane] = best[lane + U(BATCH)] = best[lane + U(2 * BATCH)] = value
