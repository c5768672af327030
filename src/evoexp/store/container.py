"""The bytes of an MCAP: checked as a whole before they are used, then walked record by record.

mcap's own readers check neither the summary section nor that the file ends where it should, and
cost ten times as much.

A log may come from anybody, and checksums are no proof of good will. Whatever a file claims, what
is read of it takes memory in proportion to `MAX_LOG` and `MAX_MESSAGE`: sizes are compared with
these limits before anything is decompressed or decoded.
"""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex

from evoexp.errors import CorruptLog
from evoexp.input_files import MEGABYTE

# Of a log's file, and of all its messages together. The largest log of a shipped experiment holds
# 2.5 MB of messages; 128 MB are some 350,000 generations without a better solution.
MAX_LOG = 128 * MEGABYTE
# One solution or front: 300,000 numbers. The largest of a shipped experiment takes 60 kB.
MAX_MESSAGE = 8 * MEGABYTE
MAX_CHUNK = MAX_MESSAGE + 64 * 1024  # a chunk ends with the message that passes 56 KiB
MAX_METADATA = MEGABYTE  # [B] of a record of metadata, and of one of the summary section
MAX_ATTACHMENTS = 1000
# Reading a log takes at most so many times the memory of `MAX_LOG`, whatever the log holds.
MEMORY_FACTOR = 10

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")  # opcode, length
_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log_time, publish_time
_CHUNK_SIZE = struct.Struct("<16xQ")  # of a chunk's body: start and end time, uncompressed size
_FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, summary offset start, CRC
_DATA_END = struct.Struct("<BQI")  # opcode, length, CRC
_BESIDE_MESSAGES = (int(Opcode.SCHEMA), int(Opcode.CHANNEL))  # in a chunk
_TAIL = _FOOTER.size + len(_MAGIC)

_UNREADABLE = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ArithmeticError,
    AttributeError,
    LookupError,
    MemoryError,
    RecursionError,
    TypeError,
    ValueError,
)


class Message(NamedTuple):
    """A message; both times are in nanoseconds."""

    channel_id: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


class Container(NamedTuple):
    """The checked bytes of an MCAP and the place where its summary section starts."""

    content: bytes
    summary_start: int

    def data_section(self) -> Iterator[tuple[int, bytes]]:
        """Yield (opcode, body) of every record of the data section."""
        return _records(self.content, len(_MAGIC), self.summary_start)

    def places(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield (opcode, offset, body) of every record of the data section."""
        start = len(_MAGIC)
        for opcode, body in self.data_section():
            yield opcode, start, body
            start += _HEAD.size + len(body)

    def summary_section(self) -> Iterator[tuple[int, bytes]]:
        """Yield (opcode, body) of every record of the summary section, the index of the file."""
        return _records(self.content, self.summary_start, len(self.content) - _TAIL)

    def record_at(self, offset: int) -> bytes:
        """Return the body of the record that an index points to."""
        for _, body in _records(self.content, offset, self.summary_start):
            return body
        raise ValueError(f"no record at byte {offset}")

    def messages_at(self, index: ChunkIndex) -> Iterator[Message]:
        """Yield the messages of one chunk that the summary section points to."""
        return chunk_messages(self.record_at(index.chunk_start_offset))

    def messages(self) -> Iterator[Message]:
        """Yield all messages; no chunk is decompressed that would bring them above the limit."""
        size = 0
        for opcode, body in self.data_section():
            if opcode == Opcode.CHUNK:
                size += uncompressed_size(body)
                if size > MAX_LOG:
                    raise ValueError(f"too large: {too_large(size)}")
                yield from chunk_messages(body)


@contextmanager
def unreadable_is_corrupt(name: str) -> Iterator[None]:
    """Turn any error of decoding damaged or foreign bytes into one line that names the log."""
    try:
        yield
    except _UNREADABLE as error:
        raise CorruptLog(
            f"{name}: unreadable: {type(error).__name__}: {' '.join(str(error).split())}"
        ) from error


def too_large(size: int) -> str:
    """Say that a log's file or messages are larger than any that is read."""
    return f"{size / MEGABYTE:.0f} MB; logs of up to {MAX_LOG // MEGABYTE} MB are read"


def check(content: bytes, name: str) -> Container:
    """Check magic, footer and both checksums, which together cover every byte.

    Raises:
        CorruptLog: The bytes are empty, too many, no MCAP, cut, altered, or an MCAP without
            checksums.
    """
    if not content:
        raise CorruptLog(f"{name}: empty file")
    if len(content) > MAX_LOG:
        raise CorruptLog(f"{name}: too large: {too_large(len(content))}")
    if content[: len(_MAGIC)] != _MAGIC[: len(content)]:
        raise CorruptLog(f"{name}: not an MCAP file")
    smallest = len(_MAGIC) + _DATA_END.size + _TAIL
    if len(content) < smallest or content[-len(_MAGIC) :] != _MAGIC:
        raise CorruptLog(
            f"{name}: cut or overwritten: {len(content)} bytes that do not end as an MCAP ends"
        )
    opcode, length, summary_start, _, summary_crc = _FOOTER.unpack_from(
        content, len(content) - _TAIL
    )
    if (opcode, length, summary_start) == (Opcode.FOOTER, 20, 0):
        raise CorruptLog(f"{name}: not a log of evoexp: an MCAP of another program")
    data_end = summary_start - _DATA_END.size
    if (opcode, length) != (Opcode.FOOTER, 20) or not len(_MAGIC) <= data_end <= len(
        content
    ) - smallest + len(_MAGIC):
        raise CorruptLog(f"{name}: altered: its footer is damaged")
    view = memoryview(content)
    opcode, length, data_crc = _DATA_END.unpack_from(content, data_end)
    if not (data_crc and summary_crc) and (opcode, length) == (Opcode.DATA_END, 4):
        raise CorruptLog(f"{name}: not a log of evoexp: an MCAP of another program")
    if zlib.crc32(view[summary_start : -len(_MAGIC) - 4]) != summary_crc:
        raise CorruptLog(f"{name}: altered: the checksum of its summary section is wrong")
    if (opcode, length) != (Opcode.DATA_END, 4) or zlib.crc32(view[:data_end]) != data_crc:
        raise CorruptLog(f"{name}: altered: the checksum of its data section is wrong")
    return Container(content, summary_start)


def parse(record: Any, body: bytes) -> Any:
    """Return the record of mcap's class `record` that a body holds."""
    return record.read(ReadDataStream(BytesIO(body)))


def chunk_messages(body: bytes) -> Iterator[Message]:
    """Yield the messages of a chunk record, its checksum verified."""
    content = _decompressed(parse(Chunk, body))
    start, end, kind = 0, len(content), int(Opcode.MESSAGE)
    while start < end:
        opcode, length = _HEAD.unpack_from(content, start)
        stop = start + _HEAD.size + length
        if stop > end:
            raise ValueError(f"a message ends at byte {stop} of a chunk of {end}")
        if opcode == kind:
            _, _, channel, number, logged, published = _MESSAGE.unpack_from(content, start)
            data = content[start + _MESSAGE.size : stop]
            yield Message(channel, number, logged, published, data)
        elif opcode not in _BESIDE_MESSAGES:
            raise ValueError(f"a chunk holds a record of kind {opcode}")
        start = stop


def uncompressed_size(body: bytes) -> int:
    """Return the size of a chunk record's content, as it is told; its content has no other."""
    size: int = _CHUNK_SIZE.unpack_from(body)[0]
    return size


def _decompressed(chunk: Chunk) -> bytes:
    """Return the content of a chunk; nothing is allocated for one that is too large."""
    size = chunk.uncompressed_size
    if chunk.compression != "zstd":
        raise ValueError(f"a chunk is compressed by {chunk.compression[:20]!r}")
    if size > MAX_CHUNK:
        raise ValueError(f"a chunk of {size} bytes; at most {MAX_CHUNK} are read")
    if zstandard.get_frame_parameters(chunk.data).content_size != size:
        raise ValueError("a chunk is not of the size that it tells")
    content = zstandard.ZstdDecompressor().decompress(chunk.data, size) if size else b""
    if chunk.uncompressed_crc and zlib.crc32(content) != chunk.uncompressed_crc:
        raise ValueError("the checksum of a chunk is wrong")
    return content


def _records(content: bytes, start: int, end: int) -> Iterator[tuple[int, bytes]]:
    while start < end:
        opcode, length = _HEAD.unpack_from(content, start)
        body = start + _HEAD.size
        start = body + length
        if start > end:
            raise ValueError(f"a record ends at byte {start}, beyond {end}")
        yield opcode, content[body:start]
