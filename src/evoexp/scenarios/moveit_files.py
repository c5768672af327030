"""Messages of MoveIt in files, whose parts know their places, and poses in them."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE, atan2
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.records import FloatArray

LARGEST = 1e7  # [m, rad] as of the numbers of robots and scenarios
SLACK = 0.01  # [-] by which a quaternion's length may differ from 1: the numbers are rounded
KINDS = ("", "box", "sphere", "cylinder", "cone", "prism")  # numbered as in SolidPrimitive.msg


class Pose(NamedTuple):
    """A place and an orientation."""

    rotation: FloatArray  # (3, 3)
    position: FloatArray  # (3,) [m]

    def times(self, other: "Pose") -> "Pose":
        """Return a pose that is given in this one's frame."""
        return Pose(matrix_product(self.rotation, other.rotation), self.of_point(other.position))

    def of_point(self, point: FloatArray) -> FloatArray:
        """Return a point (3,) that is given in this one's frame."""
        return np.asarray(matrix_product(self.rotation, point) + self.position)

    @property
    def inverse(self) -> "Pose":
        """The pose of the frame in which this one is given, in this one's frame."""
        turned = self.rotation.T
        return Pose(turned, -matrix_product(turned, self.position))

    def is_near(self, other: "Pose", tolerance: float) -> bool:
        """Whether all numbers of two poses agree within a tolerance [m, -]."""
        pairs = zip(self, other, strict=True)
        return all(np.allclose(a, b, rtol=0.0, atol=tolerance) for a, b in pairs)

    @property
    def angles(self) -> tuple[float, float, float]:
        """Roll, pitch, yaw [deg]: rotation = Rz(yaw) Ry(pitch) Rx(roll)."""
        r = self.rotation
        level = float(np.sqrt(r[0, 0] * r[0, 0] + r[1, 0] * r[1, 0]))
        pitch = atan2(-float(r[2, 0]), level)
        if level > 1e-9:
            roll, yaw = atan2(r[2, 1], r[2, 2]), atan2(r[1, 0], r[0, 0])
        else:  # x stands upright: only the sum or difference of roll and yaw matters
            roll, yaw = 0.0, atan2(-r[0, 1], r[1, 1])
        return roll / DEGREE, pitch / DEGREE, yaw / DEGREE

    @property
    def text(self) -> str:
        """The pose as a message shows it."""
        rows = self.position, self.angles
        place, angles = (", ".join(f"{x + 0.0:g}" for x in row) for row in rows)
        return f"at ({place}) m, turned by ({angles})°"


IDENTITY = Pose(np.eye(3), np.zeros(3))


def primitive_kind(value: Any) -> str:
    """Return the kind of a primitive, which is a number or, by robowflex, a name."""
    is_number = type(value) is int and 0 < value < len(KINDS)
    return KINDS[value] if is_number else str(value).lower()


class MessagePart:
    """A part of a message, with its place in the file; false if it is absent.

    Whatever it is asked for, it raises a `SettingError` that names the place if it is something
    else. An absent mapping, list or text is empty.
    """

    def __init__(self, value: Any, field: str, where: str) -> None:
        """Take the plain data of a part.

        Args:
            value: The data; None: the part is absent.
            field: The setting that names the file.
            where: Its place in the file, as errors name it.
        """
        self.value, self.field, self.where = value, field, where

    def __bool__(self) -> bool:
        """Whether the part is there."""
        return self.value is not None

    def __getitem__(self, name: str) -> "MessagePart":
        """Return a field of a mapping."""
        where = f"{self.where}.{name}" if self.where else name
        return MessagePart(self._of_kind(dict, "a mapping").get(name), self.field, where)

    def __iter__(self) -> Iterator["MessagePart"]:
        """Yield the items of a list."""
        for k, value in enumerate(self._of_kind(list, "a list")):
            yield MessagePart(value, self.field, f"{self.where}[{k}]")

    def called(self, where: str) -> "MessagePart":
        """Return the part under another name for its place."""
        return MessagePart(self.value, self.field, where)

    def refusal(self, must: str, was: Any, hint: str = "") -> SettingError:
        """Return the error that the file must be something else."""
        return SettingError(self.field, must, was, hint)

    def require(self, is_met: object, must: str, was: Any) -> None:
        """Refuse the file, which must be something else, unless a condition is met."""
        if not is_met:
            raise self.refusal(must, was)

    @property
    def text(self) -> str:
        """A text; an absent one is empty."""
        return "" if self.value is None else str(self.value)

    @property
    def names(self) -> list[str]:
        """A list of names."""
        return [str(item.value) for item in self]

    def numbers(self, count: int | None = None) -> FloatArray:
        """Return a list of numbers, so many if a count is given."""
        values = [item.number() for item in self]
        is_full = count in (None, len(values))
        self.require(is_full, f"{count} numbers at {self.where}", len(values))
        return np.array(values, dtype=np.float64)

    def number(self, absent: float | None = None) -> float:
        """Return a number, or that of an absent part; YAML takes 1e-05 for a text."""
        value = self.value if self else absent
        try:
            number = float(value) if isinstance(value, int | float | str) else np.nan
        except (ValueError, OverflowError):
            number = np.nan
        if isinstance(value, bool) or not abs(number) <= LARGEST:
            must = f"finite numbers, at most {LARGEST:g}, at {self.where}"
            raise self.refusal(must, str(value)[:40])
        return number + 0.0

    @property
    def pose(self) -> Pose:
        """A pose; an absent one is the frame's own."""
        place = self["position"] or self["translation"]
        turn = self["orientation"] or self["rotation"]
        return Pose(turn._rotation() if turn else np.eye(3), place.point if place else np.zeros(3))

    @property
    def point(self) -> FloatArray:
        """A point (3,)."""
        return self._listed("xyz").numbers(3)

    def _listed(self, keys: str) -> "MessagePart":
        """Return a mapping of coordinates as a list."""
        if not isinstance(self.value, dict):
            return self
        return MessagePart([self.value.get(key, 0) for key in keys], self.field, self.where)

    def _rotation(self) -> FloatArray:
        """Return the rotation of a quaternion x, y, z, w of any length but 0."""
        x, y, z, w = (float(part) for part in self._listed("xyzw").numbers(4))
        size = x * x + y * y + z * z + w * w
        if size == 0.0:  # ROS leaves an orientation that nobody set at 0
            return np.eye(3)
        length, must = float(np.sqrt(size)), f"quaternions of length 1 at {self.where}"
        self.require(abs(length - 1.0) <= SLACK, must, round(length, 6))
        s = 2.0 / size
        return np.array(
            [
                [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
                [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
                [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
            ]
        )

    def _of_kind(self, kind: type, name: str) -> Any:
        if self.value is None:
            return kind()
        if not isinstance(self.value, kind):  # its text may be long: made for an error only
            raise self.refusal(f"{name} at {self.where}", str(self.value)[:40])
        return self.value
