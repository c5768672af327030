"""The bounds of a log: checked as a whole before mcap's reader sees it.

A log may come from anybody, and checksums are no proof of good will. Whatever a file claims, what
is read of it takes memory in proportion to `MAX_LOG` and `MAX_MESSAGE`: both checksums are
compared, every record must fit into its own bytes, sizes are compared with these limits before
anything is decompressed, and the index must point to the records that are there and to no others.
"""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any

import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC as MAGIC

from evoexp.errors import CorruptLog
from evoexp.input_files import MEGABYTE

# Of a log's file, and of all its messages together. The largest log of a shipped experiment holds
# 2.5 MB of messages; 128 MB are some 350,000 generations without a better solution.
MAX_LOG = 128 * MEGABYTE
# One solution or front: 300,000 numbers. The largest of a shipped experiment takes 60 kB.
MAX_MESSAGE = 8 * MEGABYTE
MAX_CHUNK = MAX_MESSAGE + 64 * 1024  # a chunk ends with the message that passes 56 KiB
MAX_RECORD = MEGABYTE  # [B] of any record but chunks and attachments
MAX_RECORDS = 50_000  # outside of chunks; the largest log has some 2,300 chunks
MAX_ATTACHMENTS = 1000
# Reading a log takes at most so many times the memory of `MAX_LOG`, whatever the log holds.
MEMORY_FACTOR = 10

_HEAD = struct.Struct("<BQ")  # opcode, length
_CHUNK = struct.Struct("<16xQ4xI4sQ")  # size, bytes of the compression's name, name, bytes of data
_FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, summary offset start, CRC
_DATA_END = struct.Struct("<BQI")  # opcode, length, CRC
_TAIL = _FOOTER.size + len(MAGIC)
_INDICES = {  # opcode of a record → that of the index that tells its place
    Opcode.CHUNK: Opcode.CHUNK_INDEX,
    Opcode.ATTACHMENT: Opcode.ATTACHMENT_INDEX,
    Opcode.METADATA: Opcode.METADATA_INDEX,
}
_IN_DATA: dict[int, Any] = {
    Opcode.HEADER: records.Header,
    Opcode.ATTACHMENT: records.Attachment,
    Opcode.METADATA: records.Metadata,
}
_IN_SUMMARY: dict[int, Any] = {
    Opcode.SCHEMA: records.Schema,
    Opcode.CHANNEL: records.Channel,
    Opcode.STATISTICS: records.Statistics,
    Opcode.CHUNK_INDEX: records.ChunkIndex,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex,
    Opcode.METADATA_INDEX: records.MetadataIndex,
    Opcode.SUMMARY_OFFSET: records.SummaryOffset,
}
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


@contextmanager
def unreadable_is_corrupt(name: str) -> Iterator[None]:
    """Turn any error of decoding damaged or foreign bytes into one line that names the log."""
    try:
        yield
    except _UNREADABLE as error:
        raise CorruptLog(
            f"{name}: unreadable: {type(error).__name__}: {' '.join(str(error).split())}"
        ) from error


def check(content: bytes, name: str) -> None:
    """Check the bytes of a log: magic, checksums, the size of every record, its index.

    Raises:
        CorruptLog: The bytes are empty, too many, no MCAP, cut, altered, beyond a limit, or an MCAP
            without checksums.
    """
    summary_start = _checked_sums(content, name)
    with unreadable_is_corrupt(name):
        held = _checked_data(content, summary_start - _DATA_END.size)
        if held != _told_places(content, summary_start):
            raise CorruptLog(f"{name}: altered: its index does not tell the records that it holds")


def _checked_sums(content: bytes, name: str) -> int:
    """Check magic, footer and both checksums, which together cover every byte.

    Returns:
        Where the summary section starts.
    """
    if not content:
        raise CorruptLog(f"{name}: empty file")
    if len(content) > MAX_LOG:
        raise CorruptLog(f"{name}: too large: {_too_large(len(content))}")
    if content[: len(MAGIC)] != MAGIC[: len(content)]:
        raise CorruptLog(f"{name}: not an MCAP file")
    smallest = len(MAGIC) + _DATA_END.size + _TAIL
    if len(content) < smallest or content[-len(MAGIC) :] != MAGIC:
        raise CorruptLog(
            f"{name}: cut or overwritten: {len(content)} bytes that do not end as an MCAP ends"
        )
    opcode, length, summary_start, _, summary_crc = _FOOTER.unpack_from(
        content, len(content) - _TAIL
    )
    if (opcode, length, summary_start) == (Opcode.FOOTER, 20, 0):
        raise CorruptLog(f"{name}: not a log of evoexp: an MCAP of another program")
    data_end = summary_start - _DATA_END.size
    if (opcode, length) != (Opcode.FOOTER, 20) or not len(MAGIC) <= data_end <= len(
        content
    ) - smallest + len(MAGIC):
        raise CorruptLog(f"{name}: altered: its footer is damaged")
    view = memoryview(content)
    opcode, length, data_crc = _DATA_END.unpack_from(content, data_end)
    if not (data_crc and summary_crc) and (opcode, length) == (Opcode.DATA_END, 4):
        raise CorruptLog(f"{name}: not a log of evoexp: an MCAP of another program")
    if zlib.crc32(view[summary_start : -len(MAGIC) - 4]) != summary_crc:
        raise CorruptLog(f"{name}: altered: the checksum of its summary section is wrong")
    if (opcode, length) != (Opcode.DATA_END, 4) or zlib.crc32(view[:data_end]) != data_crc:
        raise CorruptLog(f"{name}: altered: the checksum of its data section is wrong")
    return int(summary_start)


def _checked_data(content: bytes, data_end: int) -> dict[int, list[int]]:
    """Check the records of the data section.

    Returns:
        Opcode of an index → where the records stand that it tells.
    """
    held: dict[int, list[int]] = {index: [] for index in _INDICES.values()}
    size, view = 0, memoryview(content)
    for opcode, start, body, stop in _places(content, len(MAGIC), data_end):
        if opcode == Opcode.CHUNK:
            size += _chunk_size(view[body:stop])
            if size > MAX_LOG:
                raise ValueError(f"too large: {_too_large(size)}")
        elif opcode in _IN_DATA:
            _parse(_IN_DATA[opcode], view[body:stop])
        elif opcode != Opcode.MESSAGE_INDEX:
            raise ValueError(f"a record of kind {opcode} among the data")
        if opcode in _INDICES:
            held[_INDICES[Opcode(opcode)]].append(start)
    if (count := len(held[Opcode.ATTACHMENT_INDEX])) > MAX_ATTACHMENTS:
        raise ValueError(f"{count} attachments; {MAX_ATTACHMENTS} are read")
    return held


def _told_places(content: bytes, summary_start: int) -> dict[int, list[int]]:
    """Check the records of the summary section; return the places that its indices tell."""
    told: dict[int, list[int]] = {index: [] for index in _INDICES.values()}
    view = memoryview(content)
    for opcode, _, body, stop in _places(content, summary_start, len(content) - _TAIL):
        record = _parse(_IN_SUMMARY[opcode], view[body:stop])
        if opcode == Opcode.CHUNK_INDEX:
            told[opcode].append(record.chunk_start_offset)
        elif opcode in told:
            told[opcode].append(record.offset)
    return told


def _places(content: bytes, start: int, end: int) -> Iterator[tuple[int, int, int, int]]:
    """Yield (opcode, start, start of the body, end) of the records of a section."""
    for _ in range(MAX_RECORDS):
        if start == end:
            return
        opcode, length = _HEAD.unpack_from(content, start)
        body, stop = start + _HEAD.size, start + _HEAD.size + length
        if stop > end:
            raise ValueError(f"a record ends at byte {stop}, beyond {end}")
        if length > MAX_RECORD and opcode not in (Opcode.CHUNK, Opcode.ATTACHMENT):
            raise ValueError(f"{length} bytes in a record of at most {MAX_RECORD}")
        yield opcode, start, body, stop
        start = stop
    raise ValueError(f"more than {MAX_RECORDS} records")


def _parse(record: Any, body: memoryview) -> Any:
    """Return the record of mcap's class `record`; one that claims more than its body raises."""
    return record.read(ReadDataStream(BytesIO(body)))


def _chunk_size(body: memoryview) -> int:
    """Return the size of a chunk's content, which is what its compressed frame says, too."""
    size, length, compression, num_compressed = _CHUNK.unpack_from(body)
    if (length, compression) != (4, b"zstd") or num_compressed != len(body) - _CHUNK.size:
        raise ValueError("a chunk is not compressed by zstd")
    if size > MAX_CHUNK:
        raise ValueError(f"a chunk of {size} bytes; at most {MAX_CHUNK} are read")
    if zstandard.get_frame_parameters(body[_CHUNK.size :]).content_size != size:
        raise ValueError("a chunk is not of the size that it tells")
    return int(size)


def _too_large(size: int) -> str:
    return f"{size / MEGABYTE:.0f} MB; logs of up to {MAX_LOG // MEGABYTE} MB are read"
