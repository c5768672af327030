"""Logs and tables without the times that no two runs share, and with every other byte.

A log is compared as bytes: its times are set to zero where they stand, and what depends on the
length or value of their text (offsets behind them, checksums over them) is set right or to zero.
"""

from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, ChunkIndex, DataEnd, Footer, Metadata, MetadataIndex

from evoexp.store.container import check, parse
from evoexp.store.log import SUMMARY

TIMES = ("certificate_s", "cpu_s", "wall_s")  # [s] all that two runs of a replicate may differ in
_MAGIC = 8  # [B]
_HEAD = 9  # [B] opcode and length of a record


def masked_log(content: bytes) -> bytes:
    """Return the bytes of a log with its times, and what follows from them, set to zero."""
    container = check(content, "log")
    records, place, start, longer = [], _MAGIC, 0, 0
    for opcode, body in container.data_section():
        if opcode == Opcode.METADATA and parse(Metadata, body).name == SUMMARY:
            masked = _without_times(body)
            start, longer = place, len(body) - len(masked)
        records.append((opcode, body))
        place += _HEAD + len(body)
    assert start, "a log has a summary"
    records += container.summary_section()
    found = [_masked(opcode, body, start, longer) for opcode, body in records]
    footer = Footer(container.summary_start - longer, 0, 0)
    return content[:_MAGIC] + b"".join([*found, _bytes(footer)]) + content[-_MAGIC:]


def masked_rows(summary: Path) -> list[dict[str, Any]]:
    """Return the rows of a `summary.parquet` without their times; floats as hexadecimal text."""
    with pq.ParquetFile(summary) as file:
        rows = file.read().to_pylist()
    return [
        {k: v.hex() if isinstance(v, float) else v for k, v in row.items() if k not in TIMES}
        for row in rows
    ]


def masked_run(run: Path) -> dict[str, Any]:
    """Return all that a run directory holds, by name; logs and rows are masked."""
    masks = {".mcap": lambda path: masked_log(path.read_bytes()), ".parquet": masked_rows}
    return {
        str(path.relative_to(run)): masks.get(path.suffix, Path.read_bytes)(path)
        for path in sorted(run.rglob("*"))
        if path.is_file() and path.name != ".lock"
    }


def masked_store(outputs: Path) -> dict[str, Any]:
    """Return `masked_run` of every run of a store, under `run/name`."""
    return {
        f"{run.name}/{name}": value
        for run in sorted((outputs / "runs").iterdir())
        for name, value in masked_run(run).items()
    }


def differing(one: dict[str, Any], two: dict[str, Any]) -> list[str]:
    """Return the names under which two stores do not hold the same."""
    return sorted(
        name for name in one.keys() | two.keys() if one.get(name, ...) != two.get(name, ...)
    )


def _without_times(body: bytes) -> bytes:
    metadata = parse(Metadata, body)
    assert metadata.metadata.keys() >= set(TIMES)
    metadata.metadata |= dict.fromkeys(TIMES, "0")
    return _bytes(metadata)[_HEAD:]


def _masked(opcode: int, body: bytes, start: int, longer: int) -> bytes:
    """Return a record as it were if the summary, which begins at `start`, were `longer` less."""

    def moved(offset: int) -> int:
        return offset - longer if offset > start else offset

    if opcode == Opcode.METADATA and parse(Metadata, body).name == SUMMARY:
        body = _without_times(body)
    elif opcode == Opcode.DATA_END:
        body = _bytes(DataEnd(0))[_HEAD:]
    elif opcode == Opcode.METADATA_INDEX:
        entry = parse(MetadataIndex, body)
        length = entry.length - longer if entry.offset == start else entry.length
        body = _bytes(MetadataIndex(moved(entry.offset), length, entry.name))[_HEAD:]
    elif opcode == Opcode.ATTACHMENT_INDEX:
        attachment = parse(AttachmentIndex, body)
        attachment.offset = moved(attachment.offset)
        body = _bytes(attachment)[_HEAD:]
    elif opcode == Opcode.CHUNK_INDEX:
        chunk = parse(ChunkIndex, body)
        chunk.chunk_start_offset = moved(chunk.chunk_start_offset)
        places = chunk.message_index_offsets
        chunk.message_index_offsets = {k: moved(offset) for k, offset in places.items()}
        body = _bytes(chunk)[_HEAD:]
    return bytes([opcode]) + len(body).to_bytes(8, "little") + body


def _bytes(record: Any) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()
