"""Logs and tables without the times that no two runs share, and with everything else.

A log is compared record by record: its times are set to zero, chunks are compared as what they
hold, and what depends on length or value of them (offsets, checksums) is left out.
"""

from io import BytesIO
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
from mcap import records as mcap
from mcap.stream_reader import StreamReader, breakup_chunk

from evoexp.store.log import SUMMARY

TIMES = ("certificate_s", "cpu_s", "wall_s")  # [s] all that two runs of a replicate may differ in


def masked_log(content: bytes) -> bytes:
    """Return the records of a log with its times, and what follows from them, set to zero."""
    records = StreamReader(BytesIO(content), emit_chunks=True).records
    return "\n".join(map(repr, map(_masked, records))).encode()


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
    names = sorted(one.keys() | two.keys())
    return [name for name in names if one.get(name, ...) != two.get(name, ...)]


def _masked(record: mcap.McapRecord) -> Any:
    """Return a record without times, places and checksums."""
    match record:
        case mcap.Metadata(name=name) if name == SUMMARY:
            assert record.metadata.keys() >= set(TIMES)
            record.metadata |= dict.fromkeys(TIMES, "0")
        case mcap.Chunk():
            return list(map(_masked, breakup_chunk(record)))
        case mcap.Message():
            record.publish_time = 0
        case mcap.MetadataIndex():
            return record.name
        case mcap.AttachmentIndex():
            record.offset = 0
        case mcap.ChunkIndex():
            span = record.message_start_time, record.message_end_time
            return span, sorted(record.message_index_offsets), record.uncompressed_size
        case mcap.DataEnd() | mcap.Footer() | mcap.MessageIndex():
            return type(record).__name__
    return record
