"""A damaged log is always recognised, by one line that names it, and never by another exception."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType, Writer
from store_samples import generations, write

from evoexp.errors import CorruptLog
from evoexp.store import log as log_module
from evoexp.store.log_reader import generation_columns, read_log, read_solution, read_summary
from forged_logs import with_metadata

Reader = Callable[[bytes | Path], object]
CONTENT, SMALL = write(generations(60)).content, generations(3)
each_reader = pytest.mark.parametrize(
    "reader", [read_log, read_summary, read_solution, generation_columns]
)


def refusal(reader: Reader, source: bytes | Path) -> str:
    with pytest.raises(CorruptLog) as caught:
        reader(source)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@each_reader
def test_a_log_that_is_cut_or_altered_anywhere_is_refused(reader: Reader) -> None:
    for size in range(0, len(CONTENT), 29):
        refusal(reader, CONTENT[:size])
    half, rng, damaged = len(CONTENT) // 2, np.random.default_rng(1), bytearray(CONTENT)
    refusal(reader, CONTENT + CONTENT)
    refusal(reader, CONTENT[:half] + bytes(half))
    for position in rng.integers(len(CONTENT), size=500).tolist():
        flip = int(rng.integers(1, 256))
        damaged[position] ^= flip
        refusal(reader, bytes(damaged))
        damaged[position] ^= flip
    reader(bytes(damaged))


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
    schema = writer.register_schema("other", "jsonschema", b"{}")
    writer.add_message(writer.register_channel("/generation", "json", schema), 0, b"{}", 0)
    writer.finish()
    return buffer.getvalue()


OTHER_PROGRAM = "not a log of evoexp: an MCAP of another program"
REASONS = {
    "the last byte is missing": (CONTENT[:-1], "cut"),
    "a byte more": (CONTENT + b"\0", "cut or overwritten"),
    "nothing": (b"", "empty"),
    "a table": (b"PAR1" * 100, "not an MCAP"),
    "with checksums": (foreign(checksums=True), "evoexp.run"),
    "without checksums": (foreign(checksums=False), OTHER_PROGRAM),
    "without a summary": (foreign(checksums=False, **NO_SUMMARY), OTHER_PROGRAM),
    "LZ4": (foreign(checksums=False, compression=CompressionType.LZ4), OTHER_PROGRAM),
    "without chunks": (foreign(checksums=False, use_chunking=False), OTHER_PROGRAM),
}


@each_reader
@pytest.mark.parametrize(("content", "reason"), REASONS.values(), ids=REASONS)
def test_the_reason_is_told(reader: Reader, content: bytes, reason: str) -> None:
    assert reason in refusal(reader, content)


def test_the_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "0003.mcap"
    assert refusal(read_log, path).startswith(f"{path}: cannot be read: No such file")
    path.write_bytes(CONTENT[:100])
    assert refusal(read_summary, path).startswith(f"{path}: cut")
    assert refusal(read_log, tmp_path).startswith(f"{tmp_path}: cannot be read")


@each_reader
@pytest.mark.parametrize(("other", "age"), [(1, "an older"), (3, "a newer")])
def test_other_schema_version(
    reader: Reader, monkeypatch: pytest.MonkeyPatch, other: int, age: str
) -> None:
    monkeypatch.setattr(log_module, "SCHEMA_VERSION", other)
    of_another_version = write(SMALL).content
    reader(of_another_version)
    monkeypatch.undo()
    expected = f"written by {age} evoexp: schema version {other}, this one reads 2"
    assert expected in refusal(reader, of_another_version)


@pytest.mark.parametrize(
    ("replicate", "reason"), [(8, "another replicate"), (None, "unreadable: ")]
)
def test_what_good_checksums_hide_is_seen(replicate: int | None, reason: str) -> None:
    content = with_metadata(write(SMALL).content, log_module.SUMMARY, replicate=replicate)
    assert reason in refusal(read_log, content)
