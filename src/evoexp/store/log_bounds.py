"""The bounds of a log: checked as a whole before mcap's reader sees it.

A log may come from anybody, and checksums are no proof of good will. Whatever a file claims, what
is read of it takes memory in proportion to `MAX_LOG` and `MAX_MESSAGE`.
"""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Attachment, Metadata
from mcap.writer import MCAP0_MAGIC as MAGIC

from evoexp.errors import CorruptLog, EvoexpError
from evoexp.input_files import MEGABYTE

# Of a log's file, and of all its messages together. The largest log of a shipped experiment holds
# 2.5 MB of messages; 128 MB are some 350,000 generations without a better solution.
MAX_LOG = 128 * MEGABYTE
# One solution or front: 300,000 numbers. The largest of a shipped experiment takes 60 kB.
MAX_MESSAGE = 8 * MEGABYTE
MAX_CHUNK = MAX_MESSAGE + 64 * 1024  # a chunk ends with the message that passes 56 KiB
MAX_METADATA = MEGABYTE  # [B] of a record of metadata
MAX_SUMMARY = 8 * MEGABYTE  # [B] of the summary section
MAX_ATTACHMENTS = 1000  # records of metadata included

_HEAD = struct.Struct("<BQ")  # opcode, length
_CHUNK = struct.Struct("<16xQ4xI4sQ")  # size, bytes of the compression's name, name, bytes of data
_FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, summary offset start, CRC
_DATA_END = struct.Struct("<BQI")  # opcode, length, CRC
_TAIL = _FOOTER.size + len(MAGIC)


class CheckedLog(NamedTuple):
    """A log that is checked."""

    name: str
    reader: SeekingReader  # of mcap, for its messages
    records: dict[str, dict[str, str]]  # of metadata, by name
    attachments: dict[str, bytes]  # by name

    def metadata(self, record: str) -> dict[str, str]:
        """Return a record of metadata."""
        if record not in self.records:
            raise CorruptLog(f"{self.name}: incomplete: no metadata record '{record}'")
        return self.records[record]


@contextmanager
def unreadable_is_corrupt(name: str) -> Iterator[None]:
    """Turn any error of decoding damaged or foreign bytes into one line that names the log."""
    try:
        yield
    except EvoexpError:
        raise
    except Exception as error:
        raise CorruptLog(
            f"{name}: unreadable: {type(error).__name__}: {' '.join(str(error).split())}"
        ) from error


def check(content: bytes, name: str) -> CheckedLog:
    """Check the bytes of a log: magic, checksums, the sizes of its records, its index."""
    summary_start = check_sums(content, name)
    with unreadable_is_corrupt(name):
        if len(content) - summary_start > MAX_SUMMARY:
            raise ValueError(f"a summary section of more than {MAX_SUMMARY} bytes")
        log = CheckedLog(name, SeekingReader(BytesIO(content), validate_crcs=True), {}, {})
        summary: Any = log.reader.get_summary()
        told = [
            [each.chunk_start_offset for each in summary.chunk_indexes],
            [each.offset for each in summary.metadata_indexes],
            [each.offset for each in summary.attachment_indexes],
        ]
        if told != _places(content, summary_start - _DATA_END.size, log):
            raise CorruptLog(f"{name}: altered: its index does not tell the records that it holds")
        return log


def check_sums(content: bytes, name: str) -> int:
    """Check magic, footer and both checksums; return where the summary section starts [B]."""
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


def _places(content: bytes, data_end: int, log: CheckedLog) -> list[list[int]]:
    """Check the data section; return places of chunks, metadata and attachments, and keep these."""
    chunks, metadata, attachments = list[int](), list[int](), list[int]()
    size, start, view = 0, len(MAGIC), memoryview(content)
    while start < data_end:
        opcode, length = _HEAD.unpack_from(content, start)
        body, stop = start + _HEAD.size, start + _HEAD.size + length
        if stop > data_end:
            raise ValueError(f"a record ends at byte {stop}, beyond {data_end}")
        if opcode == Opcode.CHUNK:
            chunks.append(start)
            content_size, name_length, compression, num_compressed = _CHUNK.unpack_from(
                content, body
            )
            frame = view[body + _CHUNK.size : stop]
            if (name_length, compression, num_compressed) != (4, b"zstd", len(frame)):
                raise ValueError("a chunk is not compressed by zstd")
            if content_size > MAX_CHUNK:
                raise ValueError(f"a chunk of {content_size} bytes; at most {MAX_CHUNK} are read")
            if zstandard.get_frame_parameters(frame).content_size != content_size:
                raise ValueError("a chunk is not of the size that it tells")
            size += content_size
            if size > MAX_LOG:
                raise ValueError(f"too large: {_too_large(size)}")
        elif opcode == Opcode.METADATA:
            if length > MAX_METADATA:
                raise ValueError(f"{length} bytes in a record of at most {MAX_METADATA}")
            metadata.append(start)
            record = Metadata.read(ReadDataStream(BytesIO(view[body:stop])))
            log.records[record.name] = record.metadata
        elif opcode == Opcode.ATTACHMENT:
            attachments.append(start)
            file = Attachment.read(ReadDataStream(BytesIO(view[body:stop])))
            log.attachments[file.name] = file.data
        elif opcode not in (Opcode.HEADER, Opcode.MESSAGE_INDEX):
            raise ValueError(f"a record of kind {opcode} among the data")
        if len(metadata) + len(attachments) > MAX_ATTACHMENTS:
            raise ValueError(f"more than {MAX_ATTACHMENTS} attachments and records of metadata")
        start = stop
    if len(log.records) + len(log.attachments) < len(metadata) + len(attachments):
        raise CorruptLog(f"{log.name}: altered: it holds records of the same name")
    return [chunks, metadata, attachments]


def _too_large(size: int) -> str:
    return f"{size / MEGABYTE:.0f} MB; logs of up to {MAX_LOG // MEGABYTE} MB are read"
