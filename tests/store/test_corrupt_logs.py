"""A damaged log is always recognised, by one line that names it, and never by another exception."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType, Writer
from store_samples import generations, summary, write

from evoexp.errors import CorruptLog
from evoexp.store import log as log_module
from evoexp.store.digests import ContentDigest
from evoexp.store.log_reader import generation_columns, read_log, read_solution, read_summary

READERS = [read_log, read_summary, read_solution, generation_columns]
Reader = Callable[[bytes | Path], object]


@pytest.fixture(scope="module")
def content() -> bytes:
    return write(generations(60)).content


def refusal(reader: Reader, source: bytes | Path) -> str:
    with pytest.raises(CorruptLog) as caught:
        reader(source)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize("reader", READERS)
def test_cut_anywhere(reader: Reader, content: bytes) -> None:
    for size in range(0, len(content), 29):
        refusal(reader, content[:size])
    assert "cut" in refusal(reader, content[:-1])
    assert "empty" in refusal(reader, b"")


@pytest.mark.parametrize("reader", READERS)
def test_altered_anywhere(reader: Reader, content: bytes) -> None:
    rng = np.random.default_rng(1)
    damaged = bytearray(content)
    for position in rng.integers(len(content), size=500).tolist():
        flip = int(rng.integers(1, 256))
        damaged[position] ^= flip
        refusal(reader, bytes(damaged))
        damaged[position] ^= flip
    reader(bytes(damaged))


@pytest.mark.parametrize("reader", READERS)
def test_something_else(reader: Reader, content: bytes) -> None:
    assert "not an MCAP" in refusal(reader, b"PAR1" * 100)
    assert "cut or overwritten" in refusal(reader, content + b"\0")
    refusal(reader, content + content)
    refusal(reader, content[: len(content) // 2] + bytes(len(content) // 2))


NO_SUMMARY = {
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_statistics": False,
    "use_summary_offsets": False,
}


def foreign(checksums: bool, **options: Any) -> bytes:
    buffer = BytesIO()
    writer = Writer(buffer, enable_data_crcs=checksums, **options)
    writer.start()
    channel = writer.register_channel(
        "/generation", "json", writer.register_schema("other", "jsonschema", b"{}")
    )
    writer.add_message(channel, 0, b"{}", 0)
    writer.finish()
    return buffer.getvalue()


@pytest.mark.parametrize("reader", READERS)
def test_foreign_mcap(reader: Reader) -> None:
    assert "evoexp.run" in refusal(reader, foreign(checksums=True))
    for options in ({}, NO_SUMMARY, {"compression": CompressionType.LZ4}, {"use_chunking": False}):
        text = refusal(reader, foreign(checksums=False, **options))
        assert text.endswith("not a log of evoexp: an MCAP of another program")


def test_the_file_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "0003.mcap"
    assert refusal(read_log, path).startswith(f"{path}: cannot be read: No such file")
    path.write_bytes(content[:100])
    assert refusal(read_summary, path).startswith(f"{path}: cut")
    assert refusal(read_log, tmp_path).startswith(f"{tmp_path}: cannot be read")


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize(("other", "age"), [(1, "an older"), (3, "a newer")])
def test_other_schema_version(
    reader: Reader, monkeypatch: pytest.MonkeyPatch, other: int, age: str
) -> None:
    monkeypatch.setattr(log_module, "SCHEMA_VERSION", other)
    foreign = write(generations(3)).content
    reader(foreign)
    monkeypatch.undo()
    assert f"written by {age} evoexp: schema version {other}, this one reads 2" in refusal(
        reader, foreign
    )


def test_content_digest_sees_what_good_checksums_hide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ContentDigest, "hexdigest", lambda self: "0" * 32)
    forged = write(generations(3)).content
    monkeypatch.undo()
    assert "content digest" in refusal(read_log, forged)


def test_a_summary_without_a_field(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_module, "encode_summary", lambda summary: {"replicate": "7"})
    assert "unreadable: KeyError" in refusal(read_summary, write(generations(3)).content)


def test_a_summary_of_another_replicate(monkeypatch: pytest.MonkeyPatch) -> None:
    encode = log_module.encode_summary
    monkeypatch.setattr(log_module, "encode_summary", lambda row: encode(summary(8)))
    assert "another replicate" in refusal(read_log, write(generations(3)).content)
