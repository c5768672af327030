"""Runs stored replicates again and compares: MATCH, or the first generation that differs.

References are compared by their numbers, to `TOLERANCE`: libraries compute them that are not
reproducible bit by bit.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.attachments import PREFIX, keep_all
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import CorruptLog
from evoexp.records import GenerationRow, ReplicateSummary
from evoexp.store.log import ARRAY
from evoexp.store.log_reader import LogContents, decode_array, read_log
from evoexp.store.manifest import differences, environment

# [-] by which numbers of a reference may differ: of their size, or absolutely where they are below
# 1
TOLERANCE = 1e-9
_COST = "cost "  # what stands in the place of a reference's digest begins with it


class Comparison(NamedTuple):
    """A stored replicate beside its re-execution.

    Attributes:
        condition_id: 64 hex digits.
        replicate: Its index.
        diverged_at: First generation whose link of the chain differs, None if none does.
        digest_matches: Whether the ends of both chains agree (they include the last population).
        num_generations: Generations compared, the initial one included.
        environment: Differences between then and now, one line each.
        farthest: Of a reference, instead of the chains: the number that differs most, and by how
            much; None: no reference.
    """

    condition_id: str
    replicate: int
    diverged_at: int | None
    digest_matches: bool
    num_generations: int
    environment: tuple[str, ...]
    farthest: tuple[str, float] | None = None

    @property
    def matches(self) -> bool:
        """Whether every bit agrees, of a reference every number to `TOLERANCE`."""
        if self.farthest is not None:
            return self.farthest[1] <= TOLERANCE
        return self.diverged_at is None and self.digest_matches

    @property
    def verdict(self) -> str:
        """MATCH, or where it diverges."""
        if self.farthest is not None:
            name, difference = self.farthest
            if self.matches:
                return f"MATCH to {TOLERANCE:g}" + (
                    f" (at most {difference:.1e}, {name})" if difference else ""
                )
            return f"DIVERGES by {difference:.1e} in {name}"
        if self.matches:
            return "MATCH"
        if self.diverged_at is None:
            return "DIVERGES in the last population"
        return f"DIVERGES at generation {self.diverged_at}"


def reproduce_log(path: Path) -> Comparison:
    """Run a log's replicate again, from the configuration attached to the log alone.

    Raises:
        CorruptLog: If the log cannot be trusted.
        RevisionMismatch: If a component has another revision in this installation.
    """
    stored = read_log(path)
    keep_all(data for name, data in stored.attachments.items() if name.startswith(PREFIX))
    condition = Condition.from_json(stored.config_json)
    if condition.id != stored.condition_id:
        raise CorruptLog(
            f"{path}: its configuration has hash {condition.id[:12]}, it claims "
            f"{stored.condition_id[:12]}"
        )
    again = read_log(run_replicate(condition, stored.replicate).content)
    found = compare(stored, again)
    return found._replace(farthest=farthest(stored, again)) if condition.is_reference else found


def compare(stored: LogContents, again: LogContents) -> Comparison:
    """Compare two logs of one replicate, link by link."""
    return Comparison(
        stored.condition_id,
        stored.replicate,
        first_divergence(stored.generations, again.generations),
        stored.summary.digest == again.summary.digest,
        len(stored.generations),
        tuple(map(str, differences(stored.environment, environment()))),
    )


def first_divergence(stored: list[GenerationRow], again: list[GenerationRow]) -> int | None:
    """Return the index of the first generation that differs or is missing on one side.

    None if there is none.
    """
    for before, now in zip(stored, again, strict=False):
        if before.chain != now.chain:
            return before.index
    if len(stored) != len(again):
        longer: Any = max(stored, again, key=len)
        return int(longer[min(len(stored), len(again))].index)
    return None


def farthest(stored: LogContents, again: LogContents) -> tuple[str, float]:
    """Return which number of a reference differs most from that of its re-execution.

    And by how much [-].
    """
    before, now = dict(_numbers(stored)), dict(_numbers(again))
    if unmatched := sorted(before.keys() ^ now.keys()):
        return unmatched[0], math.inf
    found = [(name, difference(before[name], now[name])) for name in before]
    return max(found, key=lambda item: item[1])


def difference(one: Any, two: Any) -> float:
    """Return by how much two numbers or arrays differ at most, in units of their size.

    Or of 1 below it.

    Two infinities of one sign, and two NaN, do not differ; those of one array only differ by inf,
    as do other shapes.
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
    """Return what the shipped table keeps of a first replicate.

    Its digest, of a reference its cost.
    """
    return f"{_COST}{summary.best_cost!r}" if condition.is_reference else summary.digest


def same_fingerprint(one: str, two: str) -> bool:
    """Return whether two fingerprints agree.

    Digests to the bit, costs of references to `TOLERANCE`.
    """
    if one.startswith(_COST) and two.startswith(_COST):
        return (
            difference(float(one.removeprefix(_COST)), float(two.removeprefix(_COST))) <= TOLERANCE
        )
    return one == two


def _numbers(log: LogContents) -> Iterator[tuple[str, Any]]:
    """Yield every number that a reference's log holds: cost, terms, solution, arrays.

    Neither times nor counts of evaluations: rounding decides how many steps a library takes to the
    same end.
    """
    summary, last = log.summary, log.generations[-1]
    yield from (("cost", summary.best_cost), ("solved", summary.solved))
    yield from (("clearance", summary.clearance), ("feasible", last.num_feasible))
    yield from (
        (f"term {name}", value)
        for name, value in summary.terms.items()
        if not name.endswith("evaluations")
    )
    yield "solution", log.solutions[-1].values
    yield from (
        (name, decode_array(data)) for name, data in log.attachments.items() if name.endswith(ARRAY)
    )
