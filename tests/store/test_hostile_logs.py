"""A log made to harm: with checksums that fit, it is still refused in one line or read harmlessly.

Memory is bounded by a multiple of stated limits, whatever the log claims or holds.
"""

import functools
import random
import struct
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import log_anatomy as anatomy
import numpy as np
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata
from store_samples import generations, write

from confinement import confined, no_longer
from evoexp.commands.show import log_facts, screen
from evoexp.errors import CorruptLog, EvoexpError
from evoexp.records import FrontRow
from evoexp.store import log_reader
from evoexp.store.log_reader import generation_columns, read_log, read_solution, read_summary
from matrix import counts, examples, matrices_are_asked_for
from test_input_files import OTHERS

READERS: tuple[Callable[[Any], object], ...] = (
    read_log,
    read_summary,
    read_solution,
    generation_columns,
    lambda content: read_log(content).arrays(),
)
NUM_LOGS = counts(10_000, 100_000) if matrices_are_asked_for() else 300
# [MiB] beyond what the process has: for logs of a few kB, and for those as large as they may be
LITTLE, MOST = 500, 10 * log_reader.MAX_LOG // 2**20


ROWS = generations(40)
ROWS[2] = ROWS[2]._replace(arrays={"landscape": np.arange(12.0).reshape(3, 4)})
# a log with everything that a log may hold
CONTENT = write(ROWS, fronts=[FrontRow(3, 0, np.array([[1.0, np.inf], [2.0, 0.5]]))]).content


def attempt(content: bytes) -> list[str]:
    """Read a log by every reader; return the refusals."""
    refusals = []
    for reader in READERS:
        try:
            with no_longer():
                reader(content)
        except CorruptLog as refusal:
            text = str(refusal)
            assert "\n" not in text and len(text) < 500 and "MemoryError" not in text, text
            refusals.append(text)
    return refusals


def opened() -> tuple[list[anatomy.Part], anatomy.Part]:
    """Return the parts of the log, and its first chunk among them."""
    parts = anatomy.take_apart(CONTENT)
    return parts, next(part for part in parts if part.opcode == Opcode.CHUNK)


def with_rows(rows: Iterable[bytes]) -> bytes:
    """Return a log with other messages on /generation."""
    parts, chunk = opened()
    kept = {True: b"", False: b""}  # messages of other topics; schemas and channels
    for opcode, body in anatomy.records(chunk.body):
        is_message = opcode == Opcode.MESSAGE
        if not is_message or struct.unpack_from("<H", body)[0] != 1:
            kept[is_message] += anatomy.framed(opcode, body)
    chunk.body = b"".join([kept[False], *(anatomy.message(1, row) for row in rows), kept[True]])
    return anatomy.put_together(parts)


def zeros(size: int) -> bytes:
    """Return a compressed frame of that many zeros, without holding them."""
    packer, piece = zstandard.ZstdCompressor().compressobj(size=size), bytes(2**20)
    packed = [packer.compress(piece) for _ in range(size // len(piece))]
    return b"".join([*packed, packer.compress(piece[: size % len(piece)]), packer.flush()])


def test_a_chunk_that_unpacks_to_gigabytes(tmp_path: Path) -> None:
    (parts, chunk), size = opened(), 3 * 10**9
    chunk.frame = zeros(size)
    for told, reason in ((size, "at most"), (1000, "size that it states")):
        chunk.size = told
        bomb = anatomy.put_together(parts)
        assert len(bomb) < 150_000
        refusals = confined(functools.partial(attempt, bomb), tmp_path, LITTLE)
        assert len(refusals) == len(READERS)
        assert any(reason in text for text in refusals)


def test_many_chunks_that_unpack_to_gigabytes(tmp_path: Path) -> None:
    (parts, _), size = opened(), 2**22
    part = anatomy.Part(Opcode.CHUNK, b"")
    part.frame, part.size = zstandard.compress(anatomy.framed(Opcode.SCHEMA, bytes(size - 9))), size
    bomb = anatomy.put_together([*parts, *[part] * 1000])
    assert len(bomb) < 500_000
    refusals = confined(lambda: attempt(bomb), tmp_path, LITTLE)
    assert any("too large: 1" in text and "up to 128 MB" in text for text in refusals)


@pytest.mark.parametrize("name", ["ten thousand million items", "code", "nothing"])
def test_an_array_that_claims_what_it_has_not(name: str, tmp_path: Path) -> None:
    parts, _ = opened()
    for part in (each for each in parts if each.opcode == Opcode.ATTACHMENT):
        attachment = anatomy.parsed(Attachment, part.body)
        if attachment.name.endswith(".npy"):
            attachment.data = OTHERS[name][0]
            part.body = anatomy.written(attachment)
    (refusal,) = confined(lambda: attempt(anatomy.put_together(parts)), tmp_path, LITTLE)
    assert "ValueError" in refusal


GOOD = (
    b'{"index":%d,"best_cost":1,"best_cost_in_generation":1,"mean_cost":1,"std_cost":1,'
    b'"num_feasible":1,"evaluations":1,"collision_queries":1,"solved":true,"chain":"0"%s}'
)
ROW = GOOD % (0, b"")
HARMLESS = {
    "a huge whole number": GOOD % (0, b',"term_a":' + b"9" * 100_000),
    "a number beyond all": GOOD % (0, b',"term_a":1e999'),
    "an index beyond 64 bits": GOOD % (2**70, b""),
}
ROWS = HARMLESS | {
    "nested deeply": GOOD % (0, b',"x":' + b"[" * 100_000 + b"]" * 100_000),
    "no number": GOOD % (0, b',"term_a":NaN'),
    "a term that is a list": GOOD % (0, b',"term_a":[1]'),
    "text for a number": ROW.replace(b'"mean_cost":1', b'"mean_cost":"1"'),
    "true for a number": ROW.replace(b'"mean_cost":1', b'"mean_cost":true'),
    "nothing for a number": ROW.replace(b'"mean_cost":1', b'"mean_cost":null'),
    "a number for text": ROW.replace(b'"chain":"0"', b'"chain":0'),
    "a flag for a list": GOOD % (0, b',"nonfinite":[1]'),
    "a flag beyond its list": GOOD % (0, b',"nonfinite":{"chain":{"7":"inf"}}'),
    "no object": b"[]",
    "no field": b"{}",
    "half of it": b'{"index":',
}


@pytest.mark.parametrize("name", ROWS)
def test_a_generation_that_is_none(name: str, tmp_path: Path) -> None:
    refusals = confined(lambda: attempt(with_rows([ROWS[name]])), tmp_path, LITTLE)
    assert refusals or name in HARMLESS


def test_generations_that_each_have_terms_of_their_own(tmp_path: Path) -> None:
    terms = (b"".join(b',"term_%d":1' % (1000 * k + j) for j in range(1000)) for k in range(400))
    hostile = with_rows([GOOD % (k, own) for k, own in enumerate(terms)])
    refusals = confined(lambda: attempt(hostile), tmp_path, LITTLE)
    assert any("different terms" in text for text in refusals)


@pytest.mark.parametrize("share", examples((1, 10), lambda share: share == 10))
def test_a_log_as_large_as_any_takes_the_stated_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, share: int
) -> None:
    """The costliest log is one of short numbers, or of many small generations."""
    for name in ("MAX_LOG", "MAX_MESSAGE", "MAX_CHUNK"):
        monkeypatch.setattr(log_reader, name, getattr(log_reader, name) // share)
    (parts, first), size = opened(), 2**22 // share
    long = b'{"generation":0,"cost":1,"values":[' + b"0," * (size // 2) + b"0]}"
    messages = (body for opcode, body in anatomy.records(first.body) if opcode == Opcode.MESSAGE)
    channel = next(struct.unpack_from("<H", body)[0] for body in messages if b'"values"' in body)
    short = b"".join(anatomy.message(1, GOOD % (k, b"")) for k in range(size // 250))
    for body in (anatomy.message(channel, long), short):
        whole = anatomy.put_together([*parts, *[anatomy.Part(Opcode.CHUNK, body)] * 28])
        assert 28 * size > log_reader.MAX_LOG * 0.8
        assert confined(functools.partial(attempt, whole), tmp_path, MOST // share) == []


@pytest.mark.parametrize("record", [Attachment(0, 0, "", "", b""), Metadata("", {})])
def test_more_attachments_than_any_log_has(tmp_path: Path, record: Any) -> None:
    """Each takes many times its bytes in memory."""
    opcode = Opcode.ATTACHMENT if isinstance(record, Attachment) else Opcode.METADATA
    many = [anatomy.Part(opcode, anatomy.written(record))] * 3_000
    hostile = anatomy.put_together([*anatomy.take_apart(CONTENT), *many], anatomy.index_of(CONTENT))
    assert len(confined(lambda: attempt(hostile), tmp_path, LITTLE)) == len(READERS)


def test_an_index_that_points_elsewhere() -> None:
    """What an attachment holds may look like a chunk, which nobody has checked."""
    parts = anatomy.take_apart(CONTENT)
    whole = anatomy.put_together(parts)
    assert attempt(whole) == [], "what is refused has a fault"
    index = anatomy.index_of(whole)
    entry = next(body for opcode, body in index if opcode == Opcode.CHUNK_INDEX)
    moved = entry[:16] + struct.pack("<Q", 100) + entry[24:]
    for summary in (
        [(op, moved if body == entry else body) for op, body in index],
        [*index, (Opcode.CHUNK_INDEX, moved)],
        [(op, body) for op, body in index if body != entry],
    ):
        refusals = attempt(anatomy.put_together(parts, summary))
        assert len(refusals) == len(READERS)
        assert all("index does not list the records" in text for text in refusals)


def test_a_file_that_is_too_large_or_no_file(tmp_path: Path) -> None:
    path = tmp_path / "0000.mcap"
    with open(path, "wb") as file:
        file.truncate(3 * 10**9)
    for source, reason in ((path, "larger than 128 MB"), (Path("/dev/zero"), "not a regular file")):
        for reader in READERS:
            with pytest.raises(CorruptLog, match=reason):
                reader(source)


VALUES = (
    *(b"null", b"true", b"-1", b"1e308", b"-1e999", b"9" * 400, b'""', b'"inf"', b'"nan"', b"[]"),
    *(b"{}", b"[[]]", b'{"a":1}', b'{"0":"inf"}', b'{"-1":"nan"}', b"[" * 2000, b'"\\u0000"'),
    *(b'"\\u001b[31m"', b'"<script>"', b"NaN", b"Infinity", b"0.0", b"2", b'"\\ud800"', b"1" * 30),
)
SIZES = (0, 1, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63, 2**64 - 1)


def flipped(body: bytes, rng: random.Random) -> bytes:
    """Change one bit."""
    changed = bytearray(body)
    if body:
        changed[rng.randrange(len(body))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def with_value(body: bytes, rng: random.Random) -> bytes:
    """Put another JSON value behind a colon, padded or cut: records around it keep their sizes."""
    places = [k for k, byte in enumerate(body) if byte == ord(":")]
    if not places:
        return body
    start = rng.choice(places) + 1
    ends = [k for k in (body.find(sign, start) for sign in (b",", b"}", b"]")) if k >= 0]
    stop = min(ends, default=len(body))
    return body[:start] + rng.choice(VALUES).ljust(stop - start)[: stop - start] + body[stop:]


def with_size(body: bytes, rng: random.Random) -> bytes:
    """Put a size in the place of two, four or eight bytes."""
    width, form = rng.choice(((2, "<H"), (4, "<I"), (8, "<Q")))
    if len(body) < width:
        return body
    start = rng.randrange(len(body) - width + 1)
    size = struct.pack(form, rng.choice(SIZES) % 2 ** (8 * width))
    return body[:start] + size + body[start + width :]


def spliced(body: bytes, rng: random.Random) -> bytes:
    """Cut, double or move bytes."""
    a, b = sorted(rng.randrange(len(body) + 1) for _ in range(2))
    return rng.choice((body[:a] + body[b:], body[:b] + body[a:], body[a:b]))


def mutated(rng: random.Random) -> bytes:
    """Return a log that is changed in one to three places, with checksums and digest that fit."""
    parts, summary = anatomy.take_apart(CONTENT), None
    for _ in range(rng.randint(1, 3)):
        part = rng.choice(parts)
        kind = rng.randrange(8)
        if kind < 6:
            change = (flipped, flipped, with_value, with_value, with_size, spliced)[kind]
            part.body = change(part.body, rng)
        elif kind == 6:
            part.size = rng.choice(SIZES)
        else:
            without = [each for each in parts if each is not part]
            parts = rng.choice((without, [*parts, part], [part, *parts]))
    if rng.random() < 0.02:
        rng.choice(parts).length = rng.choice(SIZES)
    if rng.random() < 0.2 and (summary := anatomy.index_of(anatomy.put_together(parts))):
        k = rng.randrange(len(summary))
        change = rng.choice((flipped, with_size, spliced))
        summary[k] = (summary[k][0], change(summary[k][1], rng))
    return anatomy.put_together(parts, summary)


def tries(folder: Path) -> Iterator[list[str]]:
    """Yield the refusals of each mutated log, which is read, and shown as `evoexp show` does."""
    rng, path = random.Random(20), folder / "0007.mcap"
    for _ in range(NUM_LOGS):
        hostile = mutated(rng)
        yield attempt(hostile)
        if rng.random() < 0.1:
            path.write_bytes(hostile)
            try:
                with no_longer():
                    list(screen(log_facts(path), 80))
            except EvoexpError as refusal:
                assert "\n" not in str(refusal)


def test_mutated_logs_are_refused_in_one_line_or_read(tmp_path: Path) -> None:
    refused = confined(lambda: sum(map(bool, tries(tmp_path))), tmp_path, LITTLE)
    assert 0.3 * NUM_LOGS < refused < NUM_LOGS
