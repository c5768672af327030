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
    """Return a log with another message, the `which`-th of its topic; None leaves it out."""
    parts = take_apart(content)
    chunks = [(part, records(part.body)) for part in parts if part.opcode == Opcode.CHUNK]
    every = [(inner, k) for _, inner in chunks for k in range(len(inner))]
    channels = [parsed(Channel, i[k][1]) for i, k in every if i[k][0] == Opcode.CHANNEL]
    number = next(each.id for each in channels if each.topic == topic)
    messages = [(inner, k) for inner, k in every if inner[k][0] == Opcode.MESSAGE]
    inner, k = [(i, k) for i, k in messages if MESSAGE.unpack_from(i[k][1])[0] == number][which]
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
    """Return a log with another attachment of a name, before the old one or in its place."""
    parts = take_apart(content)
    one = [] if data is None else [Part(Opcode.ATTACHMENT, written(attachment(name, data)))]
    every = [part for part in parts if part.opcode == Opcode.ATTACHMENT]
    there = [part for part in every if parsed(Attachment, part.body).name == name]
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
        if part.opcode == Opcode.METADATA:
            metadata = parsed(Metadata, part.body)
            if metadata.name == name:
                metadata.metadata |= {k: orjson.dumps(v).decode() for k, v in values.items()}
                part.body = written(metadata)
    return put_together(parts)
