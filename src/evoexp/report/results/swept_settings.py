"""A sweep: conditions that differ in the settings that their labels end with, and nothing else.

`run -m` labels a condition of a sweep "via-point GA · population_size=20 · num_elites=0".
"""

import itertools
import re
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import BOOTSTRAP_SEED, Interval, percentiles, quantile

JOIN = " · "  # between the parts of a label
_SETTING = re.compile(r"([\w.@/-]+)=(.*)")
FEWEST = 2  # combinations of values that are a sweep

Values = Callable[[ConditionResults], np.ndarray]


class Swept(NamedTuple):
    """A condition of a sweep."""

    base: str  # what its label says beside the settings; empty if nothing
    values: tuple[str, ...]  # of the settings, in their order
    results: ConditionResults  # its results


class Sweep(NamedTuple):
    """The conditions of a sweep."""

    settings: tuple[str, ...]  # names of the swept settings
    conditions: tuple[Swept, ...]  # in the order of the experiment

    @property
    def bases(self) -> tuple[str, ...]:
        """The conditions that were swept, each once."""
        return tuple(dict.fromkeys(each.base for each in self.conditions))

    def levels(self, setting: int) -> tuple[str, ...]:
        """Return the values of a setting, each once: numbers by size, others as they came."""
        found = list(dict.fromkeys(each.values[setting] for each in self.conditions))
        try:
            return tuple(sorted(found, key=float))
        except ValueError:
            return tuple(found)

    def find(self, base: str, values: tuple[str, ...]) -> ConditionResults | None:
        """Return the results of one combination; None if it was not run."""
        for each in self.conditions:
            if (each.base, each.values) == (base, values) and each.results.done:
                return each.results
        return None


class MainEffect(NamedTuple):
    """One value of a setting against its first one, all other settings and seeds being equal."""

    base: str  # the condition that was swept
    setting: str  # name of the setting
    first: str  # the first value
    other: str  # the value that is compared with it
    num_pairs: int  # pairs of runs
    difference: float  # median of the other's cost minus the first's
    interval: Interval  # of it, by resampling seeds
    better: float  # share of pairs in which the other one's cost is lower; ties count half


def sweep_of(results: Results) -> Sweep | None:
    """Return the sweep that these results are; None if they are none."""
    parted = [_parted(c.label) for c in results.conditions if not c.is_reference]
    names = {tuple(settings) for _, settings in parted}
    if len(names) != 1 or not (settings := next(iter(names))):
        return None
    values = {tuple(own.values()) for _, own in parted}
    if len(values) < FEWEST or len(parted) != len({(b, *v.values()) for b, v in parted}):
        return None
    conditions = [c for c in results.conditions if not c.is_reference]
    return Sweep(
        settings,
        tuple(
            Swept(base, tuple(own.values()), c)
            for (base, own), c in zip(parted, conditions, strict=True)
        ),
    )


def main_effects(
    sweep: Sweep, values: Values, confidence: float, num_resamples: int
) -> Iterator[MainEffect]:
    """Yield the effect of each value of each setting.

    Args:
        values: (done,) of a condition, lower is better.
        confidence: Level of the intervals.
    """
    for base, (k, setting) in itertools.product(sweep.bases, enumerate(sweep.settings)):
        first, *others = sweep.levels(k)
        for other in others:
            pairs = _pairs(sweep, base, k, (first, other), values)
            if pairs.size:
                yield _effect((base, setting, first, other), pairs, confidence, num_resamples)


def _parted(label: str) -> tuple[str, dict[str, str]]:
    """Return the base of a label, and the settings behind it."""
    parts = label.split(JOIN)
    settings: dict[str, str] = {}
    while parts and (found := _SETTING.fullmatch(parts[-1])) and found[1] not in settings:
        settings[found[1]] = found[2]
        parts.pop()
    return JOIN.join(parts), dict(reversed(settings.items()))


def _pairs(
    sweep: Sweep, base: str, setting: int, levels: tuple[str, str], values: Values
) -> np.ndarray:
    """Return differences of two values of a setting, (seeds, combinations of the others); NaN."""
    found: list[dict[int, float]] = []
    rests = dict.fromkeys(
        each.values[:setting] + each.values[setting + 1 :] for each in sweep.conditions
    )
    for rest in rests:
        both = [sweep.find(base, (*rest[:setting], level, *rest[setting:])) for level in levels]
        if both[0] is None or both[1] is None:
            continue
        one, other = (
            dict(zip(map(int, c.summaries.index), values(c), strict=True))
            for c in both
            if c is not None
        )
        found.append(
            {
                seed: 0.0 if other[seed] == one[seed] else other[seed] - one[seed]  # both infinite
                for seed in one.keys() & other.keys()
            }
        )
    seeds = sorted({seed for each in found for seed in each})
    table = [[each.get(seed, np.nan) for each in found] for seed in seeds]
    return np.array(table, dtype=np.float64).reshape(len(seeds), len(found))


def _effect(
    names: tuple[str, str, str, str], pairs: np.ndarray, confidence: float, num_resamples: int
) -> MainEffect:
    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    drawn = rng.integers(0, len(pairs), (num_resamples, len(pairs)))
    medians = np.array([_median(pairs[rows]) for rows in drawn])
    known = pairs[~np.isnan(pairs)]
    better = float((known < 0.0).mean() + 0.5 * (known == 0.0).mean())
    interval = percentiles(medians, confidence)
    return MainEffect(*names, len(known), _median(pairs), interval, better)


def _median(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return quantile(known, 0.5) if len(known) else np.nan


def labelled(sweep: Sweep, names: Sequence[str]) -> str:
    """Return values with the names of their settings: "population_size = 20, num_elites = 0".

    Fewer values than settings are those of the first settings.
    """
    return ", ".join(f"{s} = {v}" for s, v in zip(sweep.settings, names, strict=False))
