"""How much of the gain by a hall of fame elitism alone explains."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from evoexp.papers.curkovic import measures
from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.run_measures import grouped
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics import judging
from evoexp.report.statistics.comparisons import Family, Measure, by_column, compared
from evoexp.report.statistics.inference import BOOTSTRAP_SEED, Interval, quantile
from evoexp.report.statistics.judging import Judge

EFFORT = "effort (logarithm)"
Statistic = Callable[[ConditionResults, np.ndarray], FloatArray]


class Corner(NamedTuple):
    """A reading of Eq. 9 with a mutation rate, and what may keep good individuals."""

    name: str  # "one-sided, Eq. 10"
    nothing: ConditionResults  # neither hall nor elites
    elites: tuple[ConditionResults, ...]  # with elites instead of a hall, by growing number
    hall: ConditionResults  # with a hall of distinct genomes
    by_index: ConditionResults | None  # with a hall of distinct indices; None: not run
    others: tuple[ConditionResults, ...]  # other halls: those that forget, or never change

    @property
    def halls(self) -> tuple[ConditionResults, ...]:
        """The halls that never forget: of distinct genomes, then of distinct indices."""
        return (self.hall,) if self.by_index is None else (self.hall, self.by_index)


class Gain(NamedTuple):
    """A quantity whose gain is shared out."""

    name: str  # with unit where it has one
    short: str  # the same in a few words
    statistic: Statistic  # (condition, (resamples, runs) numbers of runs) → its value, (resamples,)
    runs: Callable[[ConditionResults], int]  # the number of runs that count
    judged: Measure | None = None  # the quantity by which claims are judged; None: by none


class Share(NamedTuple):
    """The share of a hall's gain that elites have, too."""

    value: float  # (nothing − elites) / (nothing − hall); NaN where the hall gains nothing
    interval: Interval  # over resampled seeds; NaN where the hall's gain cannot be told from none
    n: tuple[int, ...]  # runs of nothing, elites and hall that count


def corners(conditions: Sequence[ConditionResults]) -> tuple[Corner, ...]:
    """Group conditions that differ in hall and elites only; groups that lack one are left out."""

    def key(condition: ConditionResults) -> tuple[object, ...]:
        ga = condition.planner.ga
        return ga.mutation_direction, ga.mutation_rate, ga.mutation_decay

    def treatment(condition: ConditionResults) -> str:
        ga = condition.planner.ga
        if not ga.hall_depth:
            return "elites" if ga.num_elites else "nothing"
        return "other" if ga.hall_frozen or ga.hall_memory is not None else str(ga.hall_distinct)

    found = []
    for own in grouped(conditions, key):
        by: dict[str, list[ConditionResults]] = {}
        for c in own:
            by.setdefault(treatment(c), []).append(c)
        if {"nothing", "elites", "genome"} <= by.keys():
            elites = tuple(sorted(by["elites"], key=lambda c: int(c.planner.ga.num_elites)))
            nothing, hall, index = (
                by["nothing"][0],
                by["genome"][0],
                [*by.get("index", ()), None][0],
            )
            name, others = hall.label.rpartition(", ")[0], tuple(by.get("other", ()))
            found.append(Corner(name, nothing, elites, hall, index, others))
    return tuple(found)


def share(
    corner: Corner,
    measure: Gain,
    elites: ConditionResults,
    hall: ConditionResults,
    settings: ReportSettings,
) -> Share:
    """Return the share of a hall's gain that elites have, too.

    Runs of one seed are drawn together. Where more than the tail of the interval of resamples have
    no gain by the hall, the gain cannot be told from none, and there is no interval.
    """
    three = (corner.nothing, elites, hall)
    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    count = min(c.done for c in three)
    draws = rng.integers(0, count, (settings.num_resamples, count))
    nothing, some, full = (measure.statistic(c, draws) for c in three)
    gains = full < nothing
    tail = 0.5 * (1.0 - settings.confidence)
    interval = Interval(np.nan, np.nan)
    if np.mean(~gains) <= tail:
        shares = _shares(nothing[gains], some[gains], full[gains])
        interval = Interval(quantile(shares, tail), quantile(shares, 1.0 - tail))
    values = np.array([of_all_runs(measure, c) for c in three])[:, None]
    value = float(_shares(*values)[0]) if values[2] < values[0] else np.nan
    return Share(value, interval, tuple(measure.runs(c) for c in three))


def medians(column: Callable[[ConditionResults], FloatArray]) -> Statistic:
    """Return the statistic "median of a column"; NaN is left out, inf is a value."""

    def statistic(condition: ConditionResults, draws: np.ndarray) -> FloatArray:
        drawn = column(condition)[draws]
        found, known = np.full(len(drawn), np.nan), ~np.isnan(drawn).all(axis=1)
        found[known] = np.nanmedian(drawn[known], axis=1)
        return found

    return statistic


def gains(threshold: float) -> tuple[Gain, ...]:
    """Return the quantities in which gains are shared out."""
    best, done = by_column("best_cost"), attrgetter("done")
    to = f"evaluations to a team of cost ≤ {markdown.number(threshold)}"
    effort = partial(measures.evaluations_to, threshold=threshold)

    def log_effort(condition: ConditionResults, draws: np.ndarray) -> FloatArray:
        """Return the logarithm of the expected running time to a team of that cost."""
        first = effort(condition)
        reached = np.isfinite(first)
        spent = np.where(reached, first, condition.column("evaluations"))
        total, having = spent[draws].sum(axis=1), reached[draws].sum(axis=1)
        found = np.full(len(draws), np.inf)
        np.divide(total, having, out=found, where=having > 0)
        return np.asarray(np.log(found))

    return (
        Gain("best cost", "best cost", medians(best), done, Measure("best cost", best)),
        Gain(
            f"{to} (expected running time)",
            EFFORT,
            log_effort,
            lambda c: int(np.isfinite(effort(c)).sum()),
            Measure(to, effort),
        ),
        Gain(
            measures.CERTIFIED,
            "cost, refuted as worst",
            medians(measures.certified_cost),
            done,
            Measure(measures.CERTIFIED, measures.certified_cost),
        ),
        Gain(
            "best cost among motions that are not refuted",
            "cost, not refuted only",
            medians(not_refuted),
            lambda c: int(np.isfinite(measures.certified_cost(c)).sum()),
        ),
    )


def not_refuted(condition: ConditionResults) -> FloatArray:
    """Return each run's best cost, (done,); NaN where its motion is refuted."""
    found = measures.certified_cost(condition)
    return np.where(np.isfinite(found), found, np.nan)


def of_all_runs(measure: Gain, condition: ConditionResults) -> float:
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


# (reading and rate, quantity, elites, hall) → how much of the hall's gain elites have, too
Shares = Callable[[Corner, Gain, ConditionResults, ConditionResults], Share]


def told_share(share: Share) -> str:
    """Return a share in words, with its interval if there is one."""
    if np.isnan(share.value):
        return "–"
    text = f"{100 * share.value:.0f} %"
    if np.isfinite(share.interval.low) or np.isfinite(share.interval.high):
        text += f" [{100 * share.interval.low:.0f}, {100 * share.interval.high:.0f}]"
    return text


def elitism_headers(corners: Sequence[Corner]) -> tuple[str, ...]:
    """Return the headers of the columns of values, shares and runs."""
    elites = [
        f"{c.planner.ga.num_elites} elite" + "s" * (k > 0) for k, c in enumerate(corners[0].elites)
    ]
    shares = (f"share of {name}" for name in elites)
    return (*elites, "hall", *shares, f"n (nothing, {elites[-1]}, hall)")


def elitism_rows(
    corners: Sequence[Corner], gains: Sequence[Gain], hall_shares: Shares
) -> Iterator[tuple[str, ...]]:
    """Yield quantities, shares by elitism, and the runs behind them."""
    for corner, gain in itertools.product(corners, gains):
        for hall, distinct in zip(corner.halls, ("genome", "index"), strict=False):
            found = [hall_shares(corner, gain, elites, hall) for elites in corner.elites]
            values = [of_all_runs(gain, c) for c in (corner.nothing, *corner.elites, hall)]
            if gain.short == EFFORT:
                values = np.rint(np.exp(values)).tolist()
            counts = ", ".join(map(str, found[-1].n))
            told = *map(markdown.number, values), *map(told_share, found)
            yield corner.name, gain.name, distinct, *told, counts


def short_label(elites: ConditionResults) -> str:
    """Return the part of a label that names the elites."""
    return elites.label.rpartition(", ")[2]


def _of_corner(judge: Judge, corner: Corner, gain: Gain, shares: Shares) -> list[Claim]:
    """Return the claims on one reading of Eq. 9 and one rate, judged by one quantity."""
    assert gain.judged is not None
    name, values, *_ = gain.judged
    who, hall = f"{corner.name}: ", corner.hall
    over_elites = compared([(hall, c) for c in corner.elites], values, judge.settings)
    told = "; ".join(
        f"against {row.quantity} {judging.evidence(row, 'lower')}" for row in over_elites
    )
    explained = ", ".join(
        f"{told_share(shares(corner, gain, c, hall))} ({short_label(c)})" for c in corner.elites
    )
    elites = " and than ".join(map(short_label, corner.elites))
    beyond = judge.on("hall_beyond_elites", who=who, elites=elites, measure=name)
    single = [("hall_helps", corner.nothing)]
    single += [("distinct_genomes", c) for c in corner.halls[1:]]
    single += [("frozen_hall", c) for c in corner.others if c.planner.ga.hall_frozen]
    first, *more = (
        judge.on(rule, who=who, measure=name).better(judge.compared(hall, c, values), "lower")
        for rule, c in single
    )
    told += f"; share of the hall's gain over nothing: {explained}"
    return [first, beyond.better_than_all(told, over_elites), *more]


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "hall_claims": lambda judge, corners, gains, hall_shares: [
        claim
        for gain in gains
        if gain.judged is not None
        for corner in corners
        for claim in _of_corner(judge, corner, gain, hall_shares)
    ],
    # the quantities by which claims are judged
    "judged_gains": lambda gains: [gain.judged for gain in gains if gain.judged is not None],
    # the hall of distinct genomes against all else of a reading and rate
    "corner_families": lambda corners: [
        Family.of((c.hall, c.nothing, *c.elites, *c.halls[1:], *c.others)) for c in corners
    ],
    # the function that gives shares, each computed once
    "hall_shares": lambda settings: cache(partial(share, settings=settings)),
}
