"""Cubic splines through the via-points over their index: second derivatives and speeds.

On segment k, with u in [0, 1], a and m (a sixth of the second derivative) at both ends:

    s(u)  = a0 + u (b0 + u (b1/2 + u b2/3)),   s'(u) = b0 + u (b1 + u b2),
    b0 = a1 − a0 − 2 m0 − m1,   b1 = 6 m0,   b2 = 3 (m1 − m0).
"""

import numpy as np

from evoexp.numeric.compilation import inlined
from evoexp.numeric.vector_rows import Eight, transposed
from evoexp.numeric.vectors import LANES, Vector, load, root, select, spread, store
from evoexp.paths.workspace import U0, U1, U2, U3, U4, U5, U6, U7, VECTOR, Layout
from evoexp.records import FloatArray

PAIR = U2 * VECTOR  # distance of two knots


@inlined
def fit_splines(
    via_points: FloatArray,
    first: np.uint64,
    pitch: np.uint64,
    joints: np.uint64,
    N: np.uint64,
    pivots: FloatArray,
    w: FloatArray,
    at: Layout,
) -> None:
    """Copy the coordinates of eight paths to the knots in w and solve for m (Thomas algorithm).

    `first` is the place of point 0 of the arm's first joint, `pitch` the distance of two points.
    """
    to_joint = (N + U1) * pitch
    for joint in range(joints):
        source, knot = first + joint * to_joint, joint * at.joint * VECTOR
        before, here = load(via_points, source), load(via_points, source + pitch)
        # forward: the equations of `spline_pivots`, each freed of the unknown before
        m = (here - before) * pivots[0]
        store_knot(w, knot, before, m)
        for i in range(U1, N):
            after = load(via_points, source + (i + U1) * pitch)
            m = ((before - here) + (after - here) - m) * pivots[i]
            store_knot(w, knot + i * PAIR, here, m)
            before, here = here, after
        m = ((before - here) - m) * pivots[N]
        store_knot(w, knot + N * PAIR, here, m)
        # backward: the unknowns
        for back in range(N):
            place = knot + (N - U1 - back) * PAIR + VECTOR
            m = load(w, place) - m * pivots[N - U1 - back]
            store(w, place, m)


@inlined
def store_knot(w: FloatArray, knot: np.uint64, a: Vector, m: Vector) -> None:
    """Write a knot: coordinate, and a sixth of the second derivative."""
    store(w, knot, a)
    store(w, knot + VECTOR, m)


@inlined
def write_rows(joints: np.uint64, w: FloatArray, at: Layout) -> None:
    """Write the knots of eight paths as rows, four knots at a time; the last ones are padding."""
    for joint in range(joints):
        for place in range(U0, at.joint, VECTOR):
            block = (joint * at.joint + place) * VECTOR
            rows = at.rows + joint * at.joint + place
            store_rows(w, rows, at.row, load_eight(w, block))


@inlined
def store_rows(w: FloatArray, place: np.uint64, pitch: np.uint64, vectors: Eight) -> None:
    """Write eight vectors side by side into the rows of their lanes."""
    rows = transposed(vectors)
    for k in range(LANES):
        store(w, place + np.uint64(k) * pitch, rows[k])


@inlined
def load_eight(w: FloatArray, place: np.uint64) -> Eight:
    """Return eight vectors that stand one behind the other."""
    return (
        load(w, place),
        load(w, place + VECTOR),
        load(w, place + U2 * VECTOR),
        load(w, place + U3 * VECTOR),
        load(w, place + U4 * VECTOR),
        load(w, place + U5 * VECTOR),
        load(w, place + U6 * VECTOR),
        load(w, place + U7 * VECTOR),
    )


@inlined
def slope(w: FloatArray, knot: np.uint64) -> tuple[Vector, Vector, Vector]:
    """Return b0, b1, b2 of one joint on the segment that begins at `knot`."""
    a0, m0 = load(w, knot), load(w, knot + VECTOR)
    a1, m1 = load(w, knot + PAIR), load(w, knot + PAIR + VECTOR)
    return a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)


@inlined
def speed_of_two(
    x: tuple[Vector, Vector, Vector], y: tuple[Vector, Vector, Vector], u: float
) -> Vector:
    """Return |s'(u)| of two joints from their slopes."""
    one, two = x[0] + u * (x[1] + u * x[2]), y[0] + u * (y[1] + u * y[2])
    return root(one * one + two * two)


@inlined
def square_speed(
    w: FloatArray, knot: np.uint64, joints: np.uint64, at: Layout
) -> tuple[Vector, Vector, Vector, Vector, Vector]:
    """Return the five coefficients of |s'(u)|² over all joints on the segment after `knot`."""
    b0, b1, b2 = slope(w, knot)
    q0, q1, q2 = b0 * b0, 2.0 * b0 * b1, b1 * b1 + 2.0 * b0 * b2
    q3, q4 = 2.0 * b1 * b2, b2 * b2
    for joint in range(U1, joints):
        b0, b1, b2 = slope(w, knot + joint * at.joint * VECTOR)
        q0, q1, q2 = q0 + b0 * b0, q1 + 2.0 * b0 * b1, q2 + (b1 * b1 + 2.0 * b0 * b2)
        q3, q4 = q3 + 2.0 * b1 * b2, q4 + b2 * b2
    return q0, q1, q2, q3, q4


@inlined
def speed_of_all(q: tuple[Vector, Vector, Vector, Vector, Vector], u: float) -> Vector:
    """Return |s'(u)| from the coefficients of its square, which rounding may make negative."""
    square = q[0] + u * (q[1] + u * (q[2] + u * (q[3] + u * q[4])))
    return root(select(square > 0.0, square, spread(0.0)))


@inlined
def speed_at_goal(w: FloatArray, N: np.uint64, joints: np.uint64, at: Layout) -> Vector:
    """Return |s'(1)| on the last segment."""
    squares = spread(0.0)
    for joint in range(joints):
        knot = joint * at.joint * VECTOR + (N - U1) * PAIR
        a0, m0 = load(w, knot), load(w, knot + VECTOR)
        a1, m1 = load(w, knot + PAIR), load(w, knot + PAIR + VECTOR)
        end = (a1 - a0) + m0 + 2.0 * m1
        squares = squares + end * end
    return root(squares)
