"""YAML and JSON of one message, read within limits; files of other formats are named."""

import re
from typing import Any

import yaml

from evoexp.errors import SettingError
from evoexp.input_files import MEGABYTE
from evoexp.scenarios.moveit_files import MessagePart
from evoexp.scenarios.moveit_messages import MAX_SCENE, check_message

MOST_NESTED, MOST_VALUES = 30, 200_000
MUST = "YAML as MoveIt writes it"
ECHO = "; ros2 topic echo --once --full-length TOPIC writes it as YAML"
# how files of other formats begin, and what to do about it
FORMATS = (
    (rb"\s*\Z", "an empty file", ""),
    (rb"version https://git-lfs", "a pointer of Git LFS", "; git lfs pull brings the file"),
    (rb"#ROSBAG V|SQLite format 3\0|\x89MCAP", "a bag", f"; play it: {ECHO[2:]}"),
    (rb"# Octomap", "an octomap", "; evoexp knows objects of primitives and meshes only"),
    (rb"\s*<(!doctype )?html", "an HTML page", "; download the file itself"),
    (rb"\s*<[?!\w]", "XML", ""),
    (rb"\x1f\x8b|PK\x03\x04|BZh|\xfd7zXZ", "a compressed file", "; unpack it"),
    (
        rb"[^\n]*\n\s*(\*\s|\.\s*\Z)",
        "MoveIt's text format (.scene)",
        f"; load it in RViz: {ECHO[2:]}",
    ),
    (rb"[^\0]*\0", "a binary file", ""),
)
CUT_OFF = re.compile(r"\.\.\.|<(sequence|array) type: .*>")  # as `topic echo` shortens lists


class _Loader(yaml.CSafeLoader):  # type: ignore[misc]  # PyYAML's C part has no types
    """Refuses a key that stands twice in a mapping, of which YAML would take the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        keys = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        if twice := sorted({key for key in keys if keys.count(key) > 1}):
            line = node.start_mark.line + 1
            raise yaml.YAMLError(f"the key '{twice[0]}' twice in the mapping at line {line}")
        return super().construct_mapping(node, deep)


def read_document(content: bytes, field: str, message: str) -> MessagePart:
    """Read the only message of a file.

    Args:
        content: Of a file.
        field: The setting that names it, for errors.
        message: Its type, of `moveit_messages.FIELDS`.

    Raises:
        SettingError: If the file is of another format, too large or too deep, or refers to parts of
            itself; if it holds no message, several, another one, lists that were cut off, or what
            evoexp does not know.
    """
    if len(content) > MAX_SCENE:
        must = f"a file of at most {MAX_SCENE / MEGABYTE:g} MB"
        raise SettingError(field, must, f"{len(content) / MEGABYTE:.1f} MB")
    content = content.removeprefix(b"\xef\xbb\xbf")
    for begins, name, hint in FORMATS:
        if re.match(begins, content, re.IGNORECASE):
            raise SettingError(field, MUST, name, hint)
    try:
        _check(content, field)
        roots = [root for root in yaml.load_all(content, _Loader) if root is not None]
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        line = str(error).strip().replace("\n", " ")[:120]
        raise SettingError(field, MUST, line) from None
    if len(roots) > 1:
        must = f"{MUST}, one message"
        hint = "; leave the one that is meant in the file"
        raise SettingError(field, must, f"a stream of {len(roots)} (---)", hint)
    root = roots[0] if roots else None
    if not isinstance(root, dict):
        raise SettingError(field, MUST, "nothing" if root is None else type(root).__name__)
    check_message(root, message, field)
    return MessagePart(root, field, "")


def _check(content: bytes, field: str) -> None:
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
