"""A log made to harm: with checksums that fit, it is still refused in one line or read harmlessly.

Memory is bounded by a multiple of stated limits, whatever the log claims or holds.
"""

import functools
import random
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from log_anatomy import (
    Part,
    framed,
    index_of,
    message,
    parsed,
    put_together,
    records,
    take_apart,
    written,
)
from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata
from store_samples import generations, write

from confinement import confined, no_longer
from evoexp.commands.facts import log_facts
from evoexp.commands.show import screen
from evoexp.errors import CorruptLog, EvoexpError
from evoexp.records import FrontRow
from evoexp.store import log_bounds, log_reader
from evoexp.store.log_reader import (
    generation_columns,
    read_log,
    read_solution,
    read_summary,
)
from matrix import counts, examples, matrices_are_asked_for

READERS: tuple[Callable[[Any], object], ...] = (
    read_log,
    read_summary,
    read_solution,
    generation_columns,
    lambda content: read_log(content).arrays(),
)
NUM_LOGS = counts(10_000, 100_000) if matrices_are_asked_for() else 300
# [MiB] beyond what the process has: for logs of a few kB, and for those as large as they may be
LITTLE, MOST = 500, 10 * log_bounds.MAX_LOG // 2**20


@pytest.fixture(scope="module")
def content() -> bytes:
    """Return a log with everything that a log may hold."""
    rows = generations(40)
    array = {"landscape": np.arange(12.0).reshape(3, 4)}
    rows[2] = rows[2]._replace(arrays=array)
    front = FrontRow(3, 0, np.array([[1.0, np.inf], [2.0, 0.5]]))
    return write(rows, fronts=[front]).content


def attempt(content: bytes) -> list[str]:
    """Read a log by every reader; return the refusals."""
    refusals = []
    for reader in READERS:
        try:
            with no_longer():
                reader(content)
        except CorruptLog as refusal:
            text = str(refusal)
            assert "\n" not in text and len(text) < 500, text
            assert "MemoryError" not in text, text
            refusals.append(text)
    return refusals


def chunk_of(parts: list[Part]) -> Part:
    """Return the first chunk."""
    return next(part for part in parts if part.opcode == Opcode.CHUNK)


def generation_rows(parts: list[Part], rows: Iterator[bytes] | list[bytes]) -> bytes:
    """Return a log with other messages on /generation."""
    chunk = chunk_of(parts)
    heads = [framed(*entry) for entry in records(chunk.body) if entry[0] != Opcode.MESSAGE]
    other = [entry for entry in records(chunk.body) if entry[0] == Opcode.MESSAGE]
    kept = [framed(*entry) for entry in other if struct.unpack_from("<H", entry[1])[0] != 1]
    chunk.body = b"".join([*heads, *(message(1, row) for row in rows), *kept])
    return put_together(parts)


def zeros(size: int) -> bytes:
    """Return a compressed frame of that many zeros, without holding them."""
    packer, piece = zstandard.ZstdCompressor().compressobj(size=size), bytes(2**20)
    packed = [packer.compress(piece) for _ in range(size // len(piece))]
    packed += [packer.compress(piece[: size % len(piece)]), packer.flush()]
    return b"".join(packed)


def test_a_chunk_that_unpacks_to_gigabytes(content: bytes, tmp_path: Path) -> None:
    parts, size = take_apart(content), 3 * 10**9
    chunk = chunk_of(parts)
    chunk.frame = zeros(size)
    for told, reason in ((size, "at most"), (1000, "size that it tells")):
        chunk.size = told
        bomb = put_together(parts)
        assert len(bomb) < 150_000
        refusals = confined(functools.partial(attempt, bomb), tmp_path, LITTLE)
        assert len(refusals) == len(READERS)
        assert any(reason in text for text in refusals)


def test_many_chunks_that_unpack_to_gigabytes(content: bytes, tmp_path: Path) -> None:
    parts = take_apart(content)
    size = 2**22
    more = [Part(Opcode.CHUNK, b"") for _ in range(1000)]
    full = framed(Opcode.SCHEMA, bytes(size - 9))
    for one in more:
        one.frame, one.size = b"", size
    frame = zstandard.compress(full)
    for one in more:
        one.frame = frame
    bomb = put_together([*parts, *more])
    assert len(bomb) < 500_000
    refusals = confined(lambda: attempt(bomb), tmp_path, LITTLE)
    assert any("too large: 1" in text and "up to 128 MB" in text for text in refusals)


def npy(shape: str, kind: str = "<f8", data: bytes = b"") -> bytes:
    """Return a `.npy` file that claims a shape."""
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


ARRAYS = {
    "ten thousand million items": npy("(10000000000,)"),
    "more items than there are integers": npy(f"({2**62}, {2**62})"),
    "no items along an endless axis": npy("(0, 9223372036854775807)"),
    "a negative length": npy("(-1,)", data=bytes(8)),
    "a length that is no number": npy("('a',)"),
    "too few items": npy("(3,)", data=bytes(16)),
    "too many items": npy("(3,)", data=bytes(32)),
    "objects": npy("(1,)", "|O", bytes(8)),
    "items of no kind": npy("(1,)", "<f3", bytes(3)),
    "fields": npy("(1,)", "<f8', 'x", bytes(8)),
    "nested deeply": npy("(" * 5000 + ")" * 5000),
    "a header without end": b"\x93NUMPY\x02\x00" + struct.pack("<I", 2**32 - 1),
    "a header of code": b"\x93NUMPY\x01\x00\x20\x00" + b"__import__('os').system('touch x')",
    "half a header": npy("(3,)")[:20],
    "another version": b"\x93NUMPY\x09\x00" + npy("(0,)")[8:],
    "nothing": b"",
}


@pytest.mark.parametrize("name", ARRAYS)
def test_an_array_that_claims_what_it_has_not(name: str, content: bytes, tmp_path: Path) -> None:
    parts = take_apart(content)
    for part in parts:
        if part.opcode == Opcode.ATTACHMENT:
            attachment = parsed(Attachment, part.body)
            if attachment.name.endswith(".npy"):
                attachment.data = ARRAYS[name]
                part.body = written(attachment)
    refusals = confined(lambda: attempt(put_together(parts)), tmp_path, LITTLE)
    assert len(refusals) == 1 and "ValueError" in refusals[0], refusals


GOOD = (
    b'{"index":%d,"best_cost":1,"best_cost_in_generation":1,"mean_cost":1,"std_cost":1,'
    b'"num_feasible":1,"evaluations":1,"collision_queries":1,"solved":true,"chain":"0"%s}'
)
ROWS: dict[str, list[bytes]] = {
    "nested deeply": [GOOD % (0, b',"x":' + b"[" * 100_000 + b"]" * 100_000)],
    "a huge whole number": [GOOD % (0, b',"term_a":' + b"9" * 100_000)],
    "a number beyond all": [GOOD % (0, b',"term_a":1e999')],
    "no number": [GOOD % (0, b',"term_a":NaN')],
    "a term that is a list": [GOOD % (0, b',"term_a":[1]')],
    "text for a number": [GOOD.replace(b'"mean_cost":1', b'"mean_cost":"1"') % (0, b"")],
    "true for a number": [GOOD.replace(b'"mean_cost":1', b'"mean_cost":true') % (0, b"")],
    "a number for text": [GOOD.replace(b'"chain":"0"', b'"chain":0') % (0, b"")],
    "nothing for a number": [GOOD.replace(b'"mean_cost":1', b'"mean_cost":null') % (0, b"")],
    "a flag for a list": [GOOD % (0, b',"nonfinite":[1]')],
    "a flag beyond its list": [GOOD % (0, b',"nonfinite":{"chain":{"7":"inf"}}')],
    "an index beyond 64 bits": [GOOD % (2**70, b"")],
    "no object": [b"[]"],
    "no field": [b"{}"],
    "half of it": [b'{"index":'],
}


@pytest.mark.parametrize("name", ROWS)
def test_a_generation_that_is_none(name: str, content: bytes, tmp_path: Path) -> None:
    hostile = generation_rows(take_apart(content), ROWS[name])
    refusals = confined(lambda: attempt(hostile), tmp_path, LITTLE)
    harmless = ("a huge whole number", "a number beyond all", "an index beyond 64 bits")
    assert refusals or name in harmless


def test_generations_that_each_have_terms_of_their_own(content: bytes, tmp_path: Path) -> None:
    terms = (b"".join(b',"term_%d":1' % (1000 * k + j) for j in range(1000)) for k in range(400))
    rows = [GOOD % (k, own) for k, own in enumerate(terms)]
    hostile = generation_rows(take_apart(content), rows)
    refusals = confined(lambda: attempt(hostile), tmp_path, LITTLE)
    assert any("400000 different terms" in text or "different terms" in text for text in refusals)


@pytest.mark.parametrize("share", examples((1, 10), lambda share: share == 10))
def test_a_log_as_large_as_any_takes_the_stated_memory(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, share: int
) -> None:
    """The costliest log is one of short numbers, or of many small generations."""
    for module in (log_bounds, log_reader):
        for name in ("MAX_LOG", "MAX_MESSAGE", "MAX_CHUNK"):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, getattr(module, name) // share)
    parts, size = take_apart(content), 2**22 // share
    first = chunk_of(parts)
    long = b'{"generation":0,"cost":1,"values":[' + b"0," * (size // 2) + b"0]}"
    channel = next(
        struct.unpack_from("<H", body)[0]
        for opcode, body in records(first.body)
        if opcode == Opcode.MESSAGE and b'"values"' in body
    )
    solutions = [Part(Opcode.CHUNK, message(channel, long)) for _ in range(28)]
    short = b"".join(message(1, GOOD % (k, b"")) for k in range(size // 250))
    rows = [Part(Opcode.CHUNK, short) for _ in range(28)]
    for more in (solutions, rows):
        whole = put_together([*parts, *more])
        assert 28 * size > log_bounds.MAX_LOG * 0.8
        task = functools.partial(attempt, whole)
        assert confined(task, tmp_path, MOST // share) == []


@pytest.mark.parametrize("opcode", [Opcode.ATTACHMENT, Opcode.METADATA])
def test_more_attachments_than_any_log_has(content: bytes, tmp_path: Path, opcode: Opcode) -> None:
    """Each takes many times its bytes in memory."""
    record = Attachment(0, 0, "", "", b"") if opcode == Opcode.ATTACHMENT else Metadata("", {})
    many = [Part(opcode, written(record))] * 3_000
    hostile = put_together([*take_apart(content), *many], index_of(content))
    assert len(confined(lambda: attempt(hostile), tmp_path, LITTLE)) == len(READERS)


def test_an_index_that_points_elsewhere(content: bytes) -> None:
    """What an attachment holds may look like a chunk, which nobody has checked."""
    parts = take_apart(content)
    index = index_of(put_together(parts))
    entry = next(body for opcode, body in index if opcode == Opcode.CHUNK_INDEX)
    moved = entry[:16] + struct.pack("<Q", 100) + entry[24:]
    for summary in (
        [(op, moved if body == entry else body) for op, body in index],
        [*index, (Opcode.CHUNK_INDEX, moved)],
        [(op, body) for op, body in index if body != entry],
    ):
        refusals = attempt(put_together(parts, summary))
        assert len(refusals) == len(READERS)
        assert all("index does not tell the records" in text for text in refusals)


def test_a_file_that_is_too_large_or_no_file(tmp_path: Path) -> None:
    path = tmp_path / "0000.mcap"
    with open(path, "wb") as file:
        file.truncate(3 * 10**9)
    for source, reason in ((path, "larger than 128 MB"), (Path("/dev/zero"), "no regular file")):
        for reader in READERS:
            with pytest.raises(CorruptLog, match=reason):
                reader(source)


VALUES = (
    *(b"null", b"true", b"-1", b"1e308", b"-1e999", b"9" * 400, b'""', b'"inf"', b'"nan"', b"[]"),
    *(b"{}", b"[[]]", b'{"a":1}', b'{"0":"inf"}', b'{"-1":"nan"}', b"[" * 2000, b'"\\u0000"'),
    *(b'"\\u001b[31m"', b'"<script>"', b"NaN", b"Infinity", b"0.0", b"2", b'"\\ud800"', b"1" * 30),
)
SIZES = (0, 1, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63, 2**64 - 1)


def mutated(content: bytes, rng: random.Random) -> bytes:
    """Return a log that is changed in one to three places, with checksums and digest that fit."""
    parts = take_apart(content)
    for _ in range(rng.randint(1, 3)):
        part = rng.choice(parts)
        match rng.randrange(8):
            case 0 | 1:  # a bit
                part.body = flipped(part.body, rng)
            case 2 | 3:  # a JSON value
                part.body = with_value(part.body, rng)
            case 4:  # a size, or four or eight of its bytes
                part.body = with_size(part.body, rng)
            case 5:
                part.body = spliced(part.body, rng)
            case 6:
                part.size = rng.choice(SIZES)
            case 7:
                rng.choice(
                    (parts.remove, parts.append, lambda one, parts=parts: parts.insert(0, one))
                )(part)
    if rng.random() < 0.02:
        rng.choice(parts).length = rng.choice(SIZES)
    summary = None
    if rng.random() < 0.2:
        summary = index_of(put_together(parts))
        if summary:
            k = rng.randrange(len(summary))
            change = rng.choice((flipped, with_size, spliced))
            summary[k] = (summary[k][0], change(summary[k][1], rng))
    return put_together(parts, summary)


def flipped(body: bytes, rng: random.Random) -> bytes:
    """Return bytes with one bit changed."""
    if not body:
        return body
    changed = bytearray(body)
    changed[rng.randrange(len(body))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def with_value(body: bytes, rng: random.Random) -> bytes:
    """Return bytes with another JSON value behind a colon; the records around it keep their sizes.

    Metadata and messages tell their sizes: a value is padded by blanks, or cut.
    """
    places = [k for k, byte in enumerate(body) if byte == ord(":")]
    if not places:
        return body
    start = rng.choice(places) + 1
    ends = [k for k in (body.find(sign, start) for sign in (b",", b"}", b"]")) if k >= 0]
    stop = min(ends, default=len(body))
    value = rng.choice(VALUES)
    room = stop - start
    return body[:start] + (value[:room] if len(value) > room else value.ljust(room)) + body[stop:]


def with_size(body: bytes, rng: random.Random) -> bytes:
    """Return bytes with a size in the place of two, four or eight of them."""
    width, form = rng.choice(((2, "<H"), (4, "<I"), (8, "<Q")))
    if len(body) < width:
        return body
    start = rng.randrange(len(body) - width + 1)
    size = struct.pack(form, rng.choice(SIZES) % 2 ** (8 * width))
    return body[:start] + size + body[start + width :]


def spliced(body: bytes, rng: random.Random) -> bytes:
    """Return bytes of which some are cut, doubled or moved."""
    a, b = sorted(rng.randrange(len(body) + 1) for _ in range(2))
    return rng.choice((body[:a] + body[b:], body[:b] + body[a:], body[a:b]))


def test_mutated_logs_are_refused_in_one_line_or_read(content: bytes, tmp_path: Path) -> None:
    refused = confined(lambda: sum(map(bool, tries(content, tmp_path))), tmp_path, LITTLE)
    assert 0.3 * NUM_LOGS < refused < NUM_LOGS


def tries(content: bytes, folder: Path) -> Iterator[list[str]]:
    """Yield the refusals of each mutated log, which is read, and shown as `evoexp show` does."""
    rng, path = random.Random(20), folder / "0007.mcap"
    for _ in range(NUM_LOGS):
        hostile = mutated(content, rng)
        yield attempt(hostile)
        if rng.random() < 0.1:
            path.write_bytes(hostile)
            try:
                with no_longer():
                    list(screen(log_facts(path), 80))
            except EvoexpError as refusal:
                assert "\n" not in str(refusal)


def test_checksums_of_the_sample_fit(content: bytes) -> None:
    whole = put_together(take_apart(content))
    assert attempt(whole) == []
    assert zlib.crc32(whole) != 0
