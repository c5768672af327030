"""What is written comes back as it was, and the same content gives the same digests."""

import math
from io import BytesIO
from pathlib import Path

import numpy as np
import orjson
import pytest
from mcap.reader import make_reader
from store_samples import (
    CONDITION,
    CONFIG,
    ENVIRONMENT,
    generations,
    in_blocks,
    summary,
    write,
)

from evoexp.records import Block, FrontRow, GenerationRow
from evoexp.store.digests import Chain, array_bytes
from evoexp.store.log import Log
from evoexp.store.log_reader import generation_columns, read_log, read_solution, read_summary

FRONT = FrontRow(4, 0, np.array([[1.0, math.inf], [math.nan, -2.5], [-math.inf, 0.1]]))


def same(one: object, other: object) -> bool:
    """Compare to the bit of a sign, NaN being equal to itself."""
    if isinstance(one, float) and isinstance(other, float):
        return repr(one) == repr(other)
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.shape == other.shape and same(
            tuple(one.ravel().tolist()), tuple(other.ravel().tolist())
        )
    return type(one) is type(other) and one == other


def test_round_trip(tmp_path: Path) -> None:
    given = generations(10)
    finished = write(given, fronts=[FRONT, FrontRow(6, 0, np.empty((0, 3)))])
    path = tmp_path / "0007.mcap"
    path.write_bytes(finished.content)
    contents = read_log(path)
    assert (contents.condition_id, contents.config_json, contents.replicate) == (
        CONDITION,
        CONFIG,
        7,
    )
    assert (contents.attachments, contents.environment) == ({"map.txt": b"\x00\xff"}, ENVIRONMENT)
    assert same(contents.summary, finished.summary)
    assert len(contents.generations) == len(given)
    for row, generation in zip(contents.generations, given, strict=True):
        expected = [getattr(generation, name) for name in GenerationRow._fields if name != "chain"]
        assert same(tuple(row)[:-1], tuple(expected))
        assert len(bytes.fromhex(row.chain)) == 16
    assert len({row.chain for row in contents.generations}) == len(given)
    assert same(contents.fronts[0], FRONT) and contents.fronts[1].criteria.shape == (0, 3)


def test_summary_is_completed_with_the_digest() -> None:
    finished = write(generations(10), first_feasible_generation=3)
    assert same(finished.summary._replace(digest=""), summary(first_feasible_generation=3))
    assert len(bytes.fromhex(finished.summary.digest)) == 16
    assert same(read_summary(finished.content), finished.summary)


def test_a_solution_is_written_for_the_first_and_each_strictly_better_one() -> None:
    given = generations(30)
    solutions = read_log(write(given).content).solutions
    costs = [generation.best_cost for generation in given]
    improved = [
        index for index, cost in enumerate(costs) if index == 0 or cost < min(costs[:index])
    ]
    assert [row.generation for row in solutions] == improved
    assert all(same(row.values, given[row.generation].best) for row in solutions)
    assert [row.cost for row in solutions] == [costs[index] for index in improved]


@pytest.mark.parametrize("changes", [{"best": np.full(12, math.nan)}, {"best_cost": 1e6}])
def test_the_last_solution_is_written_even_where_it_is_no_better(
    changes: dict[str, object],
) -> None:
    given = generations(10)
    given[-1] = given[-1]._replace(**changes)  # type: ignore[arg-type]
    finished = write(given)
    last = read_solution(finished.content)
    assert (
        last.generation == 9
        and last.cost == given[-1].best_cost
        and same(last.values, given[-1].best)
    )
    assert same(last, read_log(finished.content).solutions[-1])


def test_generation_columns_agree_with_read_log() -> None:
    given = generations(40)
    given[20] = given[20]._replace(terms={"length": 1.0, "late": 2.0})
    content = write(given).content
    columns, rows = generation_columns(content), read_log(content).generations
    assert sorted(name for name in columns if name.startswith("term_")) == [
        "term_clearance",
        "term_late",
        "term_length",
        "term_torque",
    ]
    for name in set(GenerationRow._fields) - {"terms", "chain"}:
        assert same(tuple(columns[name].tolist()), tuple(getattr(row, name) for row in rows)), name
    for name in ("late", "length", "clearance", "torque"):
        expected = tuple(row.terms.get(name, math.nan) for row in rows)
        assert same(tuple(columns[f"term_{name}"].tolist()), expected)


def test_same_content_same_digests_whatever_the_order_of_terms_and_the_clock() -> None:
    one = read_log(write(generations(12)).content)
    other = read_log(write(generations(12, reverse_terms=True), cpu_s=9.0, wall_s=9.0).content)
    assert one.content_digest == other.content_digest
    assert one.summary.digest == other.summary.digest
    assert [row.chain for row in one.generations] == [row.chain for row in other.generations]


def test_cpu_times_are_publish_times_and_enter_no_digest() -> None:
    seconds = [0.25 * index for index in range(150)]  # more than are encoded together
    plain, timed = write(generations(150)), write(generations(150), seconds=seconds)
    one, other = read_log(plain.content), read_log(timed.content)
    assert other.cpu_s.tolist() == pytest.approx(seconds, abs=1e-9)
    assert one.content_digest == other.content_digest
    assert one.summary.digest == other.summary.digest
    reader = make_reader(BytesIO(timed.content))
    for _, channel, message in reader.iter_messages(topics=["/generation", "/solution"]):
        row = orjson.loads(message.data)
        index = row["index"] if channel.topic == "/generation" else row["generation"]
        assert message.publish_time == index * 250_000_000


def test_same_content_same_bytes() -> None:
    assert write(generations(12)).content == write(generations(12, reverse_terms=True)).content


def test_a_hidden_difference_shows_in_the_chain_from_its_generation_on() -> None:
    changed = generations(12)
    costs = changed[5].costs.copy()
    costs[3] = np.nextafter(costs[3], 2.0)
    changed[5] = changed[5]._replace(costs=costs)
    one, other = read_log(write(generations(12)).content), read_log(write(changed).content)
    equal = [a.chain == b.chain for a, b in zip(one.generations, other.generations, strict=True)]
    assert equal == [True] * 5 + [False] * 7
    assert one.summary.digest != other.summary.digest


def test_the_last_population_enters_the_digest_alone() -> None:
    changed = generations(12)
    changed[-1] = changed[-1]._replace(population=changed[-1].population + 1.0)
    one, other = read_log(write(generations(12)).content), read_log(write(changed).content)
    assert one.content_digest == other.content_digest
    assert one.summary.digest != other.summary.digest


def test_other_readers_of_mcap_find_their_way() -> None:
    given = generations(400)
    reader = make_reader(BytesIO(write(given, fronts=[FRONT]).content), validate_crcs=True)
    assert reader.get_header().library == "evoexp"
    index = reader.get_summary()
    assert index is not None and len(index.chunk_indexes) > 1
    assert max(chunk.uncompressed_size for chunk in index.chunk_indexes) <= 64 * 1024
    assert {chunk.compression for chunk in index.chunk_indexes} == {"zstd"}
    names = {
        index.schemas[channel.schema_id].name: channel.topic for channel in index.channels.values()
    }
    assert names == {
        "evoexp.Generation": "/generation",
        "evoexp.Solution": "/solution",
        "evoexp.Front": "/front",
    }
    for schema, _, message in reader.iter_messages():
        assert schema is not None and schema.encoding == "jsonschema"
        row = orjson.loads(message.data)
        row.pop("nonfinite", None)
        assert set(row) == set(orjson.loads(schema.data)["properties"])
    ticks = [message.log_time for _, _, message in reader.iter_messages(topics="/generation")]
    assert ticks == [index * 10**9 for index in range(400)]
    assert [m.sequence for _, _, m in reader.iter_messages(topics="/generation")] == list(
        range(400)
    )


def test_nonfinite_is_there_only_when_needed() -> None:
    reader = make_reader(BytesIO(write(generations(10)).content))
    rows = [
        orjson.loads(message.data) for _, _, message in reader.iter_messages(topics="/generation")
    ]
    assert [index for index, row in enumerate(rows) if "nonfinite" in row] == [0, 1, 2]
    assert rows[1]["nonfinite"]["term_torque"] == "nan" and rows[1]["term_torque"] is None
    assert (
        rows[1]["nonfinite"]["best_cost"] == "inf"
        and rows[1]["nonfinite"]["term_clearance"] == "-inf"
    )


def test_links_are_those_of_costs_one_by_one() -> None:
    """Costs are searched for NaN many generations at a time.

    A NaN counts as one whatever its bits; whole numbers may look like one.
    """
    other_nan = np.frombuffer(bytes.fromhex("010000000000f8ff"))
    given, expected, rng = generations(150), [], np.random.default_rng(0)
    for k in (3, 70, 149):
        costs = given[k].costs.copy()
        costs[2] = other_nan[0]
        given[k] = given[k]._replace(costs=costs)
    given[80] = given[80]._replace(costs=np.array([-1, 3]))
    given[81] = given[81]._replace(costs=np.array([math.nan, 1.0], dtype=np.float32))
    log, chain = Log(CONDITION, CONFIG, 7, rng), Chain(rng)
    for generation in given:
        log.write(Block.of(generation))
        costs, best = array_bytes(generation.costs), array_bytes(generation.best)
        expected.append(chain.extend(costs, best, chain.state()))
        rng.random(3)
    found = read_log(log.finish(summary()).content).generations
    assert [row.chain for row in found] == expected


@pytest.mark.parametrize("name", ["},{", "null", 'x":1},{"y', "{", "}"])
def test_names_of_terms_may_look_like_json(name: str) -> None:
    given = [
        each._replace(terms={**each.terms, name: float(k)})
        for k, each in enumerate(generations(70))
    ]
    rows = read_log(write(given).content).generations
    assert [row.terms[name] for row in rows] == [float(k) for k in range(70)]


@pytest.mark.parametrize("most", [1, 2, 7, 64, 400])
@pytest.mark.parametrize("name", ["length", "},{", "null", 'x":1},{"y', "β"])
def test_blocks_give_the_log_of_their_generations(most: int, name: str) -> None:
    """Among them generations whose numbers or costs are not finite, or NaN with a payload."""
    written = [
        each._replace(terms={**each.terms, name: float(each.index)}) for each in generations(150)
    ]
    payload = np.frombuffer(np.array([0xFFF8000000000123], dtype=np.uint64).tobytes())
    written[20].costs[3:4] = payload
    whole = written[4:]  # every number is finite
    for given in (written, whole):
        logs = [Log(CONDITION, CONFIG, 7, np.random.default_rng(5)) for _ in range(2)]
        for each in given:
            logs[0].write(Block.of(each))
        for block in in_blocks(given, most):
            logs[1].write(block)
        one, other = (log.finish(summary()) for log in logs)
        assert one.content == other.content


@pytest.mark.parametrize("kind", [np.float32, np.int32, np.int64])
def test_costs_of_other_types_are_the_same_in_blocks(kind: type) -> None:
    written = [
        each._replace(costs=np.arange(20).astype(kind) + kind(each.index))
        for each in generations(30)
    ]
    log, expected = (Log(CONDITION, CONFIG, 7, np.random.default_rng(5)) for _ in range(2))
    for each in written:
        expected.write(Block.of(each))
    for block in in_blocks(written, 9):
        log.write(block)
    assert log.finish(summary()).summary.digest == expected.finish(summary()).summary.digest
