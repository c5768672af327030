"""Logs and tables without the times that no two runs share, and with every other byte.

A log is compared as bytes: its times are set to zero where they stand, chunks are compared as what
they hold, and what depends on length or value of them (offsets, checksums) is set to zero.
"""

from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, ChunkIndex, Metadata, MetadataIndex

from evoexp.store.container import check, chunk_messages, parse
from evoexp.store.log import SUMMARY

TIMES = ("certificate_s", "cpu_s", "wall_s")  # [s] all that two runs of a replicate may differ in
_HEAD = 9  # [B] opcode and length of a record


def masked_log(content: bytes) -> bytes:
    """Return the bytes of a log with its times, and what follows from them, set to zero."""
    container = check(content, "log")
    records = [*container.data_section(), *container.summary_section()]
    return b"".join(_masked(opcode, body) for opcode, body in records)


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


def _masked(opcode: int, body: bytes) -> bytes:
    """Return a record without times, places and checksums."""
    if opcode == Opcode.METADATA and parse(Metadata, body).name == SUMMARY:
        body = _without_times(body)
    elif opcode == Opcode.CHUNK:
        messages = [message._replace(publish_time=0) for message in chunk_messages(body)]
        body = repr(messages).encode()
    elif opcode == Opcode.DATA_END:
        body = b""
    elif opcode == Opcode.METADATA_INDEX:
        body = parse(MetadataIndex, body).name.encode()
    elif opcode == Opcode.ATTACHMENT_INDEX:
        attachment = parse(AttachmentIndex, body)
        attachment.offset = 0
        body = _bytes(attachment)[_HEAD:]
    elif opcode == Opcode.CHUNK_INDEX:
        chunk = parse(ChunkIndex, body)
        body = repr((chunk.message_start_time, chunk.message_end_time)).encode()
        body += repr((sorted(chunk.message_index_offsets), chunk.uncompressed_size)).encode()
    return bytes([opcode]) + len(body).to_bytes(8, "little") + body


def _bytes(record: Any) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()
