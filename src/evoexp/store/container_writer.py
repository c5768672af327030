"""The bytes of an MCAP, written in memory: compressed chunks, an index, and everything under a checksum.

mcap's own writer gives the same bytes (a test compares them) in twice the time; thousands of short replicates notice.
"""

import struct
import zlib
from collections.abc import Mapping

import zstandard
from mcap.opcode import Opcode

from evoexp.store.container import DATA_END, FOOTER, HEAD, MAGIC, MESSAGE

CHUNK_SIZE = 56 * 1024  # [B] a chunk ends with the message that passes this, hence within 64 KiB
_COMPRESSION = "zstd"
_U16, _U32, _U64 = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")


class ContainerWriter:
    """Writes one MCAP; `finish` gives its bytes."""

    def __init__(self, library: str) -> None:
        """Start a file.

        Args:
            library: What the header says wrote it.
        """
        self._parts: list[bytes] = []
        self._size = 0  # [B] of all parts
        self._write(MAGIC)
        self._write(_record(Opcode.HEADER, _text(""), _text(library)))
        self._chunk: list[bytes] = []  # records that wait to be compressed together
        self._chunk_size = 0  # [B]
        self._messages: dict[int, list[int]] = {}  # channel → log_time, offset, log_time, offset, … in the chunk
        self._start = self._end = 0  # [ns] log_time of the chunk's first and last message
        self._first = 0  # [ns] log_time of the file's first message
        self._counts: dict[int, int] = {}  # channel → messages
        self._schemas: list[bytes] = []
        self._channels: list[bytes] = []
        self._chunk_index: list[bytes] = []
        self._attachment_index: list[bytes] = []
        self._metadata_index: list[bytes] = []

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add texts by name; they come before the chunk that is being filled."""
        record = _record(Opcode.METADATA, _text(name), _texts(values))
        place = _U64.pack(self._size), _U64.pack(len(record))
        self._metadata_index.append(_record(Opcode.METADATA_INDEX, *place, _text(name)))
        self._write(record)

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Add a file, without times; it comes before the chunk that is being filled."""
        names = _text(name) + _text(media_type)
        body = b"".join((bytes(16), names, _U64.pack(len(data)), data))
        record = _record(Opcode.ATTACHMENT, body, _U32.pack(zlib.crc32(body)))
        place = struct.pack("<QQ16xQ", self._size, len(record), len(data))
        self._attachment_index.append(_record(Opcode.ATTACHMENT_INDEX, place, names))
        self._write(record)

    def add_channel(self, topic: str, message_encoding: str, schema: tuple[str, str, bytes]) -> int:
        """Add a channel with a schema of its own (name, encoding, data); return the channel's number."""
        name, encoding, data = schema
        number = _U16.pack(len(self._channels) + 1)  # of both
        self._schemas.append(_record(Opcode.SCHEMA, number, _text(name), _text(encoding), _U32.pack(len(data)), data))
        self._channels.append(
            _record(Opcode.CHANNEL, number, number, _text(topic), _text(message_encoding), _texts({}))
        )
        for record in (self._schemas[-1], self._channels[-1]):
            self._chunk.append(record)
            self._chunk_size += len(record)
            self._end_full_chunk()
        return len(self._channels)

    def add_message(self, channel: int, log_time: int, data: bytes) -> int:
        """Add a message and return its sequence: how many its channel had before.

        Args:
            channel: From `add_channel`.
            log_time: Also the time of publication [ns]; not before that of the last message.
            data: In the encoding of its channel.
        """
        sequence = self._counts.get(channel, 0)
        self._counts[channel] = sequence + 1
        if not self._messages:
            self._start = log_time
            if not self._chunk_index:
                self._first = log_time
        self._end = log_time
        self._messages.setdefault(channel, []).extend((log_time, self._chunk_size))
        length = len(data) + MESSAGE.size - HEAD.size
        self._chunk += (MESSAGE.pack(Opcode.MESSAGE, length, channel, sequence, log_time, log_time), data)
        self._chunk_size += HEAD.size + length
        self._end_full_chunk()
        return sequence

    def finish(self) -> bytes:
        """End the file and return it."""
        self._end_chunk()
        content = b"".join(self._parts)
        self._write(DATA_END.pack(Opcode.DATA_END, 4, zlib.crc32(content)))
        indices = self._chunk_index + self._attachment_index + self._metadata_index
        summary = b"".join((*self._schemas, *self._channels, self._statistics(), *indices))
        # The checksum of the summary section covers the footer up to the checksum itself.
        footer = FOOTER.pack(Opcode.FOOTER, 20, self._size, 0, 0)[:-4]
        crc = _U32.pack(zlib.crc32(footer, zlib.crc32(summary)))
        return b"".join((content, self._parts[-1], summary, footer, crc, MAGIC))

    def _write(self, record: bytes) -> None:
        self._parts.append(record)
        self._size += len(record)

    def _end_full_chunk(self) -> None:
        if self._chunk_size > CHUNK_SIZE:
            self._end_chunk()

    def _end_chunk(self) -> None:
        if not self._messages:
            return
        plain = b"".join(self._chunk)
        data = zstandard.compress(plain)
        times = _U64.pack(self._start), _U64.pack(self._end)
        size, compression = _U64.pack(len(plain)), _text(_COMPRESSION)
        place = _U64.pack(self._size)
        checked = (size, _U32.pack(zlib.crc32(plain)))
        chunk = _record(Opcode.CHUNK, *times, *checked, compression, _U64.pack(len(data)), data)
        self._write(chunk)
        end = self._size
        offsets: list[bytes] = []
        for channel, entries in self._messages.items():
            offsets += (_U16.pack(channel), _U64.pack(self._size))
            packed = struct.pack(f"<{len(entries)}Q", *entries)
            self._write(_record(Opcode.MESSAGE_INDEX, _U16.pack(channel), _U32.pack(len(packed)), packed))
        by_channel = b"".join(offsets)
        where = (place, _U64.pack(len(chunk)), _U32.pack(len(by_channel)), by_channel, _U64.pack(self._size - end))
        sizes = (compression, _U64.pack(len(data)), size)
        self._chunk_index.append(_record(Opcode.CHUNK_INDEX, *times, *where, *sizes))
        self._chunk, self._chunk_size, self._messages = [], 0, {}

    def _statistics(self) -> bytes:
        counts = b"".join(_U16.pack(channel) + _U64.pack(count) for channel, count in self._counts.items())
        numbers = struct.pack(
            "<QHIIIIQQI",
            sum(self._counts.values()),
            len(self._schemas),
            len(self._channels),
            len(self._attachment_index),
            len(self._metadata_index),
            len(self._chunk_index),
            self._first,
            self._end,
            len(counts),
        )
        return _record(Opcode.STATISTICS, numbers, counts)


def _record(opcode: int, *body: bytes) -> bytes:
    return b"".join((HEAD.pack(opcode, sum(map(len, body))), *body))


def _text(text: str) -> bytes:
    encoded = text.encode()
    return _U32.pack(len(encoded)) + encoded


def _texts(values: Mapping[str, str]) -> bytes:
    packed = b"".join(_text(text) for pair in values.items() for text in pair)
    return _U32.pack(len(packed)) + packed
