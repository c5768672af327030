"""The claims of Curkovic et al. 2013: on methods, motions and settings, and on hall and elitism."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from evoexp.papers.curkovic import measures
from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim, Quantity, quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import comparisons, judging
from evoexp.report.statistics.comparisons import Comparison, Family, Measure, by_column, compared
from evoexp.report.statistics.inference import BOOTSTRAP_SEED, Interval, Proportion, percentiles
from evoexp.report.statistics.judging import Judge

Rows = tuple[Comparison, ...]
Conditions = Sequence[ConditionResults]
METHOD, ELITES = "V", "15 elites"
KEPT = "least distance of an end-effector from another robot's links"
COLLIDES = "solved motion collides between its configurations (exact verdict)"
Statistic = Callable[[ConditionResults, np.ndarray], FloatArray]


def radius_conditions(results: Results) -> tuple[ConditionResults, ...]:
    """Return conditions by collision substeps and growing radius; none if no radius differs."""
    by_radius = sorted(results.main, key=lambda c: float(c.planner.collision.tcp_radius))
    differ = len({c.planner.collision.tcp_radius for c in by_radius}) > 1
    return tuple(itertools.chain(*_by_substeps(by_radius))) if differ else ()


def _by_substeps(conditions: Conditions) -> tuple[tuple[ConditionResults, ...], ...]:
    return run_measures.grouped(conditions, _substeps)


def compared_radii(radius_conditions: Conditions, settings: ReportSettings) -> Rows:
    """Compare the largest radius with the smallest one, for every number of collision substeps."""

    def named(largest: ConditionResults, smallest: ConditionResults) -> str:
        substeps = _substeps(largest)
        tested = "" if substeps == 1 else f" (tested at {substeps} substeps)"
        return f"{KEPT}: {largest.label} against {smallest.label}{tested}"

    pairs = [(own[-1], own[0]) for own in _by_substeps(radius_conditions) if len(own) > 1]
    return compared(pairs, measures.tool_distance, settings, lower_is_better=False, named=named)


def tools(results: Results, compared_radii: Rows) -> list[Quantity]:
    """Return the row of end-effectors' distances where radii differ."""
    name, unit = f"{KEPT}, its centre line", results.with_data[0].length_unit
    return [quantity(results, name, unit, measures.tool_distance)] if compared_radii else []


def with_hall(results: Results, pairs: Sequence[tuple[str, str]]) -> Results:
    """Return the results of the methods with a hall, under all numbers."""
    treated = (c for c in results.conditions if _method(c) in dict(pairs))
    return results._replace(conditions=tuple(treated))


def _method(condition: ConditionResults) -> str:
    return condition.label.partition(", ")[0]


def _twin(results: Results, condition: ConditionResults, other: str) -> str:
    """Return the label of another treatment of the same scene under the same numbers, or "".

    Numbers of the hall are no numbers of a treatment without one: these are as assumed then.
    """
    readings = set(condition.label.split(", "))
    scene = condition.robot, condition.scenario
    twins = [c for c in results.with_data if _method(c) == other and (c.robot, c.scenario) == scene]
    alike = [c for c in twins if set(c.label.split(", ")) - {other} <= readings]
    return max((c.label for c in alike), key=lambda label: label.count(", "), default="")


def families(results: Results) -> tuple[Family, ...]:
    """Return the families of a sweep.

    Conditions that differ in collision substeps are compared with their twins; if there are none,
    all conditions with the first one that reads Eq. 9 as they do.
    """
    conditions = results.with_data
    fewest = min(_substeps(c) for c in conditions)
    finer = [c for c in conditions if _substeps(c) > fewest]
    if finer:
        firsts = {_without_substeps(c): c for c in reversed(conditions) if _substeps(c) == fewest}
        pairs = ((firsts.get(_without_substeps(c)), c) for c in finer)
        twins = tuple((first, c) for first, c in pairs if first is not None)
        return (Family("each method, tested at its configurations only,", twins),)
    return tuple(
        map(Family.of, run_measures.grouped(conditions, lambda c: c.planner.ga.mutation_direction))
    )


def sweep_measures(results: Results, threshold: float) -> Iterator[Measure]:
    """Yield the quantities that conditions are compared in."""
    to = f"to a team of cost ≤ {markdown.number(threshold)}"
    yield Measure("best cost", by_column("best_cost"))
    yield Measure(f"generations {to}", partial(measures.generations_to, threshold=threshold))
    yield Measure(measures.CERTIFIED, measures.certified_cost)
    pairs = [pair for family in families(results) for pair in family.pairs]
    if any(len({c.planner.ga.population_size for c in pair}) > 1 for pair in pairs):
        effort = partial(measures.evaluations_to, threshold=threshold)
        yield Measure(f"evaluations {to}", effort)
    is_curved = any(c.planner.interpolation == "cubic" for c in results.with_data)
    if is_curved or len({_substeps(c) for c in results.with_data}) > 1:
        yield Measure(COLLIDES, measures.refuted)


def _substeps(condition: ConditionResults) -> int:
    return int(condition.planner.collision.collision_substeps)


def _without_substeps(condition: ConditionResults) -> str:
    planner: dict[str, Any] = condition.planner.canonical()
    return repr(planner | {"collision": planner["collision"] | {"collision_substeps": None}})


class Corner(NamedTuple):
    """A reading of Eq. 9 with a mutation rate, and what may keep good individuals."""

    name: str  # "one-sided, Eq. 10"
    nothing: ConditionResults  # neither hall nor elites
    elites: tuple[ConditionResults, ...]  # with elites instead of a hall, by growing number
    halls: tuple[ConditionResults, ...]  # that never forget: of distinct genomes, then of indices
    others: tuple[ConditionResults, ...]  # other halls: those that forget, or never change


class Gain(NamedTuple):
    """A quantity whose gain is shared out."""

    name: str  # with unit where it has one
    statistic: Statistic  # (condition, (resamples, runs) numbers of runs) → its value, (resamples,)
    runs: Callable[[ConditionResults], int]  # the number of runs that count
    judged: Measure | None = None  # the quantity by which claims are judged; None: by none
    is_logarithm: bool = False  # of the quantity that tables show


class Share(NamedTuple):
    """The share of a hall's gain that elites have, too."""

    value: float  # (nothing − elites) / (nothing − hall); NaN where the hall gains nothing
    interval: Interval  # over resampled seeds; NaN where the hall's gain cannot be told from none
    n: tuple[int, ...]  # runs of nothing, elites and hall that count

    def __str__(self) -> str:
        """Return the share in words, with its interval if there is one."""
        if np.isnan(self.value):
            return "–"
        low, high = self.interval
        within = f" [{100 * low:.0f}, {100 * high:.0f}]"
        return f"{100 * self.value:.0f} %" + within * bool(np.isfinite(self.interval).any())


def corners(conditions: Sequence[ConditionResults]) -> Iterator[Corner]:
    """Group conditions that differ in hall and elites only; groups that lack one are left out."""

    def key(condition: ConditionResults) -> tuple[object, ...]:
        ga = condition.planner.ga
        return ga.mutation_direction, ga.mutation_rate, ga.mutation_decay

    def treatment(condition: ConditionResults) -> str:
        ga = condition.planner.ga
        if not ga.hall_depth:
            return "elites" if ga.num_elites else "nothing"
        return "other" if ga.hall_frozen or ga.hall_memory is not None else str(ga.hall_distinct)

    for own in run_measures.grouped(conditions, key):
        by: dict[str, list[ConditionResults]] = {}
        for c in own:
            by.setdefault(treatment(c), []).append(c)
        if {"nothing", "elites", "genome"} <= by.keys():
            elites = tuple(sorted(by["elites"], key=lambda c: int(c.planner.ga.num_elites)))
            halls = (*by["genome"][:1], *by.get("index", ())[:1])
            name, others = halls[0].label.rpartition(", ")[0], tuple(by.get("other", ()))
            yield Corner(name, by["nothing"][0], elites, halls, others)


def share(gain: Gain, compared: Sequence[ConditionResults], settings: ReportSettings) -> Share:
    """Return the share of a hall's gain that elites have, too, of (nothing, elites, hall).

    Runs of one seed are drawn together. Where more than the tail of the interval of resamples have
    no gain by the hall, the gain cannot be told from none, and there is no interval.
    """
    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    count = min(c.done for c in compared)
    draws = rng.integers(0, count, (settings.num_resamples, count))
    nothing, some, full = (gain.statistic(c, draws) for c in compared)
    gains, interval = full < nothing, Interval(np.nan, np.nan)
    if np.mean(~gains) <= 0.5 * (1.0 - settings.confidence):
        shares = _shares(nothing[gains], some[gains], full[gains])
        interval = percentiles(shares, settings.confidence)
    values = np.array([of_all_runs(gain, c) for c in compared])[:, None]
    value = float(_shares(*values)[0]) if values[2] < values[0] else np.nan
    return Share(value, interval, tuple(map(gain.runs, compared)))


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
    best, certified = by_column("best_cost"), measures.certified_cost
    done: Callable[[ConditionResults], int] = attrgetter("done")
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

    def finite(values: Callable[[ConditionResults], FloatArray]) -> Callable[..., int]:
        return lambda c: int(np.isfinite(values(c)).sum())

    runs, measured = f"{to} (expected running time)", Measure(to, effort)
    not_refuted_name = "best cost among motions that are not refuted"
    return (
        Gain("best cost", medians(best), done, Measure("best cost", best)),
        Gain(runs, log_effort, finite(effort), measured, is_logarithm=True),
        Gain(measures.CERTIFIED, medians(certified), done, Measure(measures.CERTIFIED, certified)),
        Gain(not_refuted_name, medians(not_refuted), finite(certified)),
    )


def not_refuted(condition: ConditionResults) -> FloatArray:
    """Return each run's best cost, (done,); NaN where its motion is refuted."""
    found = measures.certified_cost(condition)
    return np.where(np.isfinite(found), found, np.nan)


def of_all_runs(gain: Gain, condition: ConditionResults) -> float:
    """Return a quantity over all runs of a condition."""
    return float(gain.statistic(condition, np.arange(condition.done)[None, :])[0])


def _shares(nothing: FloatArray, some: FloatArray, full: FloatArray) -> FloatArray:
    """Return (nothing − some) / (nothing − full) of rows with full < nothing.

    Where nothing never gets there, elites explain all of it if they do, and else none.
    """
    shares = np.where(np.isfinite(some), 1.0, 0.0)
    known = np.isfinite(nothing)
    np.divide(nothing - some, nothing - full, out=shares, where=known)
    return shares


def elitism_headers(corners: Sequence[Corner]) -> tuple[str, ...]:
    """Return the headers of the columns of values, shares and runs."""
    elites = [
        f"{c.planner.ga.num_elites} elite" + "s" * (k > 0) for k, c in enumerate(corners[0].elites)
    ]
    shares = (f"share of {name}" for name in elites)
    return (*elites, "hall", *shares, f"n (nothing, {elites[-1]}, hall)")


def elitism_rows(
    corners: Sequence[Corner], gains: Sequence[Gain], settings: ReportSettings
) -> Iterator[tuple[str, ...]]:
    """Yield quantities, shares by elitism, and the runs behind them."""
    for corner, gain in itertools.product(corners, gains):
        for hall, distinct in zip(corner.halls, ("genome", "index"), strict=False):
            found = [share(gain, (corner.nothing, c, hall), settings) for c in corner.elites]
            values = [of_all_runs(gain, c) for c in (corner.nothing, *corner.elites, hall)]
            if gain.is_logarithm:
                values = np.rint(np.exp(values)).tolist()
            counts = ", ".join(map(str, found[-1].n))
            told = *map(markdown.number, values), *map(str, found)
            yield corner.name, gain.name, distinct, *told, counts


def hall_claims(judge: Judge, corners: Sequence[Corner], gains: Sequence[Gain]) -> Iterator[Claim]:
    """Judge each reading of Eq. 9 and each rate, by one quantity after the other."""
    for gain, corner in itertools.product(gains, corners):
        if gain.judged is not None:
            yield from _of_corner(judge, corner, gain, gain.judged)


def _of_corner(judge: Judge, corner: Corner, gain: Gain, measure: Measure) -> list[Claim]:
    name, values, *_ = measure
    who, (hall, *by_index) = f"{corner.name}: ", corner.halls
    over_elites = compared([(hall, c) for c in corner.elites], values, judge.settings)
    told = "; ".join(
        f"against {row.quantity} {judging.evidence(row, 'lower')}" for row in over_elites
    )
    labels = [c.label.rpartition(", ")[2] for c in corner.elites]  # the part that names the elites
    explained = ", ".join(
        f"{share(gain, (corner.nothing, c, hall), judge.settings)} ({label})"
        for c, label in zip(corner.elites, labels, strict=True)
    )
    elites = " and than ".join(labels)
    beyond = judge.on("hall_beyond_elites", who=who, elites=elites, measure=name)
    single = [("hall_helps", corner.nothing)]
    single += [("distinct_genomes", c) for c in by_index]
    single += [("frozen_hall", c) for c in corner.others if c.planner.ga.hall_frozen]
    first, *more = (
        judge.on(rule, who=who, measure=name).better(next(iter(rows), None), "lower")
        for rule, c in single
        for rows in (compared([(hall, c)], values, judge.settings),)
    )
    told += f"; share of the hall's gain over nothing: {explained}"
    return [first, beyond.better_than_all(told, over_elites), *more]


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "firsts": lambda main: main[:1],
    # bodies that stick out of boundary lines, and the length of the chromosome
    "is_enveloped": lambda first: measures.enveloped(first),
    "sticking_out": lambda conditions: (
        "; ".join(
            c.label
            for c in conditions
            if c.planner.collision.tcp_radius < c.planner.collision.half_width
        )
        or "nowhere"
    ),
    "chromosome_notes": lambda first: first.planner.notes(first.prepared.problem),
    "instants": lambda: measures.INSTANTS,
    # motions that are free, of those that the exact verdict decides
    "free_by_exact_verdict": lambda condition: Proportion(
        run_measures.certified(condition).having, condition.done - condition.verdicts.undecided
    ),
    "solved_of_all": lambda conditions: Proportion(
        sum(c.solved for c in conditions), sum(c.done for c in conditions)
    ),
    "slowest": lambda conditions: max(float(c.column("cpu_s").max()) for c in conditions),
    "solved_in_time": lambda solved_of_all, slowest, rules: (
        solved_of_all
        if slowest < rules["in_time"].limits["seconds"]
        else Proportion(0, solved_of_all.total)
    ),
    "planned_of_all": lambda results: sum(c.planned for c in results.conditions),
    # under other numbers: the method, that without a hall, and the labels of both twins
    "treatment": _method,
    "plain": lambda treatment, pairs: dict(pairs)[treatment],
    "is_printed_method": lambda treatment: treatment == METHOD,
    "plain_twin": lambda results, condition, plain: _twin(results, condition, plain),
    "elites_twin": lambda results, condition: _twin(results, condition, ELITES),
    # evaluations to a team of the threshold's cost in the condition's own scene, (done,)
    "effort": lambda condition, settings: measures.evaluations_to(
        condition, settings.threshold_ratio * measures.lower_bound(condition)
    ),
    # a larger radius forces the robots further apart
    "larger_radius": lambda judge, compared_radii: [
        judge.on("larger_radius", pair=row.quantity).better(row, "larger") for row in compared_radii
    ],
    "tool_comparisons": lambda compared_radii: (
        [("Largest against smallest radius", compared_radii)] if compared_radii else []
    ),
    # the comparisons in how fast or how far a method converges, by quantity
    "converging_rows": lambda compared: comparisons.rows_by_name(
        [one for one in compared if one.measure.name != COLLIDES]
    ),
    # the quantities by which claims are judged
    "judged_gains": lambda gains: [gain.judged for gain in gains if gain.judged is not None],
    # the hall of distinct genomes against all else of a reading and rate
    "corner_families": lambda corners: [
        Family.of((c.halls[0], c.nothing, *c.elites, *c.halls[1:], *c.others)) for c in corners
    ],
}
