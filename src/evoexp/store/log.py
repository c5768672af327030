"""One replicate as one self-contained MCAP, written in memory, its records as JSON.

A chain of digests tells from which generation on two runs differ. Records are flat, with a fixed
order of keys. A non-finite number, for which JSON has no word, is written as null and named in
`nonfinite`, a key that is there only when needed: `{"best_cost": "inf"}` for a field,
`{"values": {"3": "nan"}}` for an element of an array.
"""

import io
import struct
from collections import Counter
from collections.abc import Mapping
from functools import cache
from math import isfinite
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import orjson
import xxhash
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray

from evoexp import records
from evoexp.errors import EvoexpError
from evoexp.input_files import MEGABYTE
from evoexp.numeric.generator_state import state_bytes
from evoexp.records import Best, Block, FrontRow, GenerationRow, ReplicateSummary, SolutionRow

LIBRARY = "evoexp"  # pinned, so that a log's bytes do not tell mcap's version
# of everything a log holds; raised when a reader of the old version would misunderstand
SCHEMA_VERSION = 2
RUN = "evoexp.run"
SUMMARY = "evoexp.summary"
ENVIRONMENT = "evoexp.environment"
CONFIG = "config.json"
ARRAY = ".npy"  # the ending of an attached array's name
CONTENT_DIGEST = "content_digest"
PUBLISHED, CPU_TIME = "publish_time", "cpu"  # the entry of `RUN` that tells publish times
GENERATION_TOPIC, SOLUTION_TOPIC, FRONT_TOPIC = "/generation", "/solution", "/front"

# Of a log's file, and of all its messages together. The largest log of a shipped experiment holds
# 2.5 MB of messages; 128 MB are some 350,000 generations without a better solution.
MAX_LOG = 128 * MEGABYTE
_CHUNK_SIZE = 56 * 1024  # [B] a chunk ends with the message that passes this, hence within 64 KiB
_TICK = 1_000_000_000  # [ns] the synthetic clock: one second per generation
_MESSAGE = struct.Struct("<QIQ")  # log_time, sequence, bytes of data
TERM = "term_"
NONFINITE = "nonfinite"


class LogTooLarge(EvoexpError):
    """A replicate whose log no reader would take."""


class Finished(NamedTuple):
    """A finished log and the summary that it holds."""

    content: bytes
    summary: ReplicateSummary


def array_file(array: NDArray[Any]) -> bytes:
    """Return an array as the bytes of a `.npy` file: C order, float64 or int64, little-endian."""
    buffer, kind = io.BytesIO(), "<f8" if array.dtype.kind == "f" else "<i8"
    np.save(buffer, np.ascontiguousarray(array, dtype=kind), allow_pickle=False)
    return buffer.getvalue()


class Log:
    """The log of one replicate: written block by block, finished into bytes.

    Every generation extends a chain: link_g = xxh3_128(link_{g-1} ‖ costs ‖ best ‖ state of the
    generator), the first before it being empty; the replicate's digest is that of the last link and
    the population. Times and the environment enter neither messages nor chain nor digests.
    """

    def __init__(
        self,
        condition_id: str,
        config_json: bytes,
        replicate: int,
        rng: "np.random.Generator",
        attachments: Mapping[str, bytes] | None = None,
        environment: Mapping[str, Any] | None = None,
    ) -> None:
        """Start a log.

        Args:
            rng: The replicate's generator, whose state enters the chain; never drawn from here.
                TypeError is raised where it is no PCG64.
            attachments: Further files that the condition needs, by name.
            environment: Versions, CPU features and what else may explain a difference.
        """
        self._environment = dict(environment or {})
        self._bits, self._link = rng.bit_generator, b""  # the last link of the chain
        state_bytes(self._bits)  # raises where it is another generator
        self._content = xxhash.xxh3_128()
        self._channels: dict[str, tuple[int, str]] = {}  # id and name of schema, by topic
        self._num_messages = Counter[str]()  # by topic
        self._last = -1  # index of the last generation
        self._population: NDArray[Any] = np.empty(0)  # of it, a view of the planner's memory
        # of the last generation, and of the last solution written: `array_bytes` of the best
        self._best = self._written = b""
        self._best_cost, self._written_cost = np.inf, np.inf
        self._cpu_ns = 0  # of the replicate, when the last generation was there
        self._size = 0  # [B] of all messages
        self._buffer = io.BytesIO()
        self._writer = Writer(
            self._buffer,
            chunk_size=_CHUNK_SIZE,
            compression=CompressionType.ZSTD,
            use_summary_offsets=False,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self._writer.start(library=LIBRARY)
        run = {"condition": condition_id, "replicate": str(replicate)}
        run |= {"schema_version": str(SCHEMA_VERSION), PUBLISHED: CPU_TIME}
        self._writer.add_metadata(RUN, run)
        self._attach(CONFIG, config_json)
        for name, data in sorted((attachments or {}).items()):
            self._attach(name, data)

    def write(self, block: Block, cpu_s: float = 0.0) -> None:
        """Append generations, and every best solution that is better than the last written.

        The CPU time of the replicate until then [s] is the publish time of the messages.
        """
        self._cpu_ns = int(cpu_s * 1e9)
        state = state_bytes(self._bits) if block.states is None else b""
        solution: Best | None = None
        for k, best in enumerate(block.best_of_each):
            if best is not solution:
                solution, self._best_cost = best, best.cost
                self._best = array_bytes(np.asarray(best.solution, np.float64))
            costs = array_bytes(block.costs[k])
            own_state = block.states[k] if block.states else state
            parts = self._link, costs, self._best, own_state
            self._link = xxhash.xxh3_128_digest(b"".join(parts))
            counted = [getattr(block, column)[k] for column in records.COLUMNS]
            found = best.solved, best.terms, self._link.hex()
            row = GenerationRow._make((block.first + k, best.cost, *counted, *found))
            data, is_first = encode_generation(row), not self._channels
            self._add(GENERATION_TOPIC, GenerationRow, row.index, data, tuple(row.terms))
            if is_first or self._best_cost < self._written_cost:
                self._write_solution(row.index)
            self._last = row.index
        self._population = block.population(block.num_generations - 1)
        for name, array in sorted((block.arrays or {}).items()):
            self._attach(name + ARRAY, array_file(array))
        if block.criteria is not None:
            for population, criteria in enumerate(block.criteria):
                # a matrix travels flat, beside the number of its columns
                flat = np.ascontiguousarray(criteria.T, dtype=np.float64).reshape(-1)
                front = {"generation": self._last, "population": population}
                data = encode(front | {"criteria": flat, "num_criteria": len(criteria)})
                self._add(FRONT_TOPIC, FrontRow, self._last, data)

    def finish(self, summary: ReplicateSummary) -> Finished:
        """Close the log; return its bytes and the summary, which gets its digest."""
        if self._best != self._written or self._best_cost != self._written_cost:
            self._write_solution(self._last)
        digest = xxhash.xxh3_128_hexdigest(self._link + array_bytes(self._population))
        summary = summary._replace(digest=digest)
        self._writer.add_metadata(ENVIRONMENT, encode_values(self._environment))
        content = encode_values({CONTENT_DIGEST: self._content.hexdigest()})
        row = records.flatten(summary._replace(terms=dict(sorted(summary.terms.items()))))
        self._writer.add_metadata(SUMMARY, encode_values(flagged(row)) | content)
        self._writer.finish()
        return Finished(self._buffer.getvalue(), summary)

    def _write_solution(self, index: int) -> None:
        self._written, self._written_cost = self._best, self._best_cost
        row = SolutionRow(int(index), float(self._best_cost), np.frombuffer(self._best))
        self._add(SOLUTION_TOPIC, SolutionRow, index, encode(row._asdict()))

    def _attach(self, name: str, data: bytes) -> None:
        kind = "application/json" if name.endswith(".json") else "application/octet-stream"
        self._writer.add_attachment(0, 0, name, kind, data)

    def _add(
        self, topic: str, record: type, generation: int, data: bytes, terms: tuple[str, ...] = ()
    ) -> None:
        self._size += len(data)
        if self._size > MAX_LOG:
            raise LogTooLarge(
                f"log: its generations and solutions take more than {MAX_LOG // MEGABYTE} MB, "
                "more than any log that is read; run fewer generations"
            )
        if topic not in self._channels:
            name = f"evoexp.{record.__name__.removesuffix('Row')}"
            schema = self._writer.register_schema(name, "jsonschema", json_schema(record, terms))
            self._channels[topic] = self._writer.register_channel(topic, "json", schema), name
        (channel, name), sequence = self._channels[topic], self._num_messages[topic]
        self._num_messages[topic] += 1
        log_time = int(generation) * _TICK
        self._writer.add_message(channel, log_time, data, self._cpu_ns, sequence)
        self._content.update(message_bytes((topic, name, "json"), log_time, sequence, data))


def array_bytes(array: NDArray[Any]) -> bytes:
    """Return an array's values as bytes: C order, float64 or int64, little-endian.

    Every NaN becomes the one positive quiet NaN, because neither IEEE 754 nor LLVM says which
    payload an operation yields. The sign of a zero is specified, so -0.0 stays distinct from 0.0.
    """
    if array.dtype.char != "d":
        array = array.astype(np.float64 if array.dtype.kind == "f" else np.int64)
    # argmin finds the first NaN, if there is one, five times faster than np.isnan(...).any().
    if array.size and array.dtype.char == "d" and (least := array.item(array.argmin())) != least:
        array = np.where(np.isnan(array), np.nan, array)
    return array.tobytes()


def message_bytes(
    channel: tuple[str, str, str], log_time: int, sequence: int, data: bytes
) -> bytes:
    """Return a message as the content digest takes it: its channel, time, sequence and data.

    The channel is told by topic, schema's name, and message encoding; the digest is xxh3-128.
    """
    head = "\0".join((*channel, "")).encode()
    return head + _MESSAGE.pack(log_time, sequence, len(data)) + data


_JSON_TYPES: dict[Any, dict[str, Any]] = {
    int: {"type": "integer"},
    float: {"type": "number"},
    bool: {"type": "boolean"},
    str: {"type": "string"},
    records.FloatArray: {"type": "array", "items": {"type": "number"}},
}


@cache
def field_types(record: type) -> dict[str, Any]:
    """Return a record's fields and their types in order; `terms` become a field each."""
    return {name: kind for name, kind in get_type_hints(record).items() if name != "terms"}


@cache
def json_schema(record: type, terms: tuple[str, ...] = ()) -> bytes:
    """Return the JSON Schema of a record's messages, one type per field, as Foxglove reads it.

    Any number may be null, which JSON Schema could only say with a union type.
    """
    properties = {name: _JSON_TYPES[kind] for name, kind in field_types(record).items()}
    if record is FrontRow:  # a matrix travels flat
        properties["num_criteria"] = _JSON_TYPES[int]
    properties.update({TERM + name: _JSON_TYPES[float] for name in sorted(terms)})
    title = f"evoexp.{record.__name__.removesuffix('Row')}"
    return orjson.dumps({"title": title, "type": "object", "properties": properties})


def encode_generation(row: GenerationRow) -> bytes:
    """Return the message of one generation; its terms stand in alphabetical order."""
    values = {name: kind(getattr(row, name)) for name, kind in field_types(GenerationRow).items()}
    chain = values.pop("chain")
    terms = {TERM + name: float(row.terms[name]) for name in sorted(row.terms)}
    return encode({**values, **terms, "chain": chain})


def encode_values(values: Mapping[str, Any]) -> dict[str, str]:
    """Return a mapping as metadata: every value one JSON text."""
    options = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_SORT_KEYS
    return {name: orjson.dumps(value, option=options).decode() for name, value in values.items()}


def encode(row: dict[str, Any]) -> bytes:
    """Return a message; numbers are Python's, arrays flat."""
    text = orjson.dumps(row, option=orjson.OPT_SERIALIZE_NUMPY)
    if b"null" in text:  # a number is not finite
        return orjson.dumps(flagged(row), option=orjson.OPT_SERIALIZE_NUMPY)
    return text


def flagged(row: dict[str, Any]) -> dict[str, Any]:
    """Return the row with `nonfinite` appended where a number of it needs the flag."""
    flags: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, np.ndarray):
            places = np.flatnonzero(~np.isfinite(value))
            if places.size:
                flags[name] = {str(place): repr(float(value[place])) for place in places.tolist()}
        elif isinstance(value, float) and not isfinite(value):
            flags[name] = repr(float(value))
    return {**row, NONFINITE: flags} if flags else row
