"""The bytes of mcap's own writer, whatever is written; both compress with the same level."""

import io
from collections.abc import Callable
from typing import Any

import mcap.writer
import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

from evoexp.store.container_writer import LEVEL, ContainerWriter, Messages

CHUNK_SIZE = 2000


class ByMcap:
    """The same calls, by mcap."""

    def __init__(self, library: str, chunk_size: int) -> None:
        self.buffer = io.BytesIO()
        self.writer = Writer(
            self.buffer,
            chunk_size=chunk_size,
            compression=CompressionType.ZSTD,
            index_types=IndexType.ALL,
            use_summary_offsets=False,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self.writer.start(profile="", library=library)

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        return self.writer.register_schema(name, encoding, data)

    def add_channel(self, topic: str, encoding: str, schema: int) -> int:
        return self.writer.register_channel(topic, encoding, schema)

    def add_messages(self, messages: Messages) -> None:
        for channel, sequence, time, published, data in zip(*messages, strict=True):
            self.writer.add_message(channel, time, data, published, sequence)

    def add_attachment(self, name: str, data: bytes) -> None:
        kind = "application/json" if name.endswith(".json") else "application/octet-stream"
        self.writer.add_attachment(0, 0, name, kind, data)

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        self.writer.add_metadata(name, values)

    def finish(self) -> bytes:
        self.writer.finish()
        return self.buffer.getvalue()


def random_calls(rng: np.random.Generator) -> list[Callable[[Any], Any]]:
    """Return calls in random order and number, messages only of channels that there are."""
    calls: list[Callable[[Any], Any]] = []
    channels, schemas, sequence = 0, 0, 0
    for _ in range(rng.integers(0, 40)):
        text = "".join(rng.choice(list("aβ/€."), rng.integers(0, 9)))
        content = rng.bytes(rng.integers(0, 300))
        match rng.integers(0, 8):
            case 0:
                calls.append(lambda w, t=text, c=content: w.add_schema(t, "jsonschema", c))
                schemas += 1
            case 1:
                schema = int(rng.integers(0, schemas + 1))
                calls.append(lambda w, t=text, s=schema: w.add_channel(t, "json", s))
                channels += 1
            case 2:
                end = str(rng.choice(["", ".json", ".npy"]))
                calls.append(lambda w, t=text + end, c=content: w.add_attachment(t, c))
            case 3:
                values = {text + str(k): text * k for k in range(rng.integers(0, 4))}
                calls.append(lambda w, t=text, v=values: w.add_metadata(t, v))
            case _ if channels:
                count = int(rng.integers(0, 30))
                longest = int(rng.choice([1, 200, 3 * CHUNK_SIZE]))
                messages = Messages(
                    rng.integers(1, channels + 1, count).tolist(),
                    list(range(sequence, sequence + count)),
                    *rng.integers(0, 2**62, (2, count)).tolist(),
                    [rng.bytes(rng.integers(0, longest)) for _ in range(count)],
                )
                sequence += count
                calls.append(lambda w, m=messages: w.add_messages(m))
    return calls


@pytest.mark.parametrize("seed", range(100))
def test_random_files_have_the_bytes_of_mcaps_writer(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    compress = zstandard.ZstdCompressor(LEVEL).compress
    monkeypatch.setattr(mcap.writer.zstandard, "compress", compress)
    rng = np.random.default_rng(seed)
    chunk_size = int(rng.choice([1, 100, CHUNK_SIZE, 10**6]))
    ours, theirs = ContainerWriter("evoexp", chunk_size), ByMcap("evoexp", chunk_size)
    for call in random_calls(rng):
        assert call(ours) == call(theirs)
    assert ours.finish() == theirs.finish()


def test_a_file_of_many_chunks_is_read_by_mcap() -> None:
    writer = ContainerWriter("evoexp", CHUNK_SIZE)
    channel = writer.add_channel("/x", "json", writer.add_schema("x", "jsonschema", b"{}"))
    data = [str(k).encode() for k in range(1000)]
    numbers = list(range(1000))
    writer.add_messages(Messages([channel] * 1000, numbers, numbers, numbers, data))
    reader = make_reader(io.BytesIO(writer.finish()))
    assert [message.data for _, _, message in reader.iter_messages()] == data
    summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.chunk_count > 10
