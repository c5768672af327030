"""Logs of which one part is replaced, with checksums, content digest and index that fit."""

from collections.abc import Callable
from typing import Any

import orjson
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata

from store.log_anatomy import (
    MESSAGE,
    Part,
    framed,
    parsed,
    put_together,
    records,
    take_apart,
    written,
)

Row = dict[str, Any]


def with_message(
    content: bytes, topic: str, change: Callable[[Row], Row | None], which: int = -1
) -> bytes:
    """Return a log with another message.

    Args:
        content: The log.
        topic: Of the message.
        change: Returns the message's new fields; None: the message is left out.
        which: Number of the message on its topic.
    """
    parts = take_apart(content)
    chunks = [(part, records(part.body)) for part in parts if part.opcode == Opcode.CHUNK]
    channels = [parsed(Channel, body) for _, inner in chunks for op, body in inner if op == 4]
    number = next(each.id for each in channels if each.topic == topic)
    places = [
        (inner, k)
        for _, inner in chunks
        for k, (op, body) in enumerate(inner)
        if op == Opcode.MESSAGE and MESSAGE.unpack_from(body)[0] == number
    ]
    inner, k = places[which]
    body = inner[k][1]
    row = change(orjson.loads(body[MESSAGE.size :]))
    changed = [] if row is None else [(Opcode.MESSAGE, body[: MESSAGE.size] + orjson.dumps(row))]
    inner[k : k + 1] = changed
    for part, entries in chunks:
        part.body = b"".join(framed(*entry) for entry in entries)
    return put_together(parts)


def with_attachment(
    content: bytes, name: str, data: bytes | None, *, beside: bool = False
) -> bytes:
    """Return a log with another attachment of a name; None: without it.

    Args:
        content: The log.
        name: Of the attachment, which may be a new one.
        data: Its content.
        beside: Whether one that is there stays, behind the other one.
    """
    parts = take_apart(content)
    one = [] if data is None else [Part(Opcode.ATTACHMENT, written(attachment(name, data)))]
    there = [p for p in parts if p.opcode == Opcode.ATTACHMENT and _name(p) == name]
    at = parts.index(there[0]) if there else 0
    rest = [part for part in parts if part not in there or beside]
    return put_together([*rest[:at], *one, *rest[at:]])


def attachment(name: str, data: bytes) -> Attachment:
    """Return the record of an attachment."""
    kind = "application/json" if name.endswith(".json") else "application/octet-stream"
    return Attachment(0, 0, name, kind, data)


def with_metadata(content: bytes, name: str, **values: Any) -> bytes:
    """Return a log with other values in one of its metadata records."""
    parts = take_apart(content)
    for part in parts:
        if part.opcode == Opcode.METADATA and _metadata(part).name == name:
            metadata = _metadata(part)
            metadata.metadata |= {
                key: orjson.dumps(value).decode() for key, value in values.items()
            }
            part.body = written(metadata)
    return put_together(parts)


def _name(part: Part) -> str:
    return str(parsed(Attachment, part.body).name)


def _metadata(part: Part) -> Any:
    return parsed(Metadata, part.body)
