"""A log taken apart, to be changed inside and put together again with checksums that fit."""

import struct
import zlib
from contextlib import suppress
from io import BytesIO
from typing import Any

import orjson
import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Metadata,
    MetadataIndex,
    Schema,
)

from evoexp.store.digests import ContentDigest
from evoexp.store.log import CONTENT_DIGEST, SUMMARY

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log_time, publish_time
_KINDS: dict[int, Any] = {
    Opcode.ATTACHMENT: Attachment,
    Opcode.METADATA: Metadata,
    Opcode.CHUNK: Chunk,
    Opcode.CHANNEL: Channel,
    Opcode.SCHEMA: Schema,
}


class Part:
    """A record of the data section.

    Attributes:
        opcode: Its kind.
        body: Its bytes; of a chunk its content, uncompressed.
        size: Of a chunk: the size that it claims; None: its own.
        frame: Of a chunk: its compressed content; None: its content, compressed.
        length: The length of the record that its head tells; None: its own.
    """

    def __init__(self, opcode: int, body: bytes) -> None:
        self.opcode, self.body = opcode, body
        self.size: int | None = None
        self.frame: bytes | None = None
        self.length: int | None = None


def records(content: bytes) -> list[tuple[int, bytes]]:
    """Return (opcode, body) of records that follow each other."""
    found, start = [], 0
    while start < len(content):
        opcode, length = HEAD.unpack_from(content, start)
        found.append((opcode, content[start + HEAD.size : start + HEAD.size + length]))
        start += HEAD.size + length
    return found


def framed(opcode: int, body: bytes, length: int | None = None) -> bytes:
    """Return a record with its head."""
    return HEAD.pack(opcode, len(body) if length is None else length) + body


def written(record: Any) -> bytes:
    """Return the body of a record of mcap."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()[HEAD.size :]


def parsed(kind: Any, body: bytes) -> Any:
    """Return the record of mcap's class `kind` that a body holds."""
    return kind.read(ReadDataStream(BytesIO(body)))


def take_apart(content: bytes) -> list[Part]:
    """Return the records of a log's data section."""
    parts = []
    for opcode, body in records(content[len(MAGIC) : -len(MAGIC)]):
        if opcode == Opcode.DATA_END:
            break
        if opcode == Opcode.CHUNK:
            chunk = parsed(Chunk, body)
            body = zstandard.decompress(chunk.data, chunk.uncompressed_size)
        if opcode != Opcode.MESSAGE_INDEX:  # nobody reads it
            parts.append(Part(opcode, body))
    return parts


def put_together(parts: list[Part], summary: list[tuple[int, bytes]] | None = None) -> bytes:
    """Return the log of some records, with the index of what is in them and fitting checksums.

    Args:
        parts: The records of the data section.
        summary: Records of the summary section instead of those that describe the parts.
    """
    _digest(parts)
    content, index = MAGIC, list[tuple[int, bytes]]()
    for part in parts:
        body = _chunk(part) if part.opcode == Opcode.CHUNK else part.body
        with suppress(Exception):  # what is damaged has no entry
            index += _entries(part, body, len(content))
        content += framed(part.opcode, body, part.length)
    content += framed(Opcode.DATA_END, struct.pack("<I", zlib.crc32(content)))
    start = len(content)
    tail = b"".join(framed(*entry) for entry in (index if summary is None else summary))
    tail += HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQ", start, 0)
    return content + tail + struct.pack("<I", zlib.crc32(tail)) + MAGIC


def index_of(content: bytes) -> list[tuple[int, bytes]]:
    """Return the records of a log's summary section."""
    start = struct.unpack_from("<Q", content, len(content) - 8 - 20)[0]
    return records(content[start : -8 - 20 - HEAD.size])


def message(channel: int, data: bytes) -> bytes:
    """Return a message's record."""
    return framed(Opcode.MESSAGE, MESSAGE.pack(channel, 0, 0, 0) + data)


def _chunk(part: Part) -> bytes:
    frame = zstandard.compress(part.body) if part.frame is None else part.frame
    size = len(part.body) if part.size is None else part.size
    crc = 0 if part.frame is not None else zlib.crc32(part.body)
    return written(Chunk("zstd", frame, 0, 0, crc, size))


def _entries(part: Part, body: bytes, offset: int) -> list[tuple[int, bytes]]:
    found: list[tuple[int, bytes]] = []
    if part.opcode == Opcode.CHUNK:
        inner = records(part.body)
        channels = {struct.unpack_from("<H", b)[0] for op, b in inner if op == Opcode.MESSAGE}
        found += [entry for entry in inner if entry[0] in (Opcode.SCHEMA, Opcode.CHANNEL)]
        entry = ChunkIndex(len(body), offset, "zstd", 0, 0, 0, dict.fromkeys(channels, 0), 0, 0)
        found.append((Opcode.CHUNK_INDEX, written(entry)))
    elif part.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
        found.append((part.opcode, body))
    elif part.opcode == Opcode.ATTACHMENT:
        one = parsed(Attachment, body)
        place = AttachmentIndex(offset, len(body), 0, 0, len(one.data), one.name, one.media_type)
        found.append((Opcode.ATTACHMENT_INDEX, written(place)))
    elif part.opcode == Opcode.METADATA:
        name = parsed(Metadata, body).name
        found.append((Opcode.METADATA_INDEX, written(MetadataIndex(offset, len(body), name))))
    return found


def _digest(parts: list[Part]) -> None:
    """Put the digest of the messages, as they are now, into the summary."""
    digest, channels, schemas = ContentDigest(), dict[int, Channel](), dict[int, str]()
    with suppress(Exception):
        for part in parts:
            for opcode, body in records(part.body) if part.opcode == Opcode.CHUNK else ():
                if opcode == Opcode.SCHEMA:
                    schemas[parsed(Schema, body).id] = parsed(Schema, body).name
                elif opcode == Opcode.CHANNEL:
                    channels[parsed(Channel, body).id] = parsed(Channel, body)
                elif opcode == Opcode.MESSAGE:
                    number, sequence, log_time, _ = MESSAGE.unpack_from(body)
                    own = channels[number]
                    identity = (own.topic, schemas[own.schema_id], own.message_encoding)
                    digest.update(identity, log_time, sequence, body[MESSAGE.size :])
        for part in parts:
            if part.opcode == Opcode.METADATA:
                metadata = parsed(Metadata, part.body)
                if metadata.name == SUMMARY:
                    metadata.metadata[CONTENT_DIGEST] = orjson.dumps(digest.hexdigest()).decode()
                    part.body = written(metadata)
