"""How much of the gain by a hall of fame elitism alone explains."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from evoexp.papers.curkovic import measures
from evoexp.records import FloatArray
from evoexp.report import kit

EFFORT = "effort (logarithm)"
Statistic = Callable[[kit.ConditionResults, np.ndarray], FloatArray]


class Corner(NamedTuple):
    """A reading of Eq. 9 with a mutation rate, and what may keep good individuals."""

    name: str  # "one-sided, Eq. 10"
    nothing: kit.ConditionResults  # neither hall nor elites
    elites: tuple[kit.ConditionResults, ...]  # with elites instead of a hall, by growing number
    hall: kit.ConditionResults  # with a hall of distinct genomes
    by_index: kit.ConditionResults | None  # with a hall of distinct indices; None: not run
    others: tuple[kit.ConditionResults, ...]  # other halls: those that forget, or never change

    @property
    def halls(self) -> tuple[kit.ConditionResults, ...]:
        """The halls that never forget: of distinct genomes, then of distinct indices."""
        return (self.hall,) if self.by_index is None else (self.hall, self.by_index)


class Gain(NamedTuple):
    """A quantity whose gain is shared out."""

    name: str  # with unit where it has one
    short: str  # the same in a few words
    statistic: Statistic  # (condition, (resamples, runs) numbers of runs) → its value, (resamples,)
    runs: Callable[[kit.ConditionResults], int]  # the number of runs that count
    judged: kit.Measure | None = None  # the quantity by which claims are judged; None: by none


class Share(NamedTuple):
    """The share of a hall's gain that elites have, too."""

    value: float  # (nothing − elites) / (nothing − hall); NaN where the hall gains nothing
    interval: (
        kit.Interval
    )  # over resampled seeds; NaN where the hall's gain cannot be told from none
    n: tuple[int, int, int]  # runs of nothing, elites and hall that count


def corners(conditions: Sequence[kit.ConditionResults]) -> tuple[Corner, ...]:
    """Group conditions that differ in hall and elites only; groups that lack one are left out."""
    found = kit.grouped(
        conditions,
        lambda c: [
            getattr(c.planner.ga, name)
            for name in ("mutation_direction", "mutation_rate", "mutation_decay")
        ],
    )
    return tuple(corner for own in found if (corner := _corner(own)) is not None)


def share(
    corner: Corner,
    measure: Gain,
    elites: kit.ConditionResults,
    hall: kit.ConditionResults,
    settings: kit.ReportSettings,
) -> Share:
    """Return the share of a hall's gain that elites have, too.

    Runs of one seed are drawn together. Where more than the tail of the interval of resamples have
    no gain by the hall, the gain cannot be told from none, and there is no interval.
    """
    three = (corner.nothing, elites, hall)
    values = [of_all_runs(measure, c) for c in three]
    n = tuple(measure.runs(c) for c in three)
    rng = np.random.Generator(np.random.PCG64(kit.BOOTSTRAP_SEED))
    count = min(c.done for c in three)
    draws = rng.integers(0, count, (settings.num_resamples, count))
    nothing, some, full = (measure.statistic(c, draws) for c in three)
    gains = full < nothing
    tail = 0.5 * (1.0 - settings.confidence)
    interval = kit.Interval(np.nan, np.nan)
    if np.mean(~gains) <= tail:
        shares = _shares(nothing[gains], some[gains], full[gains])
        interval = kit.Interval(kit.quantile(shares, tail), kit.quantile(shares, 1.0 - tail))
    one = np.array(values)[:, None]
    value = float(_shares(*one)[0]) if values[2] < values[0] else np.nan
    return Share(value, interval, (n[0], n[1], n[2]))


def medians(column: Callable[[kit.ConditionResults], FloatArray]) -> Statistic:
    """Return the statistic "median of a column"; NaN is left out, inf is a value."""

    def statistic(condition: kit.ConditionResults, draws: np.ndarray) -> FloatArray:
        drawn = column(condition)[draws]
        found, known = np.full(len(drawn), np.nan), ~np.isnan(drawn).all(axis=1)
        found[known] = np.nanmedian(drawn[known], axis=1)
        return found

    return statistic


def log_effort(threshold: float) -> Statistic:
    """Return the statistic "logarithm of the expected running time to a team of that cost"."""

    def statistic(condition: kit.ConditionResults, draws: np.ndarray) -> FloatArray:
        first = measures.evaluations_to(condition, threshold)
        reached = np.isfinite(first)
        spent = np.where(reached, first, condition.column("evaluations"))
        total, having = spent[draws].sum(axis=1), reached[draws].sum(axis=1)
        found = np.full(len(draws), np.inf)
        np.divide(total, having, out=found, where=having > 0)
        return np.asarray(np.log(found))

    return statistic


def gain_measures(threshold: float, told: str) -> tuple[Gain, ...]:
    """Return the quantities in which gains are shared out."""
    best, to = kit.by_column("best_cost"), f"evaluations to a team of cost ≤ {told}"
    effort = partial(measures.evaluations_to, threshold=threshold)
    return (
        Gain("best cost", "best cost", medians(best), _done, kit.Measure("best cost", best)),
        Gain(
            f"{to} (expected running time)",
            EFFORT,
            log_effort(threshold),
            lambda c: int(np.isfinite(effort(c)).sum()),
            kit.Measure(to, effort),
        ),
        Gain(
            measures.CERTIFIED,
            "cost, refuted as worst",
            medians(measures.certified_cost),
            _done,
            kit.Measure(measures.CERTIFIED, measures.certified_cost),
        ),
        Gain(
            "best cost among motions that are not refuted",
            "cost, not refuted only",
            medians(not_refuted),
            lambda c: int(np.isfinite(measures.certified_cost(c)).sum()),
        ),
    )


def _done(condition: kit.ConditionResults) -> int:
    return condition.done


def not_refuted(condition: kit.ConditionResults) -> FloatArray:
    """Return each run's best cost, (done,); NaN where its motion is refuted."""
    found = measures.certified_cost(condition)
    return np.where(np.isfinite(found), found, np.nan)


def _corner(own: Sequence[kit.ConditionResults]) -> Corner | None:
    plain = [c for c in own if not c.planner.ga.hall_depth]
    halls = [c for c in own if c.planner.ga.hall_depth]
    nothing = [c for c in plain if not c.planner.ga.num_elites]
    elites = sorted(
        (c for c in plain if c.planner.ga.num_elites), key=lambda c: int(c.planner.ga.num_elites)
    )
    usual = [c for c in halls if not c.planner.ga.hall_frozen and c.planner.ga.hall_memory is None]
    genomes = [c for c in usual if c.planner.ga.hall_distinct == "genome"]
    indices = [c for c in usual if c.planner.ga.hall_distinct == "index"]
    if not (nothing and elites and genomes):
        return None
    name = genomes[0].label.rpartition(", ")[0]
    others = tuple(c for c in halls if c not in usual)
    by_index = indices[0] if indices else None
    return Corner(name, nothing[0], tuple(elites), genomes[0], by_index, others)


def of_all_runs(measure: Gain, condition: kit.ConditionResults) -> float:
    """Return a quantity over all runs of a condition."""
    return float(measure.statistic(condition, np.arange(condition.done)[None, :])[0])


def _shares(nothing: FloatArray, some: FloatArray, full: FloatArray) -> FloatArray:
    """Return (nothing − some) / (nothing − full) of rows with full < nothing.

    Where nothing never gets there, elites explain all of it if they do, and else none.
    """
    shares = np.where(np.isfinite(some), 1.0, 0.0)
    known = np.isfinite(nothing)
    np.divide(nothing - some, nothing - full, out=shares, where=known)
    return shares
