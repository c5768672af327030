"""Messages of MoveIt in files, as plain data that is asked by name, and poses in them."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE, atan2
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.records import FloatArray
from evoexp.scenarios.moveit_messages import check_message

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


class Document:
    """The message of a file, asked by name; errors name the place."""

    def __init__(self, content: bytes, field: str, message: str) -> None:
        """Read a message within limits.

        Args:
            field: The setting that names it, for errors.
            message: Its type, of `moveit_messages.FIELDS`.

        Raises:
            SettingError: If it is no such message, or holds what evoexp does not know.
        """
        from evoexp.scenarios.moveit_yaml import read_message  # most tasks come out of no such file

        self.field = field
        self.root = read_message(content, field)
        check_message(self.root, message, field)

    def mapping(self, value: Any, where: str) -> dict[str, Any]:
        """Return a mapping; an absent one is empty."""
        found: dict[str, Any] = self._of_kind(value, dict, {}, "a mapping", where)
        return found

    def items(self, value: Any, where: str) -> list[Any]:
        """Return a list; an absent one is empty."""
        found: list[Any] = self._of_kind(value, list, [], "a list", where)
        return found

    def names(self, value: Any, where: str) -> list[str]:
        """Return a list of names."""
        return [str(name) for name in self.items(value, where)]

    def numbers(self, value: Any, where: str, count: int | None = None) -> FloatArray:
        """Return a list of numbers.

        Args:
            where: Its place, for errors.
            count: How many there must be; None: any number.
        """
        found = [self.number(each, where) for each in self.items(value, where)]
        if count is not None and len(found) != count:
            raise SettingError(self.field, f"{count} numbers at {where}", len(found))
        return np.array(found, dtype=np.float64)

    def number(self, value: Any, where: str) -> float:
        """Return a number; YAML takes 1e-05 for a text."""
        try:
            number = float(value) if isinstance(value, int | float | str) else np.nan
        except (ValueError, OverflowError):
            number = np.nan
        if isinstance(value, bool) or not abs(number) <= LARGEST:
            must = f"finite numbers, at most {LARGEST:g}, at {where}"
            raise SettingError(self.field, must, str(value)[:40])
        return number + 0.0

    def pose(self, value: Any, where: str) -> Pose:
        """Return a pose; an absent one is the frame's own."""
        given = self.mapping(value, where)
        place = given.get("position", given.get("translation"))
        turn = given.get("orientation", given.get("rotation"))
        position = np.zeros(3) if place is None else self.point(place, where)
        if turn is None:
            return Pose(np.eye(3), position)
        if isinstance(turn, dict):
            turn = [turn.get(key, 0) for key in "xyzw"]
        return Pose(self._rotation(self.numbers(turn, where, 4), where), position)

    def point(self, value: Any, where: str) -> FloatArray:
        """Return a point (3,)."""
        if isinstance(value, dict):
            value = [value.get(key, 0) for key in "xyz"]
        return self.numbers(value, where, 3)

    def _rotation(self, quaternion: FloatArray, where: str) -> FloatArray:
        """Return the rotation of a quaternion x, y, z, w of any length but 0."""
        x, y, z, w = (float(part) for part in quaternion)
        size = x * x + y * y + z * z + w * w
        if size == 0.0:  # ROS leaves an orientation that nobody set at 0
            return np.eye(3)
        length = float(np.sqrt(size))
        if abs(length - 1.0) > SLACK:
            raise SettingError(self.field, f"quaternions of length 1 at {where}", round(length, 6))
        s = 2.0 / size
        return np.array(
            [
                [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
                [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
                [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
            ]
        )

    def _of_kind(self, value: Any, kind: type, absent: Any, name: str, where: str) -> Any:
        if value is None:
            return absent
        if not isinstance(value, kind):
            raise SettingError(self.field, f"{name} at {where}", str(value)[:40])
        return value
