"""Runs stored replicates again and compares: MATCH, or the first generation that differs.

A planner whose reproducibility is `environment` is compared bit by bit in an equal environment, and
elsewhere by its numbers, to `TOLERANCE`.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.attachments import PREFIX, keep_all
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import CorruptLog, MissingDistribution
from evoexp.records import GenerationRow, ReplicateSummary
from evoexp.registry import missing
from evoexp.store.log import ARRAY
from evoexp.store.log_reader import LogContents, decode_array, read_log
from evoexp.store.manifest import differences

TOLERANCE = 1e-9  # [-] by which numbers may differ: of their size, or absolutely if it is below 1
_COST = "cost "  # begins a fingerprint that is no digest


class Comparison(NamedTuple):
    """A stored replicate beside its re-execution.

    Attributes:
        condition_id: 64 hex digits.
        replicate: Its index.
        diverged_at: First generation whose link of the chain differs, None if none does.
        digest_matches: Whether the ends of both chains agree (they include the last population).
        num_generations: Generations compared, the initial one included.
        environment: Differences between then and now, one line each.
        farthest: Where numbers are compared instead of chains: the number that differs most, and
            by how much [-]; None: chains are compared.
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
        """Whether every bit agrees, or every number to `TOLERANCE` where numbers are compared."""
        if self.farthest is not None:
            return self.farthest[1] <= TOLERANCE
        return self.diverged_at is None and self.digest_matches

    @property
    def verdict(self) -> str:
        """MATCH, or where it diverges."""
        if self.farthest is not None:
            name, difference = self.farthest
            if self.matches:
                most = f"; at most {difference:.1e}, {name}" if difference else ""
                return f"MATCH to {TOLERANCE:g} (in another environment{most})"
            return f"DIVERGES by {difference:.1e} in {name} (in another environment)"
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
        MissingDistribution: If the package of a component is not installed.
    """
    stored = read_log(path)
    if packages := missing(stored.environment.get("components", {})):
        raise MissingDistribution(str(path), packages)
    keep_all(data for name, data in stored.attachments.items() if name.startswith(PREFIX))
    condition = Condition.from_json(stored.config_json)
    if condition.id != stored.condition_id:
        raise CorruptLog(
            f"{path}: its configuration has hash {condition.id[:12]}, it claims "
            f"{stored.condition_id[:12]}"
        )
    again = read_log(run_replicate(condition, stored.replicate).content)
    found = compare(stored, again)
    if condition.reproducibility == "bits" or not found.environment:
        return found
    return found._replace(farthest=farthest(stored, again))


def compare(stored: LogContents, again: LogContents) -> Comparison:
    """Compare two logs of one replicate, link by link."""
    return Comparison(
        stored.condition_id,
        stored.replicate,
        first_divergence(stored.generations, again.generations),
        stored.summary.digest == again.summary.digest,
        len(stored.generations),
        tuple(map(str, differences(stored.environment, again.environment))),
    )


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
    """Return the number that differs most between two logs: its name, and its `difference` [-]."""
    before, now = dict(_numbers(stored)), dict(_numbers(again))
    if unmatched := sorted(before.keys() ^ now.keys()):
        return unmatched[0], math.inf
    found = [(name, difference(before[name], now[name])) for name in before]
    return max(found, key=lambda item: item[1])


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


def _numbers(log: LogContents) -> Iterator[tuple[str, Any]]:
    """Yield the numbers of a log: costs, terms, solution, arrays.

    Neither times nor counts of evaluations: rounding decides how many steps a library takes to the
    same end.
    """
    summary, last = log.summary, log.generations[-1]
    yield from (("cost", summary.best_cost), ("solved", summary.solved))
    yield from (("clearance", summary.clearance), ("feasible", last.num_feasible))
    yield "best cost of each generation", [row.best_cost for row in log.generations]
    yield from (
        (f"term {name}", value)
        for name, value in summary.terms.items()
        if not name.endswith("evaluations")
    )
    yield "solution", log.solutions[-1].values
    yield from (
        (name, decode_array(data)) for name, data in log.attachments.items() if name.endswith(ARRAY)
    )
