"""Logs read back: whole and verified, or only the part that is asked for.

Every reader first checks all bytes against their checksums; only `read_log` also decodes every
message and compares the content digest. Limits of size and memory stand in `container`.
"""

import errno
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Metadata,
    MetadataIndex,
    Schema,
)
from numpy.typing import NDArray

from evoexp.errors import CorruptLog, OtherVersion
from evoexp.input_files import read_bounded, read_npy
from evoexp.records import FloatArray, FrontRow, GenerationRow, ReplicateSummary, SolutionRow
from evoexp.store import log as written
from evoexp.store.container import (
    MAX_ATTACHMENTS,
    MAX_LOG,
    MAX_METADATA,
    Container,
    Message,
    check,
    parse,
    unreadable_is_corrupt,
)
from evoexp.store.digests import ContentDigest, channel_identity
from evoexp.store.messages import (
    decode_environment,
    decode_front,
    decode_generation,
    decode_solution,
    decode_summary,
    decode_values,
)

Source = str | PathLike[str] | bytes


class LogContents(NamedTuple):
    """Everything that a log holds."""

    condition_id: str  # 64 hex digits
    config_json: bytes
    replicate: int
    generations: list[GenerationRow]
    solutions: list[SolutionRow]
    fronts: list[FrontRow]
    summary: ReplicateSummary
    environment: dict[str, Any]
    attachments: dict[str, bytes]  # without the configuration
    content_digest: str  # 32 hex digits, over all messages
    # (generations,) [s] CPU time of the replicate when each was logged; NaN in logs of older code
    cpu_s: FloatArray

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the attached arrays by their names, in alphabetical order.

        Raises:
            CorruptLog: If one of them is none.
        """
        return {
            name.removesuffix(written.ARRAY): decode_array(data)
            for name, data in sorted(self.attachments.items())
            if name.endswith(written.ARRAY)
        }


class _Index(NamedTuple):
    """The summary section of a log: where everything is."""

    metadata: dict[str, int]  # name → offset
    channels: dict[str, Channel]  # by topic
    schemas: dict[int, str]  # id → name
    chunks: list[ChunkIndex]
    attachments: dict[str, int]  # name → offset


def read_log(source: Source) -> LogContents:
    """Return everything that a log holds, verified.

    Args:
        source: Path of a log, or its bytes.

    Raises:
        CorruptLog: The log is empty, cut, altered, foreign, of a newer schema version, or cannot be
            opened.
    """
    container, name = _open(source)
    with unreadable_is_corrupt(name):
        index = _index(container)
        run = _run(container, index, name)
        attachments = _attachments(container, index, name)
        messages, content_digest = _messages(container, index)
        generations = messages.get(written.GENERATION_TOPIC, ())
        metadata = _metadata(container, index, written.SUMMARY, name)
        if content_digest != decode_values(metadata)[written.CONTENT_DIGEST]:
            raise CorruptLog(
                f"{name}: altered: its messages do not give the content digest it carries"
            )
        summary = _summary(metadata, run, name)
        return LogContents(
            condition_id=run["condition"],
            config_json=attachments.pop(written.CONFIG),
            replicate=summary.replicate,
            generations=[decode_generation(m.data) for m in generations],
            solutions=[decode_solution(m.data) for m in messages.get(written.SOLUTION_TOPIC, ())],
            fronts=[decode_front(m.data) for m in messages.get(written.FRONT_TOPIC, ())],
            summary=summary,
            environment=decode_environment(_metadata(container, index, written.ENVIRONMENT, name)),
            attachments=attachments,
            content_digest=content_digest,
            cpu_s=_cpu_times(run, generations),
        )


def read_summary(source: Source) -> ReplicateSummary:
    """Return a log's summary; no message is decoded.

    Raises:
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    container, name = _open(source)
    with unreadable_is_corrupt(name):
        index = _index(container)
        run = _run(container, index, name)
        return _summary(_metadata(container, index, written.SUMMARY, name), run, name)


@contextmanager
def indexed(source: Source) -> Iterator[tuple[Container, "_Index"]]:
    """Open a log of a run by its index; a body that cannot be read is a damaged log."""
    container, name = _open(source)
    with unreadable_is_corrupt(name):
        index = _index(container)
        _run(container, index, name)
        yield container, index


def read_solution(source: Source) -> SolutionRow:
    """Return a log's last solution, the best of the replicate; only its chunk is decompressed.

    Raises:
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    with indexed(source) as (container, index):
        channel_id = index.channels[written.SOLUTION_TOPIC].id
        last = [chunk for chunk in index.chunks if channel_id in chunk.message_index_offsets][-1]
        solutions = [m.data for m in container.messages_at(last) if m.channel_id == channel_id]
        return decode_solution(solutions[-1])


def array_names(source: Source) -> list[str]:
    """Return the names of the arrays that are attached to a log, in alphabetical order.

    Raises:
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    with indexed(source) as (_, index):
        return sorted(
            n.removesuffix(written.ARRAY) for n in index.attachments if n.endswith(written.ARRAY)
        )


def read_array(source: Source, array: str) -> NDArray[Any]:
    """Return one of the arrays that are attached to a log; nothing else is decoded.

    Args:
        source: Path of a log, or its bytes.
        array: Its name, without `.npy`.

    Raises:
        KeyError: There is none of this name.
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    with indexed(source) as (container, index):
        offset = index.attachments.get(array + written.ARRAY)
        if offset is not None:
            return decode_array(parse(Attachment, container.record_at(offset)).data)
    raise KeyError(array)


def decode_array(data: bytes) -> NDArray[Any]:
    """Return the array that a `.npy` attachment holds.

    Raises:
        CorruptLog: If it is none.
    """
    with unreadable_is_corrupt("attached array"):
        return read_npy(data)


def _open(source: Source) -> tuple[Container, str]:
    if isinstance(source, bytes):
        return check(source, "log"), "log"
    try:
        return check(read_bounded(Path(source), MAX_LOG), str(source)), str(source)
    except OSError as error:
        if error.errno in (errno.EMFILE, errno.ENFILE, errno.ENOMEM):  # no fault of the file
            raise
        raise CorruptLog(f"{source}: cannot be read: {error.strerror or error}") from error


def _index(container: Container) -> _Index:
    index = _Index({}, {}, {}, [], {})
    for opcode, body in container.summary_section():
        _refuse_long(body)
        if opcode == Opcode.METADATA_INDEX:
            entry = parse(MetadataIndex, body)
            index.metadata[entry.name] = entry.offset
        elif opcode == Opcode.CHANNEL:
            channel = parse(Channel, body)
            index.channels[channel.topic] = channel
        elif opcode == Opcode.SCHEMA:
            schema = parse(Schema, body)
            index.schemas[schema.id] = schema.name
        elif opcode == Opcode.CHUNK_INDEX:
            index.chunks.append(parse(ChunkIndex, body))
        elif opcode == Opcode.ATTACHMENT_INDEX:
            attachment = parse(AttachmentIndex, body)
            index.attachments[attachment.name] = attachment.offset
    if len(index.attachments) > MAX_ATTACHMENTS:
        raise ValueError(f"{len(index.attachments)} attachments; {MAX_ATTACHMENTS} are read")
    return index


def _refuse_long(body: bytes) -> None:
    if len(body) > MAX_METADATA:
        raise ValueError(f"{len(body)} bytes in a record of at most {MAX_METADATA}")


def _metadata(container: Container, index: _Index, record: str, name: str) -> dict[str, str]:
    if record not in index.metadata:
        raise CorruptLog(f"{name}: incomplete: no metadata record '{record}'")
    body = container.record_at(index.metadata[record])
    _refuse_long(body)
    metadata: dict[str, str] = parse(Metadata, body).metadata
    return metadata


def _run(container: Container, index: _Index, name: str) -> dict[str, str]:
    """Return the metadata of a log's condition and replicate.

    A log of another program or version is refused.
    """
    if written.RUN not in index.metadata:
        raise CorruptLog(
            f"{name}: not a log of evoexp: an MCAP without metadata record '{written.RUN}'"
        )
    run = _metadata(container, index, written.RUN, name)
    version = int(run["schema_version"])
    if version != written.SCHEMA_VERSION:
        age = "a newer" if version > written.SCHEMA_VERSION else "an older"
        raise OtherVersion(
            f"{name}: written by {age} evoexp: schema version {version}, this one reads "
            f"{written.SCHEMA_VERSION}"
        )
    return run


def _summary(metadata: dict[str, str], run: dict[str, str], name: str) -> ReplicateSummary:
    summary = decode_summary(metadata)
    if (summary.condition, summary.replicate) != (run["condition"], int(run["replicate"])):
        raise CorruptLog(f"{name}: altered: its summary is of another replicate")
    return summary


def _attachments(container: Container, index: _Index, name: str) -> dict[str, bytes]:
    """Return all attachments by name, after comparing the index with the records it points to.

    Readers that follow the index must see what is verified here: no record stands in the file
    twice, under another name or beside its index.
    """
    attachments, metadata, chunks = list[tuple[int, Attachment]](), list[tuple[str, int]](), []
    for opcode, start, body in container.places():
        if opcode == Opcode.ATTACHMENT:
            attachments.append((start, parse(Attachment, body)))
        elif opcode == Opcode.METADATA:
            _refuse_long(body)
            metadata.append((parse(Metadata, body).name, start))
        elif opcode == Opcode.CHUNK:
            chunks.append(start)
    named = [(each.name, start) for start, each in attachments]
    if named != list(index.attachments.items()) or metadata != list(index.metadata.items()):
        raise CorruptLog(f"{name}: altered: its index does not tell the records that it holds")
    if chunks != [chunk.chunk_start_offset for chunk in index.chunks]:
        raise CorruptLog(f"{name}: altered: its index does not tell the messages that it holds")
    return {each.name: each.data for _, each in attachments}


def _messages(container: Container, index: _Index) -> tuple[dict[str, list[Message]], str]:
    """Return all messages by topic, and the content digest over them."""
    digest = ContentDigest()
    topics = {channel.id: topic for topic, channel in index.channels.items()}
    identities = {
        c.id: channel_identity(c.topic, index.schemas[c.schema_id], c.message_encoding)
        for c in index.channels.values()
    }
    messages: dict[str, list[Message]] = {}
    for message in container.messages():
        channel_id, sequence, log_time, _, data = message
        digest.update(identities[channel_id], log_time, sequence, data)
        messages.setdefault(topics[channel_id], []).append(message)
    return messages, digest.hexdigest()


def _cpu_times(run: dict[str, str], generations: Sequence[Message]) -> FloatArray:
    """Return the CPU time at which each generation was logged [s]; NaN where logs do not tell."""
    if run.get(written.PUBLISHED) != written.CPU_TIME:
        return np.full(len(generations), np.nan)
    return 1e-9 * np.array([message.publish_time for message in generations], dtype=np.float64)
