"""The bytes of an MCAP, checked as a whole before anything in them is believed, then walked record by record.

mcap's own readers check neither the summary section nor that the file ends where it should, and cost ten times as much.
"""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import zstandard
from mcap.opcode import Opcode

from evoexp.errors import CorruptLog
from evoexp.store.container_records import read_chunk

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")  # opcode, length
MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log_time, publish_time
FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, summary offset start, CRC
DATA_END = struct.Struct("<BQI")  # opcode, length, CRC
_TAIL = FOOTER.size + len(MAGIC)

_UNREADABLE = (
    zstandard.ZstdError,
    struct.error,
    ArithmeticError,
    AttributeError,
    LookupError,
    MemoryError,
    TypeError,
    ValueError,
)


Message = tuple[int, int, int, bytes]  # channel id, sequence, log_time, data


class Container(NamedTuple):
    """The checked bytes of an MCAP and the place where its summary section starts."""

    content: bytes
    summary_start: int

    def data_section(self) -> Iterator[tuple[int, bytes]]:
        """Yield (opcode, body) of every record of the data section."""
        return _records(self.content, len(MAGIC), self.summary_start)

    def summary_section(self) -> Iterator[tuple[int, bytes]]:
        """Yield (opcode, body) of every record of the summary section, the index of the file."""
        return _records(self.content, self.summary_start, len(self.content) - _TAIL)

    def record_at(self, offset: int) -> bytes:
        """Return the body of the record that an index points to."""
        for _, body in _records(self.content, offset, self.summary_start):
            return body
        raise ValueError(f"no record at byte {offset}")

    def messages_at(self, offset: int) -> Iterator[Message]:
        """Yield the messages of one chunk that the summary section points to."""
        return chunk_messages(self.record_at(offset))


@contextmanager
def unreadable_is_corrupt(name: str) -> Iterator[None]:
    """Turn whatever decoding damaged or foreign bytes can raise into one line that names the log."""
    try:
        yield
    except _UNREADABLE as error:
        raise CorruptLog(f"{name}: unreadable: {type(error).__name__}: {' '.join(str(error).split())}") from error


def check(content: bytes, name: str) -> Container:
    """Check magic, footer and both checksums, which together cover every byte.

    Raises:
        CorruptLog: The bytes are empty, no MCAP, cut, altered, or an MCAP without checksums.
    """
    if not content:
        raise CorruptLog(f"{name}: empty file")
    if content[: len(MAGIC)] != MAGIC[: len(content)]:
        raise CorruptLog(f"{name}: not an MCAP file")
    smallest = len(MAGIC) + DATA_END.size + _TAIL
    if len(content) < smallest or content[-len(MAGIC) :] != MAGIC:
        raise CorruptLog(f"{name}: cut or overwritten: {len(content)} bytes that do not end as an MCAP ends")
    opcode, length, summary_start, _, summary_crc = FOOTER.unpack_from(content, len(content) - _TAIL)
    data_end = summary_start - DATA_END.size
    if (opcode, length) != (Opcode.FOOTER, 20) or not len(MAGIC) <= data_end <= len(content) - smallest + len(MAGIC):
        raise CorruptLog(f"{name}: altered: its footer is damaged")
    view = memoryview(content)
    opcode, length, data_crc = DATA_END.unpack_from(content, data_end)
    if not (data_crc and summary_crc) and (opcode, length) == (Opcode.DATA_END, 4):
        raise CorruptLog(f"{name}: not a log of evoexp: an MCAP without checksums")
    if zlib.crc32(view[summary_start : -len(MAGIC) - 4]) != summary_crc:
        raise CorruptLog(f"{name}: altered: the checksum of its summary section is wrong")
    if (opcode, length) != (Opcode.DATA_END, 4) or zlib.crc32(view[:data_end]) != data_crc:
        raise CorruptLog(f"{name}: altered: the checksum of its data section is wrong")
    return Container(content, summary_start)


def chunk_messages(body: bytes) -> Iterator[Message]:
    """Yield the messages of a chunk record, its checksum verified."""
    content = read_chunk(body)
    start, end, kind = 0, len(content), int(Opcode.MESSAGE)
    while start < end:
        opcode, length = HEAD.unpack_from(content, start)
        stop = start + HEAD.size + length
        if stop > end:
            raise ValueError(f"a message ends at byte {stop} of a chunk of {end}")
        if opcode == kind:
            _, _, channel_id, sequence, log_time, _ = MESSAGE.unpack_from(content, start)
            yield channel_id, sequence, log_time, content[start + MESSAGE.size : stop]
        start = stop


def _records(content: bytes, start: int, end: int) -> Iterator[tuple[int, bytes]]:
    while start < end:
        opcode, length = HEAD.unpack_from(content, start)
        body = start + HEAD.size
        start = body + length
        if start > end:
            raise ValueError(f"a record ends at byte {start}, beyond {end}")
        yield opcode, content[body:start]
