"""Planar arms at multiples of 15° in exact arithmetic: numbers a + b √2 + c √3 + d √6."""

import functools
from decimal import Decimal, localcontext
from typing import Any, Union

from references.link_crossings_numpy import exact_touch

Term = Union["Surd", int]
Point = tuple["Surd", "Surd"]
_ROOTS = (1.0, 2.0**0.5, 3.0**0.5, 6.0**0.5)


@functools.total_ordering
class Surd:
    """A number a + b √2 + c √3 + d √6 of integers; zero only if all four are."""

    __slots__ = ("terms",)

    def __init__(self, *terms: int) -> None:
        self.terms = terms + (0,) * (4 - len(terms))

    def __add__(self, other: Term) -> "Surd":
        return Surd(*(x + y for x, y in zip(self.terms, _surd(other).terms, strict=True)))

    def __neg__(self) -> "Surd":
        return Surd(*(-x for x in self.terms))

    def __sub__(self, other: Term) -> "Surd":
        return self + -_surd(other)

    def __mul__(self, other: Term) -> "Surd":
        (a, b, c, d), (e, f, g, h) = self.terms, _surd(other).terms
        return Surd(
            a * e + 2 * b * f + 3 * c * g + 6 * d * h,
            a * f + b * e + 3 * (c * h + d * g),
            a * g + c * e + 2 * (b * h + d * f),
            a * h + d * e + b * g + c * f,
        )

    @property
    def sign(self) -> int:
        """Its sign, 0 if it is zero."""
        parts = [x * root for x, root in zip(self.terms, _ROOTS, strict=True)]
        value: Any = sum(parts)
        if abs(value) <= 1e-12 * sum(map(abs, parts)):
            with localcontext() as context:
                context.prec = 200
                roots = (Decimal(k).sqrt() for k in (1, 2, 3, 6))
                value = sum(x * root for x, root in zip(self.terms, roots, strict=True))
        return 0 if not any(self.terms) else 1 if value > 0 else -1

    def __eq__(self, other: object) -> bool:
        return isinstance(other, int | Surd) and not any((self - other).terms)

    def __lt__(self, other: Term) -> bool:
        return (self - other).sign < 0

    __hash__ = None  # type: ignore[assignment]


def _surd(value: Term) -> Surd:
    return value if isinstance(value, Surd) else Surd(value)


def cosine_times_4(degrees: int) -> Surd:
    """Return four times the cosine of a multiple of 15°."""
    turn = degrees % 360
    if turn > 180:
        turn = 360 - turn
    if turn > 90:
        return -cosine_times_4(180 - turn)
    table = {0: (4,), 15: (0, 1, 0, 1), 30: (0, 0, 2), 45: (0, 2), 60: (2,), 75: (0, -1, 0, 1)}
    return Surd(*table.get(turn, (0,)))


def direction_times_4(degrees: int) -> Point:
    """Return four times the unit vector at a multiple of 15°."""
    return cosine_times_4(degrees), cosine_times_4(degrees - 90)


def exact_arm(base: tuple[int, int], link: int, posture: tuple[int, int]) -> list[Point]:
    """Return base, elbow and tip of an arm of two links as long as `link`, a multiple of 4.

    Angles of links are from +x [deg], multiples of 15.
    """
    points = [(Surd(base[0]), Surd(base[1]))]
    for degrees in posture:
        x, y = direction_times_4(degrees)
        points.append((points[-1][0] + x * (link // 4), points[-1][1] + y * (link // 4)))
    return points


def exact_boundaries(
    base: tuple[int, int], link: int, posture: tuple[int, int], half_width: int
) -> list[tuple[Point, Point]]:
    """Return the boundary lines of an arm; `half_width` is a multiple of 4."""
    points, lines = exact_arm(base, link, posture), []
    for (start, end), degrees in zip(
        zip(points[:-1], points[1:], strict=True), posture, strict=True
    ):
        x, y = direction_times_4(degrees + 90)
        for side in (-half_width // 4, half_width // 4):
            moved = [(p[0] + x * side, p[1] + y * side) for p in (start, end)]
            lines.append((moved[0], moved[1]))
    return lines


def within(start: Point, end: Point, center: Point, radius: int) -> bool:
    """Return whether a segment comes as near to a point as a radius."""
    (ux, uy), (x, y) = _from(start, end), _from(start, center)
    squared, along = ux * ux + uy * uy, ux * x + uy * y
    if along < 0 or squared == 0:
        return x * x + y * y <= Surd(radius * radius)
    if along > squared:
        x, y = _from(end, center)
        return x * x + y * y <= Surd(radius * radius)
    across = ux * y - uy * x
    return across * across <= squared * (radius * radius)


def as_near(one: tuple[Point, Point], two: tuple[Point, Point], radius: int) -> bool:
    """Return whether two segments come as near to each other as a radius."""
    return exact_touch(*one, *two) or any(
        within(*line, end, radius) for line, other in ((one, two), (two, one)) for end in other
    )


def _from(start: Point, end: Point) -> Point:
    return end[0] - start[0], end[1] - start[1]
