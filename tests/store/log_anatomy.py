"""A log taken apart, to be changed inside and put together again with checksums that fit."""

import struct
import zlib
from contextlib import suppress
from io import BytesIO
from typing import Any

import orjson
import xxhash
import zstandard
from mcap import records as mcap
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode

from evoexp.store.log import CONTENT_DIGEST, SUMMARY, message_bytes

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log_time, publish_time
Record = tuple[int, bytes]  # opcode, body


class Part:
    """A record of the data section."""

    def __init__(self, opcode: int, body: bytes) -> None:
        self.opcode, self.body = opcode, body  # of a chunk: its content, uncompressed
        self.size: int | None = None  # that a chunk claims; None: its own
        self.frame: bytes | None = None  # compressed content; None: of the body
        self.length: int | None = None  # that the record's head tells; None: its own


def records(content: bytes) -> list[Record]:
    """Return records that follow each other."""
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
            chunk = parsed(mcap.Chunk, body)
            body = zstandard.decompress(chunk.data, chunk.uncompressed_size)
        if opcode != Opcode.MESSAGE_INDEX:  # nobody reads it
            parts.append(Part(opcode, body))
    return parts


def put_together(parts: list[Part], summary: list[Record] | None = None) -> bytes:
    """Return the log of some records; `summary` stands in the place of their index if given."""
    with suppress(Exception):  # of what is damaged no digest fits
        _digest(parts)
    content, index = MAGIC, list[Record]()
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


def index_of(content: bytes) -> list[Record]:
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
    return written(mcap.Chunk("zstd", frame, 0, 0, crc, size))


def _entries(part: Part, body: bytes, offset: int) -> list[Record]:
    """Return what the index says of a record that begins at an offset."""
    place: Any
    match part.opcode:
        case Opcode.CHUNK:
            inner = records(part.body)
            channels = {struct.unpack_from("<H", b)[0] for op, b in inner if op == Opcode.MESSAGE}
            known = dict.fromkeys(channels, 0)
            place = mcap.ChunkIndex(len(body), offset, "zstd", 0, 0, 0, known, 0, 0)
            described = [entry for entry in inner if entry[0] in (Opcode.SCHEMA, Opcode.CHANNEL)]
            return [*described, (Opcode.CHUNK_INDEX, written(place))]
        case Opcode.SCHEMA | Opcode.CHANNEL:
            return [(part.opcode, body)]
        case Opcode.ATTACHMENT:
            one = parsed(mcap.Attachment, body)
            named = (len(one.data), one.name, one.media_type)
            place = mcap.AttachmentIndex(offset, len(body), 0, 0, *named)
            return [(Opcode.ATTACHMENT_INDEX, written(place))]
        case Opcode.METADATA:
            place = mcap.MetadataIndex(offset, len(body), parsed(mcap.Metadata, body).name)
            return [(Opcode.METADATA_INDEX, written(place))]
    return []


def _digest(parts: list[Part]) -> None:
    """Put the digest of the messages, as they are now, into the summary."""
    digest, channels, schemas = xxhash.xxh3_128(), dict[int, mcap.Channel](), dict[int, str]()
    chunks = [records(part.body) for part in parts if part.opcode == Opcode.CHUNK]
    for opcode, body in (record for chunk in chunks for record in chunk):
        if opcode == Opcode.SCHEMA:
            schemas[parsed(mcap.Schema, body).id] = parsed(mcap.Schema, body).name
        elif opcode == Opcode.CHANNEL:
            channels[parsed(mcap.Channel, body).id] = parsed(mcap.Channel, body)
        elif opcode == Opcode.MESSAGE:
            number, sequence, log_time, _ = MESSAGE.unpack_from(body)
            own = channels[number]
            identity = (own.topic, schemas[own.schema_id], own.message_encoding)
            digest.update(message_bytes(identity, log_time, sequence, body[MESSAGE.size :]))
    for part in parts:
        if part.opcode == Opcode.METADATA:
            metadata = parsed(mcap.Metadata, part.body)
            if metadata.name == SUMMARY:
                metadata.metadata[CONTENT_DIGEST] = orjson.dumps(digest.hexdigest()).decode()
                part.body = written(metadata)
