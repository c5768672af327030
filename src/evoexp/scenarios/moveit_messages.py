"""The fields of MoveIt's messages: which are read, left out, noted or refused.

They stand in `moveit_messages.yaml`. A field that no message has is refused: whatever it says would
be lost.
"""

from pathlib import Path
from typing import Any

import yaml

from evoexp.errors import SettingError, nearest
from evoexp.input_files import MEGABYTE

MAX_SCENE = 4 * MEGABYTE  # the largest of the data set MotionBenchMaker has 12 kB
SCENE, REQUEST = "PlanningScene", "MotionPlanRequest"
USES = ("read", "left out", "noted")


def _read_fields() -> dict[str, dict[str, str]]:
    """Return message → field → the message in it, or what is done with its value."""
    text = Path(__file__).with_name("moveit_messages.yaml").read_text(encoding="utf-8")
    messages, fields = yaml.load(text, yaml.CSafeLoader), dict[str, dict[str, str]]()
    for message, rows in messages.items():
        uses = ((use, rows.pop(use, "")) for use in USES)
        fields[message] = {name: use for use, names in uses for name in names.split()} | rows
    return fields


FIELDS = _read_fields()


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
            if FIELDS[other].keys() & root.keys():
                raise SettingError(field, must, f"a {other}")
    check_fields(root, message, field)


def _holds(value: Any) -> bool:
    """Whether a part says anything: an empty message has only empty parts, and perhaps a name."""
    if isinstance(value, dict):
        return any(_holds(part) for key, part in value.items() if key not in ("header", "name"))
    return bool(value)
