"""One replicate as one self-contained MCAP, written in memory."""

import io
from collections.abc import Iterable, Mapping, Sequence
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.errors import EvoexpError
from evoexp.input_files import MEGABYTE
from evoexp.records import (
    Block,
    FrontRow,
    GenerationRow,
    ReplicateSummary,
    SolutionRow,
)
from evoexp.store.container import MAX_LOG
from evoexp.store.container_writer import ContainerWriter, Messages
from evoexp.store.digests import Chain, ContentDigest, array_bytes, channel_identity
from evoexp.store.generation_texts import encode_block
from evoexp.store.messages import (
    TERM,
    encode_front,
    encode_solution,
    encode_summary,
    encode_values,
    json_schema,
)

LIBRARY = "evoexp"  # pinned, so that a log's bytes do not tell mcap's version
SCHEMA_VERSION = (
    2  # of everything a log holds; raised when a reader of the old version would misunderstand
)
RUN = "evoexp.run"
SUMMARY = "evoexp.summary"
ENVIRONMENT = "evoexp.environment"
CONFIG = "config.json"
ARRAY = ".npy"  # the ending of an attached array's name
CONTENT_DIGEST = "content_digest"
PUBLISHED, CPU_TIME = "publish_time", "cpu"  # the entry of `RUN` that tells publish times
GENERATION_TOPIC, SOLUTION_TOPIC, FRONT_TOPIC = "/generation", "/solution", "/front"

_CHUNK_SIZE = 56 * 1024  # [B] a chunk ends with the message that passes this, hence within 64 KiB
_TICK = 1_000_000_000  # [ns] the synthetic clock: one second per generation


class LogTooLarge(EvoexpError):
    """A replicate whose log no reader would take."""


class Finished(NamedTuple):
    """A finished log and the summary that it holds."""

    content: bytes
    summary: ReplicateSummary


def array_file(array: NDArray[Any]) -> bytes:
    """Return an array as the bytes of a `.npy` file: C order, float64 or int64, little-endian."""
    kind = "<f8" if array.dtype.kind == "f" else "<i8"
    buffer = io.BytesIO()
    np.lib.format.write_array(
        buffer, np.ascontiguousarray(array, dtype=kind), version=(1, 0), allow_pickle=False
    )
    return buffer.getvalue()


class _Channel:
    """A channel of the log: its id, its part in the content digest, its number of messages."""

    def __init__(
        self, writer: ContainerWriter, topic: str, record: type, terms: tuple[str, ...] = ()
    ) -> None:
        name = f"evoexp.{record.__name__.removesuffix('Row')}"
        schema_id = writer.add_schema(name, "jsonschema", json_schema(record, terms))
        self.id = writer.add_channel(topic, "json", schema_id)
        self.identity = channel_identity(topic, name, "json")
        self.num_messages = 0


class Log:
    """The log of one replicate: written block by block, finished into bytes.

    The same content gives the same messages, chain and digests; wall and CPU times and the
    environment are metadata and enter none of them.
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
            condition_id: Full hash of the condition, 64 hex digits.
            config_json: The condition's configuration, from which alone the replicate can be run
                again.
            replicate: Index of the replicate.
            rng: The replicate's generator, whose state enters the chain; never drawn from here.
            attachments: Further files that the condition needs, by name.
            environment: Versions, CPU features and what else may explain a difference; any JSON
                values.

        Raises:
            ValueError: An attachment called like the configuration.
        """
        self._condition_id = condition_id
        self._replicate = replicate
        self._environment = dict(environment or {})
        self._chain = Chain(rng)
        self._content = ContentDigest()
        self._channels: dict[str, _Channel] = {}
        self._terms: dict[str, str] = {}  # name → column, in the order of the columns
        self._last: int | None = None  # index of the generation written last
        self._population: NDArray[Any] = np.empty(0)  # of it, a view of the planner's memory
        self._best = self._written = (
            b""  # of the generation encoded last, and of the last solution written
        )
        self._best_cost, self._written_cost, self._size = np.inf, np.inf, 0  # [B] of messages
        self._messages = Messages([], [], [], [], [])  # that wait to be written
        self._cpu = 0  # [ns] of the replicate, when the generation encoded last was written
        self._writer = ContainerWriter(LIBRARY, _CHUNK_SIZE)
        run = {
            "condition": condition_id,
            "replicate": str(replicate),
            "schema_version": str(SCHEMA_VERSION),
            PUBLISHED: CPU_TIME,
        }
        self._writer.add_metadata(RUN, run)
        self._writer.add_attachment(CONFIG, config_json)
        for name, data in sorted((attachments or {}).items()):
            if name == CONFIG:
                raise ValueError(f"attachments: '{CONFIG}' is the configuration's own name")
            self._writer.add_attachment(name, data)

    def write(self, block: Block, cpu_s: float = 0.0) -> None:
        """Append generations, and every best solution that is better than the last written.

        Args:
            block: The generations; what the planner may change of them is copied or encoded here.
            cpu_s: CPU time of the replicate until then [s]: the publish time of the messages, no
                part of any digest.
        """
        count, bests = block.num_generations, block.bests
        if bests[0].terms.keys() != self._terms.keys():
            self._terms = {name: TERM + name for name in sorted(bests[0].terms)}
        solutions = {
            id(best): array_bytes(np.asarray(best.solution, dtype=np.float64)) for best in bests
        }
        of_each = [solutions[id(best)] for best in block.best_of_each]
        states = block.states or repeat(self._chain.state(), count)
        links = self._chain.extend(_rows_as_bytes(block.costs), of_each, states)
        indices, cpu = range(block.first, block.first + count), [int(cpu_s * 1e9)] * count
        places, best_costs = [best.place for best in bests], [best.cost for best in bests]
        data = encode_block(block, links)
        self._append(data, indices, cpu, places, [*solutions.values()], best_costs)
        self._last, self._population = indices[-1], block.population(count - 1)
        self._send()
        for name, array in sorted((block.arrays or {}).items()):
            self._writer.add_attachment(name + ARRAY, array_file(array))
        if block.criteria is not None:
            for population, criteria in enumerate(block.criteria):
                self.write_front(FrontRow(self._last, population, criteria.T))

    def _append(
        self,
        data: Sequence[bytes],
        indices: Sequence[int],
        cpu: Sequence[int],
        places: Iterable[int],
        solutions: Sequence[bytes],
        best_costs: Sequence[float],
    ) -> None:
        """Let the messages of generations wait, with each better solution behind its generation.

        Args:
            data: Of the generations, encoded.
            indices: Of the generations.
            cpu: Times of the replicate [ns].
            places: Of the generations whose best may be better than that before.
            solutions: `array_bytes` of the best, one for each of these places.
            best_costs: Likewise, their costs.
        """
        begin, count = 0, 0
        if not self._channels:  # each is registered with its first message
            self._add(GENERATION_TOPIC, GenerationRow, indices[:1], data[:1], cpu[:1])
            self._best, self._best_cost, self._cpu = solutions[0], best_costs[0], cpu[0]
            self._write_solution(indices[0])
            begin = 1
        messages = self._numbered(GENERATION_TOPIC, indices[begin:], data[begin:], cpu[begin:])
        for k, self._best, self._best_cost in zip(places, solutions, best_costs, strict=True):
            if self._best_cost < self._written_cost:
                solution = [self._encoded_solution(indices[k])]
                one = self._numbered(SOLUTION_TOPIC, indices[k : k + 1], solution, cpu[k : k + 1])
                count, at = count + 1, k - begin + 1 + count
                columns: Iterable[tuple[list[Any], list[Any]]] = zip(messages, one, strict=True)
                for column, value in columns:
                    column[at:at] = value
        self._cpu = cpu[-1]
        self._wait(messages)

    def _send(self) -> None:
        """Write the messages that wait."""
        self._size += sum(map(len, self._messages.data))
        if self._size > MAX_LOG:
            raise LogTooLarge(
                f"log: its generations and solutions take more than {MAX_LOG // MEGABYTE} MB, "
                "more than any log that is read; run fewer generations"
            )
        self._writer.add_messages(self._messages)
        identities = {channel.id: channel.identity for channel in self._channels.values()}
        channels = map(identities.__getitem__, self._messages.channels)
        self._content.update_all(channels, self._messages)
        self._messages = Messages([], [], [], [], [])

    def write_front(self, front: FrontRow) -> None:
        """Append the front of a population of the generation last written."""
        data = encode_front(front)
        self._add(FRONT_TOPIC, FrontRow, [front.generation], [data], [self._cpu])

    def finish(self, summary: ReplicateSummary) -> Finished:
        """Close the log.

        Args:
            summary: The replicate's row; its digest is filled in here.

        Returns:
            The log's bytes and the completed summary.

        Raises:
            ValueError: No generation was written, or the summary is of another replicate.
        """
        if self._last is None:
            raise ValueError("finish: no generation was written")
        if (summary.condition, summary.replicate) != (self._condition_id, self._replicate):
            raise ValueError(
                f"finish: summary of {summary.condition[:12]} replicate {summary.replicate}, not "
                "of this"
            )
        if self._best != self._written or self._best_cost != self._written_cost:
            self._write_solution(self._last)
        self._send()
        summary = summary._replace(digest=self._chain.finish(self._population))
        self._writer.add_metadata(ENVIRONMENT, encode_values(self._environment))
        content = encode_values({CONTENT_DIGEST: self._content.hexdigest()})
        self._writer.add_metadata(SUMMARY, encode_summary(summary) | content)
        return Finished(self._writer.finish(), summary)

    def _write_solution(self, index: int) -> None:
        self._add(
            SOLUTION_TOPIC, SolutionRow, [index], [self._encoded_solution(index)], [self._cpu]
        )

    def _encoded_solution(self, index: int) -> bytes:
        """Return the message of the best solution, which is then written."""
        self._written, self._written_cost = self._best, self._best_cost
        return encode_solution(index, self._best_cost, np.frombuffer(self._best))

    def _add(
        self,
        topic: str,
        record: type,
        generations: Sequence[int],
        data: Sequence[bytes],
        cpu: Sequence[int],
    ) -> None:
        """Let messages of one channel wait to be written.

        Args:
            topic: Of the channel.
            record: Whose messages it has.
            generations: Their indices.
            data: Encoded.
            cpu: Times of the replicate [ns].
        """
        if topic not in self._channels:  # registered with its first message: the terms are known
            self._send()  # the channel comes behind the messages before
            terms = tuple(self._terms) if record is GenerationRow else ()
            self._channels[topic] = _Channel(self._writer, topic, record, terms)
        self._wait(self._numbered(topic, generations, data, cpu))

    def _numbered(
        self, topic: str, generations: Sequence[int], data: Sequence[bytes], cpu: Sequence[int]
    ) -> Messages:
        """Return messages of a channel with their numbers; see `_add`."""
        channel = self._channels[topic]
        first, channel.num_messages = channel.num_messages, channel.num_messages + len(data)
        return Messages(
            [channel.id] * len(data),
            [*range(first, channel.num_messages)],
            [int(generation) * _TICK for generation in generations],
            [*cpu],
            [*data],
        )

    def _wait(self, messages: Messages) -> None:
        """Let messages wait to be written."""
        columns: Iterable[tuple[list[Any], list[Any]]] = zip(self._messages, messages, strict=True)
        for column, values in columns:
            column += values


def _rows_as_bytes(block: NDArray[Any]) -> Iterable[bytes]:
    """Return `array_bytes` of each row of a block of costs."""
    is_plain = block.dtype.char == "d" and block.size > 0
    if not is_plain or np.isnan(block.item(block.argmin())):  # argmin finds a NaN first
        return map(array_bytes, block)
    content = block.tobytes()
    size = len(content) // len(block)
    return [content[begin : begin + size] for begin in range(0, len(content), size)]
