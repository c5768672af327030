"""What the records of an MCAP say, as far as a log is read: thousands of logs are, and mcap's own records take longer.

Whatever does not fit raises ValueError or struct.error.
"""

import struct
import zlib
from typing import NamedTuple

import zstandard

_U16, _U32, _U64 = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")
_CHUNK = struct.Struct("<QQQI")  # first and last log_time, size and CRC of the plain content
_PLACE = struct.Struct(
    "<QQQQI"
)  # first and last log_time, offset and length of the chunk, bytes of the map that follows
_PAIR = struct.Struct("<HQ")  # channel, offset of its index


class Channel(NamedTuple):
    """A channel as the summary section repeats it."""

    number: int
    schema: int
    topic: str
    encoding: str


class ChunkPlace(NamedTuple):
    """Where a chunk starts, and whose messages it holds."""

    offset: int
    channels: frozenset[int]


def read_metadata(body: bytes) -> dict[str, str]:
    """Return the texts of a metadata record by name."""
    _, start = _text(body, 0)
    end = start + 4 + _U32.unpack_from(body, start)[0]
    start += 4
    values = {}
    while start < end:
        name, start = _text(body, start)
        values[name], start = _text(body, start)
    return values


def read_metadata_index(body: bytes) -> tuple[str, int]:
    """Return name and offset of a metadata record."""
    return _text(body, 16)[0], _U64.unpack_from(body)[0]


def read_attachment(body: bytes) -> tuple[str, bytes]:
    """Return name and content of an attachment."""
    name, start = _text(body, 16)
    _, start = _text(body, start)
    return name, _piece(body, start + 8, _U64.unpack_from(body, start)[0])


def read_schema(body: bytes) -> tuple[int, str]:
    """Return number and name of a schema."""
    return _U16.unpack_from(body)[0], _text(body, 2)[0]


def read_channel(body: bytes) -> Channel:
    """Return a channel."""
    topic, start = _text(body, 4)
    return Channel(_U16.unpack_from(body)[0], _U16.unpack_from(body, 2)[0], topic, _text(body, start)[0])


def read_chunk_index(body: bytes) -> ChunkPlace:
    """Return where a chunk is."""
    _, _, offset, _, length = _PLACE.unpack_from(body)
    pairs = _PAIR.iter_unpack(_piece(body, _PLACE.size, length))
    return ChunkPlace(offset, frozenset(channel for channel, _ in pairs))


def read_chunk(body: bytes) -> bytes:
    """Return the plain content of a chunk, its checksum verified."""
    _, _, size, crc = _CHUNK.unpack_from(body)
    compression, start = _text(body, _CHUNK.size)
    data = _piece(body, start + 8, _U64.unpack_from(body, start)[0])
    if compression == "zstd":
        data = zstandard.decompress(data, size)
    elif compression:
        raise ValueError(f"compression '{compression}'")
    if len(data) != size or zlib.crc32(data) != crc:
        raise ValueError("the checksum of a chunk is wrong")
    return data


def _text(body: bytes, start: int) -> tuple[str, int]:
    """Return a text and where it ends."""
    end = start + 4 + _U32.unpack_from(body, start)[0]
    if end > len(body):
        raise ValueError(f"a text ends at byte {end} of a record of {len(body)}")
    return str(body[start + 4 : end], "utf-8"), end


def _piece(body: bytes, start: int, length: int) -> bytes:
    piece = body[start : start + length]
    if len(piece) != length:
        raise ValueError(f"{length} bytes at byte {start} of a record of {len(body)}")
    return piece
