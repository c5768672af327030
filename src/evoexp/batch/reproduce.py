"""Runs stored replicates again and compares: MATCH, or the first generation that differs."""

from pathlib import Path
from typing import Any, NamedTuple

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import CorruptLog
from evoexp.records import GenerationRow
from evoexp.store.log_reader import LogContents, read_log
from evoexp.store.manifest import differences, environment


class Comparison(NamedTuple):
    """A stored replicate beside its re-execution.

    Attributes:
        condition_id: 64 hex digits.
        replicate: Its index.
        diverged_at: First generation whose link of the chain differs, None if none does.
        digest_matches: Whether the ends of both chains agree (they include the last population).
        num_generations: Generations compared, the initial one included.
        environment: Differences between then and now, one line each.
    """

    condition_id: str
    replicate: int
    diverged_at: int | None
    digest_matches: bool
    num_generations: int
    environment: tuple[str, ...]

    @property
    def matches(self) -> bool:
        """Whether every bit agrees."""
        return self.diverged_at is None and self.digest_matches

    @property
    def verdict(self) -> str:
        """MATCH, or where it diverges."""
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
    condition = Condition.from_json(stored.config_json)
    if condition.id != stored.condition_id:
        raise CorruptLog(
            f"{path}: its configuration has hash {condition.id[:12]}, it claims {stored.condition_id[:12]}"
        )
    return compare(stored, read_log(run_replicate(condition, stored.replicate).content))


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
    """Return the index of the first generation that differs or is missing on one side; None if there is none."""
    for before, now in zip(stored, again, strict=False):
        if before.chain != now.chain:
            return before.index
    if len(stored) != len(again):
        longer: Any = max(stored, again, key=len)
        return int(longer[min(len(stored), len(again))].index)
    return None
