"""Writes an MCAP in memory: the bytes of mcap's own writer but for the level of compression.

mcap's writer takes 4 µs per message, as long as everything else that a generation's log costs. Here
messages wait in lists, and only functions written in C go over them. The format is that of
https://mcap.dev/spec: chunks compressed by zstd, indices of all kinds, checksums everywhere.
"""

import struct
import threading
import zlib
from bisect import bisect_right
from collections.abc import Mapping
from functools import lru_cache
from itertools import accumulate, chain, repeat
from operator import add
from typing import NamedTuple

import zstandard
from mcap.opcode import Opcode

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")  # opcode, length
_FIELDS_BEFORE_DATA = 22  # [B] of a message: channel, sequence, log time, publish time
_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log_time, publish_time
_COUNT = struct.Struct("<I")
_COMPRESSION = "zstd"
LEVEL = 1  # logs take as little room as at zstd's default of 3, in two thirds of the time
_MEDIA_TYPES = {".json": "application/json"}
_OTHER = "application/octet-stream"


class _OfThread(threading.local):
    """A compressor that one thread uses for all its files: making one takes longer than a chunk."""

    def __init__(self) -> None:
        self.compressor = zstandard.ZstdCompressor(LEVEL)


_OF_THREAD = _OfThread()


class Messages(NamedTuple):
    """Messages in the order in which they are written, field by field.

    Attributes:
        channels: Ids.
        sequences: Numbers within their channels.
        times: Log times [ns].
        published: Publish times [ns].
        data: Encoded.
    """

    channels: list[int]
    sequences: list[int]
    times: list[int]
    published: list[int]
    data: list[bytes]


class ContainerWriter:
    """Writes schemas, channels, messages, attachments and metadata into the bytes of an MCAP."""

    def __init__(self, library: str, chunk_size: int) -> None:
        """Start the file.

        Args:
            library: Stands in the header.
            chunk_size: A chunk ends with the record that passes this [B].
        """
        self._chunk_size = chunk_size
        self._parts = [_MAGIC, _record(Opcode.HEADER, _text("") + _text(library))]
        self._size = sum(map(len, self._parts))
        self._schemas: list[bytes] = []  # records
        self._channels: list[bytes] = []
        self._indices: dict[Opcode, list[bytes]] = {
            Opcode.CHUNK_INDEX: [],
            Opcode.ATTACHMENT_INDEX: [],
            Opcode.METADATA_INDEX: [],
        }
        self._first_time, self._last_time = 0, 0
        self._counts: dict[int, int] = {}  # of messages, by channel
        self._chunk: list[bytes] = []  # records and parts of records
        self._chunk_length = 0
        self._in_chunk: list[tuple[int, int, int]] = []  # channel, time, offset of messages

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Add a schema and return its id."""
        number = len(self._schemas) + 1
        body = struct.pack("<H", number) + _text(name) + _text(encoding) + _bytes(data)
        self._schemas.append(_record(Opcode.SCHEMA, body))
        self._add_to_chunk(self._schemas[-1])
        return number

    def add_channel(self, topic: str, encoding: str, schema: int) -> int:
        """Add a channel of messages of one schema and return its id."""
        number = len(self._channels) + 1
        body = struct.pack("<HH", number, schema) + _text(topic) + _text(encoding) + _COUNT.pack(0)
        self._channels.append(_record(Opcode.CHANNEL, body))
        self._add_to_chunk(self._channels[-1])
        return number

    def add_messages(self, messages: Messages) -> None:
        """Add messages; chunks that they fill are written."""
        channels, sequences, times, published, data = messages
        if not data:
            return
        if not self._counts:
            self._first_time = times[0]
        self._first_time = min(self._first_time, min(times))
        self._last_time = max(self._last_time, max(times))
        for channel in dict.fromkeys(channels):  # in the order of their first messages
            self._counts[channel] = self._counts.get(channel, 0) + channels.count(channel)
        lengths = list(map(add, map(len, data), repeat(_FIELDS_BEFORE_DATA)))
        fields = lengths, channels, sequences, times, published
        heads = map(_MESSAGE.pack, repeat(int(Opcode.MESSAGE)), *fields)
        records = list(map(add, heads, data))
        begin = 0
        while begin < len(records):
            # where the records end in the chunk; it takes all up to the first beyond its size
            sizes = map(len, records[begin:])
            ends = list(accumulate(sizes, initial=self._chunk_length))
            taken = min(bisect_right(ends, self._chunk_size, 1), len(ends) - 1)
            stop = begin + taken
            self._in_chunk += zip(channels[begin:stop], times[begin:stop], ends, strict=False)
            self._chunk += records[begin:stop]
            self._chunk_length = ends[taken]
            if self._chunk_length > self._chunk_size:
                self._end_chunk()
            begin = stop

    def add_attachment(self, name: str, data: bytes) -> None:
        """Add a file; its media type follows from its name."""
        media_type = next(
            (kind for end, kind in _MEDIA_TYPES.items() if name.endswith(end)), _OTHER
        )
        body = bytes(16) + _text(name) + _text(media_type) + struct.pack("<Q", len(data)) + data
        record = _record(Opcode.ATTACHMENT, body + _COUNT.pack(zlib.crc32(body)))
        index = struct.pack("<QQQQQ", self._size, len(record), 0, 0, len(data))
        self._add_index(Opcode.ATTACHMENT_INDEX, index + _text(name) + _text(media_type))
        self._add_to_file(record)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add named texts."""
        record = _metadata(name, tuple(values.items()))
        index = struct.pack("<QQ", self._size, len(record))
        self._add_index(Opcode.METADATA_INDEX, index + _text(name))
        self._add_to_file(record)

    def finish(self) -> bytes:
        """Close the file and return its bytes."""
        self._end_chunk()
        data_section = b"".join(self._parts)
        end = _record(Opcode.DATA_END, _COUNT.pack(zlib.crc32(data_section)))
        chunks, attachments, metadata = self._indices.values()
        counts = b"".join(struct.pack("<HQ", *item) for item in self._counts.items())
        statistics = struct.pack(
            "<QHIIIIQQ",
            sum(self._counts.values()),
            len(self._schemas),
            len(self._channels),
            len(attachments),
            len(metadata),
            len(chunks),
            self._first_time,
            self._last_time,
        )
        summary = b"".join(
            (
                *self._schemas,
                *self._channels,
                _record(Opcode.STATISTICS, statistics + _bytes(counts)),
                *chunks,
                *attachments,
                *metadata,
                _HEAD.pack(Opcode.FOOTER, 20),
                struct.pack("<QQ", len(data_section) + len(end), 0),
            )
        )
        crc = _COUNT.pack(zlib.crc32(summary))
        return b"".join((data_section, end, summary, crc, _MAGIC))

    def _add_to_file(self, record: bytes) -> None:
        self._parts.append(record)
        self._size += len(record)

    def _add_index(self, opcode: Opcode, body: bytes) -> None:
        self._indices[opcode].append(_record(opcode, body))

    def _add_to_chunk(self, record: bytes) -> None:
        self._chunk.append(record)
        self._chunk_length += len(record)
        if self._chunk_length > self._chunk_size:
            self._end_chunk()

    def _end_chunk(self) -> None:
        """Write the chunk and the places of its messages, unless it has none."""
        if not self._in_chunk:
            return
        content = b"".join(self._chunk)
        compressed = _OF_THREAD.compressor.compress(content)
        _, times, _ = zip(*self._in_chunk, strict=True)
        span = struct.pack("<QQ", min(times), max(times))
        body = struct.pack("<QI", len(content), zlib.crc32(content)) + _text(_COMPRESSION)
        body += struct.pack("<Q", len(compressed)) + compressed
        chunk = _record(Opcode.CHUNK, span + body)
        begin = self._size
        self._add_to_file(chunk)
        # the places, channel by channel
        places: dict[int, list[int]] = {}
        for channel, time, offset in self._in_chunk:
            places.setdefault(channel, []).extend((time, offset))
        offsets = b""
        indices_begin = self._size
        for channel, numbers in places.items():
            offsets += struct.pack("<HQ", channel, self._size)
            entries = struct.pack(f"<{len(numbers)}Q", *numbers)
            index = struct.pack("<H", channel) + _bytes(entries)
            self._add_to_file(_record(Opcode.MESSAGE_INDEX, index))
        length = struct.pack("<Q", self._size - indices_begin)
        sizes = struct.pack("<QQ", len(compressed), len(content))
        where = struct.pack("<QQ", begin, len(chunk)) + _bytes(offsets) + length
        self._add_index(Opcode.CHUNK_INDEX, span + where + _text(_COMPRESSION) + sizes)
        self._chunk, self._chunk_length, self._in_chunk = [], 0, []


@lru_cache(maxsize=8)  # most logs of a process have the same environment
def _metadata(name: str, values: tuple[tuple[str, str], ...]) -> bytes:
    texts = b"".join(map(_text, chain.from_iterable(values)))
    return _record(Opcode.METADATA, _text(name) + _bytes(texts))


def _record(opcode: Opcode, body: bytes) -> bytes:
    return _HEAD.pack(opcode, len(body)) + body


def _bytes(content: bytes) -> bytes:
    """Return bytes behind their number."""
    return _COUNT.pack(len(content)) + content


def _text(text: str) -> bytes:
    return _bytes(text.encode())
