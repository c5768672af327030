"""Runs stored replicates again and compares: MATCH, or the first generation that differs.

Two things are compared: the search, link by link of the chain, and everything else that a log
holds: summary, generations, solutions, fronts, attachments, content digest; all but times. In an
equal environment both must agree to the bit, elsewhere numbers to `TOLERANCE`; the answer says
which. Elsewhere a planner whose reproducibility is `environment` is compared by all its numbers
where bits differ.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.attachments import PREFIX, keep_all
from evoexp.batch.memory_limit import machine_memory, refuse_large
from evoexp.batch.replicate import EXACT_BOXES, run_replicate
from evoexp.condition import Condition
from evoexp.errors import CorruptLog, MissingDistribution
from evoexp.records import TIMES, GenerationRow, ReplicateSummary, flatten
from evoexp.registry import missing
from evoexp.store.digests import array_bytes
from evoexp.store.files import reason
from evoexp.store.log import ARRAY
from evoexp.store.log_reader import LogContents, decode_array, read_log
from evoexp.store.manifest import differences

TOLERANCE = 1e-9  # [-] by which numbers may differ: of their size, or absolutely if it is below 1
ELSEWHERE = "in another environment"
OLDER = "the log is older than exact boxes"
_CHAINED = ("digest", "chain")  # compared as the search
_CONFIG, _CONTENT = "configuration", "content digest"
# Rounding decides which of two equally close places is found, and in how many steps: where bits may
# differ, these are named and decide nothing.
_UNDECIDED = ("clearance_at", "clearance_pair", "penetration_pair", "certificate_queries")
_COST = "cost "  # begins a fingerprint that is no digest


_PLAIN = (str, int, float, type(None))  # values of which a difference is told
_LONGEST = 60  # characters of one


class FieldDifference(NamedTuple):
    """A field or a record in which a log differs from its re-execution."""

    name: str  # of the field, behind the record that it belongs to
    was: Any  # its stored value
    now: Any  # the value found again
    size: float  # of the difference [-], see `difference`; inf of what is no number

    @property
    def is_close(self) -> bool:
        """Whether it is a number that agrees to `TOLERANCE`, or decides nothing."""
        return self.size <= TOLERANCE or self.name in _UNDECIDED

    @property
    def is_count(self) -> bool:
        """Whether it counts steps, of which rounding decides how many lead to the same end."""
        ints = type(self.was) is int and type(self.now) is int
        return self.name.endswith("evaluations") or (ints and "num_feasible" not in self.name)

    def __str__(self) -> str:
        """Return the difference in words."""
        if math.isfinite(self.size):
            return f"{self.name} differs by {self.size:.1e}"
        if not all(isinstance(value, _PLAIN) for value in (self.was, self.now)):
            return f"{self.name} differs"
        return f"{self.name} was {_short(self.was)}, is {_short(self.now)}"


class Comparison(NamedTuple):
    """A stored replicate beside its re-execution."""

    condition_id: str  # 64 hex digits
    replicate: int  # its index
    diverged_at: int | None  # first generation whose link of the chain differs, None if none does
    digest_matches: bool  # whether the ends of both chains agree (they include the last population)
    num_generations: int  # generations compared, the initial one included
    environment: tuple[str, ...]  # differences between then and now, one line each
    # differences of everything but the chain, in the order of `field_differences`
    fields: tuple[FieldDifference, ...] = ()
    inexact: str = ""  # why these are compared to `TOLERANCE`; empty: to the bit
    # where numbers are compared instead of chains: the number that differs most, and by how much
    # [-]; None: chains are compared
    farthest: tuple[str, float] | None = None

    @property
    def search_matches(self) -> bool:
        """Whether every bit of the search agrees."""
        return self.diverged_at is None and self.digest_matches

    @property
    def matches(self) -> bool:
        """Whether every bit agrees, or every number to `TOLERANCE` where numbers are compared."""
        if self.farthest is not None:
            return self.farthest[1] <= TOLERANCE
        return self.search_matches and self._decisive is None

    @property
    def verdict(self) -> str:
        """MATCH, or where it diverges."""
        if self.farthest is not None:
            name, difference = self.farthest
            if self.matches:
                most = f"; at most {difference:.1e}, {name}" if difference else ""
                return f"MATCH to {TOLERANCE:g} ({self.inexact}{most})"
            return f"DIVERGES by {difference:.1e} in {name} ({self.inexact})"
        if not self.search_matches:
            at = "the last population" if self.diverged_at is None else None
            return f"DIVERGES in {at}" if at else f"DIVERGES at generation {self.diverged_at}"
        if not self.fields:
            return "MATCH"
        shown = self._decisive or self.fields[0]
        others = len(self.fields) - 1
        more = f", and {others} more field{'s' * (others > 1)}" if others else ""
        if self._decisive is None:
            rest = f"to {TOLERANCE:g} in the rest: {shown}{more}"
            return f"MATCH in the search, {rest} ({self.inexact})"
        why = f" ({self.inexact})" if self.inexact else ""
        return f"MATCH in the search; DIVERGES in the rest: {shown}{more}{why}"

    @property
    def _decisive(self) -> FieldDifference | None:
        """The first difference that is none of rounding."""
        found = (each for each in self.fields if not (self.inexact and each.is_close))
        return next(found, None)


class DamagedLog(NamedTuple):
    """A log in the place of a replicate that cannot be compared."""

    condition_id: str  # of the run, 64 hex digits
    replicate: int  # the place
    reason: str  # what is wrong with it, in one line


def reproduce_stored(path: Path, condition_id: str, replicate: int) -> Comparison | DamagedLog:
    """Run a replicate of a stored run again, as `reproduce_log` does.

    A log that is damaged, or of another replicate than its place says, is not compared.
    """
    try:
        stored = read_log(path)
        if (stored.condition_id, stored.replicate) != (condition_id, replicate):
            theirs = f"replicate {stored.replicate} of {stored.condition_id[:12]}"
            raise CorruptLog(f"{path}: holds {theirs}, which does not belong here")
        return _reproduce(path, stored)
    except CorruptLog as error:
        return DamagedLog(condition_id, replicate, reason(path, error))


def reproduce_log(path: Path) -> Comparison:
    """Run a log's replicate again, from the configuration attached to the log alone.

    Raises:
        CorruptLog: If the log cannot be trusted.
        RevisionMismatch: If a component has another revision in this installation.
        MissingDistribution: If the package of a component is not installed.
    """
    return _reproduce(path, read_log(path))


def stored_condition(path: Path, log: LogContents) -> Condition:
    """Return the condition of a log, built from the log alone; see `reproduce_log`."""
    if packages := missing(log.environment.get("components", {})):
        raise MissingDistribution(str(path), packages)
    keep_all(data for name, data in log.attachments.items() if name.startswith(PREFIX))
    condition = Condition.from_json(log.config_json)
    if condition.id != log.condition_id:
        raise CorruptLog(
            f"{path}: its configuration has hash {condition.id[:12]}, it claims "
            f"{log.condition_id[:12]}"
        )
    return condition


def _reproduce(path: Path, stored: LogContents) -> Comparison:
    condition = stored_condition(path, stored)
    refuse_large(condition, machine_memory())
    again = read_log(run_replicate(condition, stored.replicate).content)
    found = compare(stored, again)
    is_same = found.search_matches and not found.fields
    if condition.reproducibility == "bits" or is_same or not found.inexact:
        return found
    return found._replace(farthest=farthest(stored, again))


def compare(stored: LogContents, again: LogContents) -> Comparison:
    """Compare two logs of one replicate: link by link, and field by field."""
    environment = tuple(map(str, differences(stored.environment, again.environment)))
    is_older = EXACT_BOXES not in stored.environment
    found = Comparison(
        stored.condition_id,
        stored.replicate,
        first_divergence(stored.generations, again.generations),
        stored.summary.digest == again.summary.digest,
        len(stored.generations),
        environment,
        tuple(field_differences(stored, again)),
        ELSEWHERE if environment else OLDER if is_older else "",
    )
    digests = stored.content_digest, again.content_digest
    if found.search_matches and not found.fields and digests[0] != digests[1]:
        return found._replace(fields=(FieldDifference(_CONTENT, *digests, math.inf),))
    return found


def field_differences(stored: LogContents, again: LogContents) -> Iterator[FieldDifference]:
    """Yield the differences of all that two logs of one replicate hold, but for times and chain."""
    before, now = dict(_records(stored)), dict(_records(again))
    for name in dict.fromkeys([*before, *now]):
        if name in before and name in now:
            yield from differing(before[name], now[name], f"{name}: " if name else "")
        else:
            said = ("there", "missing") if name in before else ("missing", "there")
            yield FieldDifference(name, *said, math.inf)


def _records(log: LogContents) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield all records of a log by different names, the summary's being empty."""
    yield "", flatten(log.summary) | {_CONFIG: log.config_json}
    for generation in log.generations:
        yield f"generation {generation.index}", flatten(generation)
    for k, solution in enumerate(log.solutions, 1):
        yield f"solution {k}, of generation {solution.generation}", flatten(solution)
    for k, front in enumerate(log.fronts, 1):
        place = f"of generation {front.generation}, population {front.population}"
        yield f"front {k}, {place}", flatten(front)
    for name, data in log.attachments.items():
        is_array = name.endswith(ARRAY)
        yield f"attachment {name}", {"values": decode_array(data) if is_array else data}


def differing(
    before: Mapping[str, Any], now: Mapping[str, Any], prefix: str = ""
) -> Iterator[FieldDifference]:
    """Yield the fields of two records that differ in any bit, but for times and chain."""
    for name in dict.fromkeys([*before, *now]):
        if name in TIMES or name in _CHAINED:
            continue
        was, found = before.get(name), now.get(name)
        if _bits(was) != _bits(found):
            numbers = all(isinstance(value, float | np.ndarray) for value in (was, found))
            size = difference(was, found) if numbers else math.inf
            # two numbers that differ in the sign of a zero, or arrays in their kind
            yield FieldDifference(f"{prefix}{name}", was, found, size)


def _bits(value: Any) -> Any:
    """Return a value that equals another one's if all bits do; every NaN is one."""
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.kind, array_bytes(value)
    return repr(value) if isinstance(value, float) else value


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def first_divergence(stored: list[GenerationRow], again: list[GenerationRow]) -> int | None:
    """Return the index of the first generation that differs or is missing in one log, or None."""
    for before, now in zip(stored, again, strict=False):
        if before.chain != now.chain:
            return before.index
    if len(stored) != len(again):
        longer: Any = max(stored, again, key=len)
        return int(longer[min(len(stored), len(again))].index)
    return None


def farthest(stored: LogContents, again: LogContents) -> tuple[str, float]:
    """Return the value that differs most between two logs: its name, and by how much [-].

    Counts are left out, and what `_UNDECIDED` names. Without a difference the name is empty.
    """
    found = (each for each in field_differences(stored, again) if not each.is_count)
    sizes = ((each.name, each.size) for each in found if each.name not in _UNDECIDED)
    return max(sizes, key=lambda item: item[1], default=("", 0.0))


def difference(one: Any, two: Any) -> float:
    """Return the largest difference of two numbers or arrays, in units of their size, at least 1.

    Two infinities of one sign, and two NaN, do not differ. A number that is not finite in one array
    only differs by inf, and so do arrays of different shapes.
    """
    a, b = np.asarray(one, dtype=np.float64), np.asarray(two, dtype=np.float64)
    if a.shape != b.shape:
        return math.inf
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    if same.all():
        return 0.0
    a, b = a[~same], b[~same]
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return math.inf
    return float((np.abs(a - b) / np.maximum(1.0, np.abs(a))).max())


def fingerprint(condition: Condition, summary: ReplicateSummary) -> str:
    """Return the entry of the shipped table for a first replicate: its digest, or its cost.

    The cost stands for planners that are not reproducible bit by bit in every environment.
    """
    is_digest = condition.reproducibility == "bits"
    return summary.digest if is_digest else f"{_COST}{summary.best_cost!r}"


def same_fingerprint(one: str, two: str) -> bool:
    """Return whether two fingerprints agree: digests to the bit, costs to `TOLERANCE`."""
    if one.startswith(_COST) and two.startswith(_COST):
        return (
            difference(float(one.removeprefix(_COST)), float(two.removeprefix(_COST))) <= TOLERANCE
        )
    return one == two
