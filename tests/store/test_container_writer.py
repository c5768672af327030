"""Our bytes of an MCAP are those that mcap's own writer makes, and mcap's own reader finds everything in them."""

from io import BytesIO

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer
from store_samples import generations, write

from evoexp.store.container import Container, check
from evoexp.store.container_records import read_channel, read_chunk_index, read_metadata, read_metadata_index
from evoexp.store.container_writer import CHUNK_SIZE, ContainerWriter

KINDS = ("message", "message", "message", "metadata", "attachment", "channel")


class Reference:
    """mcap's writer, set up as ours always is."""

    def __init__(self, library: str) -> None:
        self._buffer = BytesIO()
        self._writer = Writer(
            self._buffer,
            chunk_size=CHUNK_SIZE,
            compression=CompressionType.ZSTD,
            index_types=IndexType.ALL,
            use_summary_offsets=False,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self._writer.start(profile="", library=library)
        self._counts: dict[int, int] = {}

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        self._writer.add_metadata(name, values)

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        self._writer.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)

    def add_channel(self, topic: str, message_encoding: str, schema: tuple[str, str, bytes]) -> int:
        return self._writer.register_channel(topic, message_encoding, self._writer.register_schema(*schema))

    def add_message(self, channel: int, log_time: int, data: bytes) -> int:
        sequence = self._counts.get(channel, 0)
        self._counts[channel] = sequence + 1
        self._writer.add_message(channel, log_time, data, log_time, sequence)
        return sequence

    def finish(self) -> bytes:
        self._writer.finish()
        return self._buffer.getvalue()


def fill(writer: ContainerWriter | Reference, seed: int, steps: int, largest: int) -> list[int]:
    """Add records in any order; return the sequences of the messages."""
    rng = np.random.default_rng(seed)
    channels = [writer.add_channel("/générations", "json", ("évoexp.Generation", "jsonschema", b"{}"))]
    now, sequences = 0, []
    for step in range(steps):
        data = rng.integers(0, 12, int(rng.integers(largest)), dtype=np.uint8).tobytes()
        kind = KINDS[int(rng.integers(len(KINDS)))]
        if kind == "message":
            now += int(rng.integers(3)) * 1_000_000_000
            sequences.append(writer.add_message(channels[int(rng.integers(len(channels)))], now, data))
        elif kind == "metadata":
            writer.add_metadata(f"µ{step}", {f"key {k}": "ü" * k for k in range(int(rng.integers(4)))})
        elif kind == "attachment":
            writer.add_attachment(f"{step}.bin", "application/octet-stream", data)
        elif len(channels) < 5:
            channels.append(writer.add_channel(f"/{step}", "json", (f"s{step}", "jsonschema", data)))
    return sequences


@pytest.mark.parametrize(
    ("seed", "steps", "largest"), [(0, 0, 1), (1, 1, 9), (2, 30, 100), (3, 400, 3000), (4, 60, 70_000)]
)
def test_the_bytes_are_mcaps(seed: int, steps: int, largest: int) -> None:
    ours, reference = ContainerWriter("evoexp"), Reference("evoexp")
    assert fill(ours, seed, steps, largest) == fill(reference, seed, steps, largest)
    content = ours.finish()
    assert content == reference.finish()
    assert len(content) > 100


def test_several_chunks_are_among_them() -> None:
    ours = ContainerWriter("evoexp")
    fill(ours, 3, 400, 3000)
    summary = make_reader(BytesIO(ours.finish())).get_summary()
    assert summary is not None and len(summary.chunk_indexes) > 3


def test_an_index_says_what_mcaps_reader_says() -> None:
    content = write(generations(500)).content
    summary = make_reader(BytesIO(content)).get_summary()
    assert summary is not None
    container: Container = check(content, "log")
    by_opcode: dict[int, list[bytes]] = {}
    for opcode, body in container.summary_section():
        by_opcode.setdefault(opcode, []).append(body)
    channels = [read_channel(body) for body in by_opcode[0x04]]
    assert channels == [(c.id, c.schema_id, c.topic, c.message_encoding) for c in summary.channels.values()]
    chunks = [read_chunk_index(body) for body in by_opcode[0x08]]
    assert len(chunks) > 1
    assert chunks == [(c.chunk_start_offset, c.message_index_offsets.keys()) for c in summary.chunk_indexes]
    places = [read_metadata_index(body) for body in by_opcode[0x0D]]
    assert places == [(m.name, m.offset) for m in summary.metadata_indexes]
    for (name, offset), metadata in zip(places, make_reader(BytesIO(content)).iter_metadata(), strict=True):
        assert (name, read_metadata(container.record_at(offset))) == (metadata.name, metadata.metadata)
