"""Runs or evaluates stored replicates again and compares them with their logs.

Two things are compared: the search, link by link of the chain, and everything else that a log
holds but times. In an equal environment both must agree to the bit, elsewhere numbers to
`TOLERANCE`. Elsewhere a planner whose reproducibility is `environment` is compared by numbers only.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.attachments import PREFIX, keep_all
from evoexp.batch.replicate import EXACT_BOXES, run_replicate
from evoexp.batch.runner_settings import machine_memory, refuse_large
from evoexp.condition import Condition
from evoexp.errors import CorruptLog, EvoexpError, MissingDistribution, brief
from evoexp.planners.answers import judge_motion
from evoexp.records import TIMES, ReplicateSummary, flatten
from evoexp.registry import missing
from evoexp.store.files import reason
from evoexp.store.identity import differences
from evoexp.store.log import ARRAY, array_bytes
from evoexp.store.log_reader import LogContents, Place, decode_array, read_log

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
LARGEST = 1e7  # of a solution's numbers, as of those of robots and scenarios, in any unit
_UNFIT = (ValueError, ArithmeticError, LookupError, EvoexpError)  # raised by numbers of no solution


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

    def __str__(self) -> str:
        if math.isfinite(self.size):
            return f"{self.name} differs by {self.size:.1e}"
        if not all(isinstance(value, _PLAIN) for value in (self.was, self.now)):
            return f"{self.name} differs"
        was, now = (brief(repr(value), _LONGEST) for value in (self.was, self.now))
        return f"{self.name} was {was}, is {now}"


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
    by_numbers: bool = False  # whether numbers are compared instead of chains
    damage: str = ""  # what is wrong with the log, which nothing is compared with then

    @property
    def search_matches(self) -> bool:
        """Whether every bit of the search agrees."""
        return self.diverged_at is None and self.digest_matches

    @property
    def matches(self) -> bool:
        """Whether every bit agrees, or every number to `TOLERANCE` where numbers are compared."""
        if self.by_numbers:
            return farthest(self.fields)[1] <= TOLERANCE
        return self.search_matches and self._decisive is None

    @property
    def _decisive(self) -> FieldDifference | None:
        large = (each for each in self.fields if not (self.inexact and each.is_close))
        return next(large, None)

    @property
    def verdict(self) -> str:
        """MATCH, or where it diverges."""
        if self.damage:
            return f"damaged: {self.damage}"
        if self.by_numbers:
            name, difference = farthest(self.fields)
            if self.matches:
                most = f"; at most {difference:.1e}, {name}" if difference else ""
                return f"MATCH to {TOLERANCE:g} ({self.inexact}{most})"
            return f"DIVERGES by {difference:.1e} in {name} ({self.inexact})"
        if self.diverged_at is not None:
            return f"DIVERGES at generation {self.diverged_at}"
        if not self.digest_matches:
            return "DIVERGES in the last population"
        if not self.fields:
            return "MATCH"
        shown, others = self._decisive or self.fields[0], len(self.fields) - 1
        more = f", and {others} more field{'s' * (others > 1)}" if others else ""
        if self._decisive is None:
            rest = f"to {TOLERANCE:g} in the rest: {shown}{more}"
            return f"MATCH in the search, {rest} ({self.inexact})"
        why = f" ({self.inexact})" if self.inexact else ""
        return f"MATCH in the search; DIVERGES in the rest: {shown}{more}{why}"


def reproduce_stored(path: Path, condition_id: str, replicate: int) -> Comparison:
    """Run a replicate of a stored run again, as `reproduce_log` does, if its log is whole."""
    try:
        return reproduce_log(path, (condition_id, replicate))
    except CorruptLog as error:
        damage = reason(path, error)
        return Comparison(condition_id, replicate, None, False, 0, (), damage=damage)


def reproduce_log(path: Path, place: Place | None = None) -> Comparison:
    """Run a log's replicate again, from the configuration attached to the log alone.

    CorruptLog is raised where the log cannot be trusted, or is of another condition and replicate
    than its place; see `stored_condition`, too.
    """
    stored = read_log(path, place)
    condition = stored_condition(path, stored)
    refuse_large(condition, machine_memory())
    again = read_log(run_replicate(condition, stored.replicate).content)
    comparison = compare(stored, again)
    is_same = comparison.search_matches and not comparison.fields
    is_exact = condition.reproducibility == "bits" or not comparison.inexact
    return comparison._replace(by_numbers=not is_same and not is_exact)


def stored_condition(path: Path, log: LogContents) -> Condition:
    """Return the condition of a log, built from the log alone.

    RevisionMismatch or MissingDistribution is raised where its components are not those here.
    """
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


def compare(stored: LogContents, again: LogContents) -> Comparison:
    """Compare two logs of one replicate: link by link, and field by field."""
    environment = tuple(map(str, differences(stored.environment, again.environment)))
    is_older = EXACT_BOXES not in stored.environment
    pairs = itertools.zip_longest(stored.generations, again.generations)
    diverging = (
        (before or now).index
        for before, now in pairs
        if before is None or now is None or before.chain != now.chain
    )
    comparison = Comparison(
        stored.condition_id,
        stored.replicate,
        next(diverging, None),
        stored.summary.digest == again.summary.digest,
        len(stored.generations),
        environment,
        tuple(field_differences(stored, again)),
        ELSEWHERE if environment else OLDER if is_older else "",
    )
    digests = stored.content_digest, again.content_digest
    if comparison.search_matches and not comparison.fields and digests[0] != digests[1]:
        return comparison._replace(fields=(FieldDifference(_CONTENT, *digests, math.inf),))
    return comparison


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


def farthest(fields: Iterable[FieldDifference]) -> tuple[str, float]:
    """Return the value that differs most: its name, and by how much [-].

    Counts of steps are left out, as rounding decides how many lead to the same end, and what
    `_UNDECIDED` names. Without a difference the name is empty.
    """
    sizes = [("", 0.0)]
    for each in fields:
        ints = type(each.was) is int and type(each.now) is int
        is_count = each.name.endswith("evaluations") or (ints and "num_feasible" not in each.name)
        if not is_count and each.name not in (*_UNDECIDED, _CONTENT):
            sizes.append((each.name, each.size))
    return max(sizes, key=lambda item: item[1])


def difference(one: Any, two: Any) -> float:
    """Return the largest difference of two numbers or arrays, in units of their size, at least 1.

    Equal infinities, and NaN, do not differ; other infinities and shapes differ by inf.
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
    """Return the entry of the shipped table: a digest; a cost where bits are not reproducible."""
    is_digest = condition.reproducibility == "bits"
    return summary.digest if is_digest else f"{_COST}{summary.best_cost!r}"


def same_fingerprint(one: str, two: str) -> bool:
    """Return whether two fingerprints agree: digests to the bit, costs to `TOLERANCE`."""
    if one.startswith(_COST) and two.startswith(_COST):
        costs = [float(text.removeprefix(_COST)) for text in (one, two)]
        return difference(*costs) <= TOLERANCE
    return one == two


def contradictions(path: Path, log: LogContents) -> Iterator[str]:
    """Yield the contradictions between a log's solutions and the costs, terms and verdict it tells.

    The search is not run again: fronts, arrays and statistics of populations need `compare`.
    EvoexpError is raised where they cannot be evaluated here: another revision, a missing package.
    """
    condition = stored_condition(path, log)
    refuse_large(condition, machine_memory())
    with np.errstate(all="ignore"):
        yield from map(str, _contradictions(*condition.prepare(), log))


def _contradictions(planner: Any, problem: Any, log: LogContents) -> Iterator[FieldDifference]:
    rows = {row.index: row for row in log.generations}
    terms: Mapping[str, float] = {}
    for solution in log.solutions:
        name = f"solution of generation {solution.generation}"
        row = rows.get(solution.generation)
        if row is None:
            yield FieldDifference(name, "there", "of no generation of the log", math.inf)
            return
        yield from differing({"cost": solution.cost}, {"cost": row.best_cost}, f"{name}: ")
        try:
            if not (np.abs(solution.values) <= LARGEST).all():  # NaN, too
                raise ValueError(f"its numbers must be finite and at most {LARGEST:g}")
            terms = planner.evaluate(problem, solution.values)
        except _UNFIT as error:
            if not isinstance(error, EvoexpError) or math.isfinite(solution.cost):
                yield FieldDifference(name, "there", f"none: {error}", math.inf)
                return
            continue  # what costs inf may be no solution at all
        yield from _unlike(row.terms, terms, f"{name}: ")
        cost = float(planner.cost_of_terms(terms))
        if math.isfinite(solution.cost) and not math.isnan(cost):
            yield from _unlike({"cost": solution.cost}, {"cost": cost}, f"{name}: ")
    yield from _unlike(log.summary.terms, terms, "last solution: ")
    # the motion is judged last: that of a replaced solution might take very long
    last = log.solutions[-1].values
    verdict = judge_motion(planner, problem, planner.motion(problem, last))._asdict()
    yield from _unlike(flatten(log.summary), verdict, "motion of the last solution: ")


def _unlike(
    stored: Mapping[str, Any], again: Mapping[str, Any], prefix: str
) -> Iterator[FieldDifference]:
    """Yield the fields of both that differ by more than rounding."""
    shared = {name: again[name] for name in again if name in stored}
    for each in differing({name: stored[name] for name in shared}, shared):
        if not each.is_close:
            yield each._replace(name=prefix + each.name)
