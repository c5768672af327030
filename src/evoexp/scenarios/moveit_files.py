"""Planning scenes and motion plan requests as MoveIt writes them in YAML.

They are read as plain data, within limits. What evoexp does not know (attached objects, padding,
constraints on the path) is refused by its name; settings of MoveIt's own planners are left out.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.input_files import MEGABYTE
from evoexp.numeric.elementary import DEGREE, atan2
from evoexp.records import FloatArray

MAX_SCENE = 4 * MEGABYTE  # the largest of the data set MotionBenchMaker has 12 kB
MOST_NESTED, MOST_VALUES = 30, 200_000
LARGEST = 1e7  # [m, rad] as of the numbers of robots and scenarios
KINDS = ("", "box", "sphere", "cylinder", "cone", "prism")  # numbered as in SolidPrimitive.msg
# what a scene or a request may hold that evoexp does not know, by where it stands
UNKNOWN_OF_SCENE = {
    "robot_state.attached_collision_objects": "attached objects",
    "world.octomap.octomap.data": "octomaps",
}
UNKNOWN_OF_REQUEST = {
    "start_state.attached_collision_objects": "attached objects",
    "path_constraints": "path constraints",
    "trajectory_constraints": "trajectory constraints",
}


class Pose(NamedTuple):
    """A place and an orientation.

    Attributes:
        rotation: (3, 3).
        position: (3,) [m].
    """

    rotation: FloatArray
    position: FloatArray

    def times(self, other: "Pose") -> "Pose":
        """Return a pose that is given in this one's frame."""
        return Pose(_product(self.rotation, other.rotation), self.of_point(other.position))

    def of_point(self, point: FloatArray) -> FloatArray:
        """Return a point (3,) that is given in this one's frame."""
        return np.asarray(_product(self.rotation, point[:, None])[:, 0] + self.position)

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


IDENTITY = Pose(np.eye(3), np.zeros(3))


class Document:
    """A file's data, asked by name; errors name the place."""

    def __init__(self, content: bytes, field: str) -> None:
        """Read YAML within limits.

        Args:
            content: Of the file.
            field: The setting that names it, for errors.

        Raises:
            SettingError: If it is no mapping, too large or too deep, or refers to parts of itself.
        """
        import yaml  # most tasks come out of no such file

        self.field = field
        if len(content) > MAX_SCENE:
            must = f"a file of at most {MAX_SCENE / MEGABYTE:g} MB"
            raise SettingError(field, must, f"{len(content) / MEGABYTE:.1f} MB")
        try:
            self._check(content)
            self.root = yaml.load(content, yaml.CSafeLoader)
        except (yaml.YAMLError, ValueError, RecursionError) as error:
            line = str(error).strip().replace("\n", " ")[:120]
            raise SettingError(field, "YAML as MoveIt writes it", line) from None
        if not isinstance(self.root, dict):
            raise SettingError(field, "YAML as MoveIt writes it", type(self.root).__name__)

    def _check(self, content: bytes) -> None:
        import yaml

        depth = 0
        for count, event in enumerate(yaml.parse(content, yaml.CSafeLoader)):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if isinstance(event, yaml.AliasEvent):
                raise SettingError(self.field, "YAML without aliases", f"*{event.anchor}")
            if depth > MOST_NESTED or count > MOST_VALUES:
                must = f"YAML of at most {MOST_VALUES:,} values, nested {MOST_NESTED} deep"
                raise SettingError(self.field, must, "more")

    def refuse(self, unknown: Mapping[str, str]) -> None:
        """Refuse parts that evoexp does not know, wherever they hold something.

        Args:
            unknown: Path of a part → its name.
        """
        for path, name in unknown.items():
            value: Any = self.root
            for key in path.split("."):
                value = value.get(key) if isinstance(value, dict) else None
            if _holds(value):
                raise SettingError(self.field, f"free of {name}, which evoexp does not know", path)

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
            value: The list.
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
        if abs(size - 1.0) > 1e-2:
            raise SettingError(self.field, f"quaternions of length 1 at {where}", size)
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


def _holds(value: Any) -> bool:
    """Whether a part says anything: an empty message has only empty parts."""
    if isinstance(value, dict):
        return any(_holds(part) for key, part in value.items() if key != "header")
    return bool(value)


def _product(one: FloatArray, two: FloatArray) -> FloatArray:
    """Multiply matrices (3, 3) and (3, n), sums in a fixed order."""
    rows = [one[k, 0] * two[0] + one[k, 1] * two[1] + one[k, 2] * two[2] for k in range(3)]
    return np.array(rows)
