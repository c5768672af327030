"""What is written comes back as it was, and the same content gives the same digests.

A damaged log is always recognised, by one line that names it, and never by another exception.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest
import xxhash
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer
from store_samples import CONDITION, CONFIG, ENVIRONMENT, SUMMARY, generations, write

from evoexp.errors import CorruptLog
from evoexp.numeric.generator_state import state_bytes
from evoexp.records import Block, FrontRow, Generation, GenerationRow
from evoexp.store import log as log_module
from evoexp.store.log import Finished, Log, array_bytes
from evoexp.store.log_reader import generation_columns, read_log, read_solution, read_summary
from forged_logs import with_metadata
from masked_logs import TIMES, masked_log

FRONT = FrontRow(4, 0, np.array([[1.0, math.inf], [math.nan, -2.5], [-math.inf, 0.1]]))
NAN_WITH_PAYLOAD = np.array([0xFFF8000000000123], dtype=np.uint64).view(np.float64)


def same(one: object, other: object) -> bool:
    """Compare to the bit of a sign, NaN being equal to itself."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.shape == other.shape and repr(one.tolist()) == repr(other.tolist())
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return type(one) is type(other) and repr(one) == repr(other)


def finished(blocks: Iterable[Block]) -> Finished:
    log = Log(CONDITION, CONFIG, 7, np.random.default_rng(5))
    for block in blocks:
        log.write(block)
    return log.finish(SUMMARY)


def test_round_trip(tmp_path: Path) -> None:
    given, path = generations(10), tmp_path / "0007.mcap"
    written = write(
        given, fronts=[FRONT, FrontRow(6, 0, np.empty((0, 3)))], first_feasible_generation=3
    )
    path.write_bytes(written.content)
    log = read_log(path)
    assert (log.condition_id, log.config_json, log.replicate) == (CONDITION, CONFIG, 7)
    assert (log.attachments, log.environment) == ({"map.txt": b"\x00\xff"}, ENVIRONMENT)
    assert same(log.summary, written.summary) and same(read_summary(path), written.summary)
    expected = SUMMARY._replace(first_feasible_generation=3, digest=log.summary.digest)
    assert same(log.summary, expected) and len(bytes.fromhex(log.summary.digest)) == 16
    for row, generation in zip(log.generations, given, strict=True):
        names = [name for name in GenerationRow._fields if name != "chain"]
        assert same(tuple(row)[:-1], tuple(getattr(generation, name) for name in names))
    assert len({bytes.fromhex(row.chain) for row in log.generations}) == len(given)
    assert same(log.fronts[0], FRONT) and log.fronts[1].criteria.shape == (0, 3)


@pytest.mark.parametrize("changes", [{}, {"best": np.full(12, math.nan)}, {"best_cost": 1e6}])
def test_solutions_are_the_first_each_strictly_better_and_the_last_one(
    changes: dict[str, Any],
) -> None:
    given = generations(30)
    given[-1] = given[-1]._replace(**changes)
    content = write(given).content
    solutions, costs = read_log(content).solutions, [each.best_cost for each in given]
    improved = [k for k, cost in enumerate(costs) if k == 0 or cost < min(costs[:k])]
    assert [row.generation for row in solutions] == improved + [29] * bool(changes)
    assert all(same(row.values, given[row.generation].best) for row in solutions)
    assert [row.cost for row in solutions] == [costs[row.generation] for row in solutions]
    assert same(read_solution(content), solutions[-1])


def test_generation_columns_agree_with_read_log() -> None:
    given = generations(40)
    given[20] = given[20]._replace(terms={"length": 1.0, "late": 2.0})
    content = write(given).content
    columns, rows = generation_columns(content), read_log(content).generations
    names = set(GenerationRow._fields) - {"terms", "chain"}
    expected: dict[str, list[Any]] = {n: [getattr(row, n) for row in rows] for n in names}
    for name in ("late", "length", "clearance", "torque"):
        expected[f"term_{name}"] = [row.terms.get(name, math.nan) for row in rows]
    assert columns.keys() >= expected.keys()
    assert not [n for n in columns.keys() - expected.keys() if n.startswith("term_")]
    for name, values in expected.items():
        assert repr(columns[name].tolist()) == repr(values), name


def test_neither_the_order_of_terms_nor_any_time_enters_a_digest() -> None:
    seconds = [0.25 * index for index in range(150)]  # more than are encoded together
    plain = write(generations(150))
    other = write(generations(150, reverse_terms=True), **dict.fromkeys(TIMES, 12345.6789))
    timed = write(generations(150), seconds=seconds)
    assert write(generations(150, reverse_terms=True)).content == plain.content
    one = read_log(plain.content)
    for each in (other, timed):
        log = read_log(each.content)
        assert (log.content_digest, log.summary.digest) == (one.content_digest, one.summary.digest)
        assert [row.chain for row in log.generations] == [row.chain for row in one.generations]
        assert each.content != plain.content
        assert masked_log(each.content) == masked_log(plain.content)
    assert read_log(timed.content).cpu_s.tolist() == pytest.approx(seconds, abs=1e-9)
    for _, channel, message in make_reader(BytesIO(timed.content)).iter_messages():
        row = orjson.loads(message.data)
        index = row["index"] if channel.topic == "/generation" else row["generation"]
        assert message.publish_time == index * 250_000_000
    nudged = write(generations(150), clearance_at=math.nextafter(2.5, math.inf))
    assert masked_log(nudged.content) != masked_log(plain.content), "a mask hides times alone"


def test_other_readers_of_mcap_find_their_way() -> None:
    reader = make_reader(BytesIO(write(generations(400), fronts=[FRONT]).content), [], True)
    assert reader.get_header().library == "evoexp"
    index = reader.get_summary()
    assert index is not None and len(index.chunk_indexes) > 1
    assert max(chunk.uncompressed_size for chunk in index.chunk_indexes) <= 64 * 1024
    assert {chunk.compression for chunk in index.chunk_indexes} == {"zstd"}
    topics = {channel.topic for channel in index.channels.values()}
    assert topics == {"/generation", "/solution", "/front"}
    for schema, channel, message in reader.iter_messages():
        assert schema is not None and schema.encoding == "jsonschema"
        assert schema.name == f"evoexp.{channel.topic[1:].title()}"
        row = orjson.loads(message.data)
        row.pop("nonfinite", None)
        assert set(row) == set(orjson.loads(schema.data)["properties"])
    rows = [message for *_, message in reader.iter_messages(topics="/generation")]
    assert [(row.log_time, row.sequence) for row in rows] == [(k * 10**9, k) for k in range(400)]
    flags = [orjson.loads(row.data).get("nonfinite") for row in rows]
    assert [k for k, flag in enumerate(flags) if flag] == [0, 1, 2], "only where it is needed"
    expected = {"term_torque": "nan", "best_cost": "inf", "term_clearance": "-inf"}
    assert expected.items() <= flags[1].items()


# The chain


def test_the_chain_is_the_documented_hash_and_refuses_other_generators() -> None:
    rng, link, links = np.random.default_rng(3), b"", []
    log = Log(CONDITION, CONFIG, 7, rng)
    for each in generations(4):
        log.write(Block.of(each))
        content = each.costs.tobytes() + each.best.tobytes() + state_bytes(rng.bit_generator)
        link = xxhash.xxh3_128(link + content).digest()
        links.append(link.hex())
        rng.random()
    read = read_log(log.finish(SUMMARY).content)
    assert [row.chain for row in read.generations] == links
    assert read.summary.digest == xxhash.xxh3_128_hexdigest(link + each.population.tobytes())
    with pytest.raises(TypeError, match="PCG64.*MT19937"):
        Log(CONDITION, CONFIG, 7, np.random.Generator(np.random.MT19937(0)))


def test_bytes_of_arrays_are_those_of_their_numbers() -> None:
    """Every NaN is one, zeros keep their sign, layout and type do not matter."""
    for bits in (0x7FF8000000000000, 0xFFF8000000000001, 0x7FF0000000000123):
        nan = np.array([bits], dtype=np.uint64).view(np.float64)
        expected = np.array([0x7FF8000000000000], dtype=np.uint64).tobytes()
        assert array_bytes(np.array([np.inf, nan[0]])) == np.array([np.inf]).tobytes() + expected
    assert array_bytes(np.array([-0.0])) != array_bytes(np.array([0.0]))
    matrix = np.arange(12.0).reshape(3, 4)
    for other in (matrix, np.asfortranarray(matrix), matrix.astype(np.float32)):
        assert array_bytes(other) == matrix.tobytes()
    assert array_bytes(np.array([1, 2], dtype=np.int16)) == np.array([1, 2]).tobytes()
    assert array_bytes(np.empty(0)) == b""


# Blocks


def in_blocks(written: Sequence[Generation], most: int) -> list[Block]:
    """Return the same generations, so many together."""
    blocks = []
    for begin in range(0, len(written), most):
        own = [Block.of(each) for each in written[begin : begin + most]]
        columns = [[value for each in own for value in each[k]] for k in range(2, 8)]
        bests = [each.bests[0]._replace(place=k) for k, each in enumerate(own)]
        costs = np.concatenate([each.costs for each in own])
        population = lambda place, own=own: own[place].population(0)  # noqa: E731
        blocks.append(Block(own[0].first, bests, *columns, costs=costs, population=population))
    return blocks


@pytest.mark.parametrize("most", [2, 7, 64, 400])
@pytest.mark.parametrize("name", ["length", "},{", "null", 'x":1},{"y', "β", "{", "}"])
def test_blocks_give_the_log_of_their_generations(most: int, name: str) -> None:
    """Names of terms may look like JSON; numbers or costs may not be finite, or NaN of any kind."""
    written = [
        each._replace(terms={**each.terms, name: float(each.index)}) for each in generations(150)
    ]
    written[20].costs[3:4] = NAN_WITH_PAYLOAD
    for given in (written, written[4:]):  # of those every number is finite
        expected = finished(map(Block.of, given)).content
        assert finished(in_blocks(given, most)).content == expected
        rows = read_log(expected).generations
        assert [row.terms[name] for row in rows] == [float(each.index) for each in given]


# Damaged logs


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
