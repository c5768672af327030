"""A sweep: conditions that differ in the settings that their labels end with, and nothing else.

`run -m` labels a condition of a sweep "via-point GA · population_size=20 · num_elites=0".
"""

import itertools
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import BOOTSTRAP_SEED, percentiles, quantile

JOIN = " · "  # between the parts of a label
_SETTING = re.compile(r"([\w.@/-]+)=(.*)")
FEWEST = 2  # combinations of values that are a sweep


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


def sweep_of(results: Results) -> Sweep | None:
    """Return the sweep that these results are; None if they are none."""
    swept, names = list[Swept](), set[tuple[str, ...]]()
    for c in results.conditions:
        if c.is_reference:
            continue
        # the base of a label, and the settings behind it
        parts, settings = c.label.split(JOIN), dict[str, str]()
        while parts and (found := _SETTING.fullmatch(parts[-1])) and found[1] not in settings:
            settings = {found[1]: found[2], **settings}
            parts.pop()
        names.add(tuple(settings))
        swept.append(Swept(JOIN.join(parts), tuple(settings.values()), c))
    combinations = {each.values for each in swept}
    is_repeated = len({each[:2] for each in swept}) < len(swept)
    if len(names) != 1 or () in names or len(combinations) < FEWEST or is_repeated:
        return None
    return Sweep(names.pop(), tuple(swept))


def main_effects(
    sweep: Sweep, values: Values, confidence: float, num_resamples: int
) -> pd.DataFrame:
    """Return each value of a setting against its first one, all else and seeds being equal.

    Columns base (the swept condition), setting, first, other (its values), pairs (of runs),
    difference (median of the other's minus the first's), low, high (its interval, by resampling
    seeds), better (share of pairs in which the other is lower; ties count half).
    """
    rows = []
    for base, (k, setting) in itertools.product(sweep.bases, enumerate(sweep.settings)):
        first, *others = sweep.levels(k)
        for other in others:
            pairs = _pairs(sweep, base, k, (first, other), values)
            if not pairs.size:
                continue
            rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
            drawn = rng.integers(0, len(pairs), (num_resamples, len(pairs)))
            medians = np.array([quantile(pairs[seeds].ravel(), 0.5) for seeds in drawn])
            known = pairs[~np.isnan(pairs)]
            better = float((known < 0.0).mean() + 0.5 * (known == 0.0).mean())
            ends = percentiles(medians, confidence)
            numbers = len(known), quantile(known, 0.5), *ends, better
            rows.append((base, setting, first, other, *numbers))
    names = ["base", "setting", "first", "other", "pairs", "difference", "low", "high", "better"]
    return pd.DataFrame(rows, columns=names)


def _pairs(
    sweep: Sweep, base: str, setting: int, levels: tuple[str, str], values: Values
) -> np.ndarray:
    """Return differences of two values of a setting, (seeds, combinations of the others); NaN."""
    runs = pd.concat(
        pd.DataFrame(
            {
                "seed": each.results.summaries.index,
                "level": each.values[setting],
                "rest": str(each.values[:setting] + each.values[setting + 1 :]),
                "value": values(each.results),
            }
        )
        for each in sweep.conditions
        if each.base == base
    ).set_index(["seed", "rest"])
    first, other = (runs.loc[runs["level"] == level, "value"] for level in levels)
    first, other = first.align(other, join="inner")
    differences = (other - first).where(other != first, 0.0)  # both may be infinite
    return differences.unstack("rest").to_numpy(np.float64)


def labelled(sweep: Sweep, names: Sequence[str]) -> str:
    """Return values with the names of their settings: "population_size = 20, num_elites = 0".

    Fewer values than settings are those of the first settings.
    """
    return ", ".join(f"{s} = {v}" for s, v in zip(sweep.settings, names, strict=False))
