"""Messages of MoveIt in files of YAML or JSON, whose parts know their places, and poses in them.

Which of their fields are read, left out, noted or refused stands in `moveit_messages.yaml`. A field
that no message has is refused: whatever it says would be lost.
"""

import functools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from evoexp.errors import SettingError, demand, nearest
from evoexp.input_files import MEGABYTE
from evoexp.numeric.elementary import DEGREE, atan2, matrix_product
from evoexp.records import FloatArray

MAX_SCENE = 4 * MEGABYTE  # the largest of the data set MotionBenchMaker has 12 kB
SCENE, REQUEST = "PlanningScene", "MotionPlanRequest"
USES = ("read", "left out", "noted")
LARGEST = 1e7  # [m, rad] as of the numbers of robots and scenarios
SLACK = 0.01  # [-] by which a quaternion's length may differ from 1: the numbers are rounded
KINDS = ("", "box", "sphere", "cylinder", "cone", "prism")  # numbered as in SolidPrimitive.msg
MOST_NESTED, MOST_VALUES = 30, 200_000
MUST = "YAML as MoveIt writes it"
ECHO = "; ros2 topic echo --once --full-length TOPIC writes it as YAML"
CUT_OFF = re.compile(r"\.\.\.|<(sequence|array) type: .*>")  # as `topic echo` shortens lists


MESSAGES = yaml.load(
    Path(__file__).with_name("moveit_messages.yaml").read_text(encoding="utf-8"), yaml.CSafeLoader
)
FORMATS = MESSAGES.pop("formats")  # how files of other formats begin, and what to do about it


def _read_fields() -> dict[str, dict[str, str]]:
    """Return message → field → the message in it, or what is done with its value."""
    fields = dict[str, dict[str, str]]()
    for message, rows in MESSAGES.items():
        uses = ((use, rows.pop(use, "")) for use in USES)
        fields[message] = {name: use for use, names in uses for name in names.split()} | rows
    return fields


FIELDS = _read_fields()


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

    An absent mapping, list or text is empty.
    """

    def __init__(self, value: Any, field: str, where: str) -> None:
        """Take the plain data of a part, None of an absent one; its file and its place in it."""
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
        return Pose(turn.rotation() if turn else np.eye(3), place.point if place else np.zeros(3))

    @property
    def point(self) -> FloatArray:
        """A point (3,)."""
        return self._listed("xyz").numbers(3)

    def _listed(self, keys: str) -> "MessagePart":
        if not isinstance(self.value, dict):
            return self
        return MessagePart([self.value.get(key, 0) for key in keys], self.field, self.where)

    def rotation(self) -> FloatArray:
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


class _Loader(yaml.CSafeLoader):  # type: ignore[misc]  # PyYAML's C part has no types
    """Refuses a key that stands twice in a mapping, of which YAML would take the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        keys = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        if twice := sorted({key for key in keys if keys.count(key) > 1}):
            line = node.start_mark.line + 1
            raise yaml.YAMLError(f"the key '{twice[0]}' twice in the mapping at line {line}")
        return super().construct_mapping(node, deep)


@functools.lru_cache(maxsize=64)
def read_document(content: bytes, field: str, message: str) -> MessagePart:
    """Read the only message of a file, of a type that `FIELDS` names."""
    must = f"a file of at most {MAX_SCENE / MEGABYTE:g} MB"
    demand(len(content) <= MAX_SCENE, field, must, f"{len(content) / MEGABYTE:.1f} MB")
    content = content.removeprefix(b"\xef\xbb\xbf")
    for form in FORMATS:
        if re.match(form["begins"].encode(), content, re.IGNORECASE):
            raise SettingError(field, MUST, form["name"], form.get("hint", ""))
    try:
        _check(content, field)
        roots = [root for root in yaml.load_all(content, _Loader) if root is not None]
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        line = str(error).strip().replace("\n", " ")[:120]
        raise SettingError(field, MUST, line) from None
    hint = "; leave the one that is meant in the file"
    was = f"a stream of {len(roots)} (---)"
    demand(len(roots) <= 1, field, f"{MUST}, one message", was, hint)
    root = roots[0] if roots else None
    if not isinstance(root, dict):
        raise SettingError(field, MUST, "nothing" if root is None else type(root).__name__)
    check_message(root, message, field)
    return MessagePart(root, field, "")


def _check(content: bytes, field: str) -> None:
    """Refuse YAML that is deep or large, refers to parts of itself, or was cut off."""
    depth = 0
    for count, event in enumerate(yaml.parse(content, yaml.CSafeLoader)):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if isinstance(event, yaml.AliasEvent):
            raise SettingError(field, "YAML without aliases", f"*{event.anchor}")
        if depth > MOST_NESTED or count > MOST_VALUES:
            must = f"YAML of at most {MOST_VALUES:,} values, nested {MOST_NESTED} deep"
            raise SettingError(field, must, "more")
        if isinstance(event, yaml.ScalarEvent) and CUT_OFF.fullmatch(event.value):
            raise SettingError(field, "a whole message", f"one with '{event.value}'", ECHO)


def check_fields(value: Any, message: str, field: str, where: str = "") -> None:
    """Refuse fields that a message, or a list of such, does not have, or evoexp does not know."""
    if isinstance(value, list):
        for k, item in enumerate(value):
            check_fields(item, message, field, f"{where}[{k}]")
    if not isinstance(value, dict):
        return
    for key, part in value.items():
        place = f"{where}.{key}" if where else str(key)
        use = FIELDS[message].get(str(key), "")
        if not use:
            must = f"made of the fields of {message} ({', '.join(FIELDS[message])})"
            raise SettingError(field, must, place, nearest(str(key), FIELDS[message]))
        if use.startswith("refused: ") and _holds(part):
            must = f"free of {use.removeprefix('refused: ')}, which evoexp does not know"
            raise SettingError(field, must, place)
        if use in FIELDS:
            check_fields(part, use, field, place)


def check_message(root: dict[str, Any], message: str, field: str) -> None:
    """Refuse a file that holds another message, or one that stands below another key."""
    own = FIELDS[message].keys()
    if root and not own & root.keys():
        must = f"a {message} of moveit_msgs by itself"
        for key, part in root.items():
            if isinstance(part, dict) and own & part.keys():
                hint = f"; write the part below '{key}' into a file of its own"
                raise SettingError(field, must, f"one below '{key}'", hint)
        for other in (SCENE, REQUEST):
            demand(FIELDS[other].keys().isdisjoint(root), field, must, f"a {other}")
    check_fields(root, message, field)


def _holds(value: Any) -> bool:
    """Whether a part says anything: an empty message has only empty parts, and perhaps a name."""
    if isinstance(value, dict):
        return any(_holds(part) for key, part in value.items() if key not in ("header", "name"))
    return bool(value)
