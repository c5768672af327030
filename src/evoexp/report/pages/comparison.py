"""The page of `evoexp compare`: planners in one currency, by their proven answers alone."""

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from evoexp.errors import NothingStored
from evoexp.planners.answers import num_body_tests
from evoexp.records import FloatArray
from evoexp.report.figures.effort_curves import MAX_PANELS, problem_order
from evoexp.report.pages import markdown, ranking
from evoexp.report.pages.page_builder import own_page
from evoexp.report.pages.page_parts import Page
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.best_known import shipped_best_known
from evoexp.report.results.given_data import MARK, GivenData
from evoexp.report.results.planner_runs import PlannerRuns, Problem, of_results, stored_conditions
from evoexp.report.results.proven_answers import first_reached
from evoexp.report.results.run_measures import search_seconds
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Comparison, compared
from evoexp.report.statistics.inference import (
    Interval,
    Proportion,
    Spread,
    expected_effort,
    expected_interval,
    quantile,
    spread,
)
from evoexp.report.statistics.problem_ranks import standing


class Rated(NamedTuple):
    """A condition, rated by the proven answers of its runs."""

    condition: str  # its label
    planner: str  # its name in figures
    problem: str  # name of the problem
    runs: int  # that are finished
    proven: int  # runs with a proven answer
    # Median of the queries to the first answer that the planner's own model accepts
    first_own: float
    queries: float  # expected running time to a proven answer [collision queries]
    interval: Interval  # of it, by bootstrap
    lengths: Spread  # best proven length of a run: median and quartiles [rad, m]
    straight: float  # distance from start to goal; NaN where goals differ
    # Length of the shortest proven answer known of the problem; NaN: none is stored
    best_known: float
    unit: float  # the one of both that targets are multiples of; NaN: any answer is the only target
    refuted: int  # last solutions that the planner's own model accepts and the certifier refutes
    judged: int  # last solutions that were judged
    # Pairs of shapes that one collision query stands for; NaN: not known
    body_tests: float = np.nan
    evaluations: float = np.nan  # expected evaluations to a proven answer
    cpu_s: float = np.nan  # expected CPU time to a proven answer [s]
    # The planner's own cost of its last solution: median and quartiles over runs
    own_cost: Spread = Spread(np.nan, np.nan, np.nan, 0)

    @property
    def in_units(self) -> Spread:
        """The lengths in units of the targets."""
        median, lower, upper, count = self.lengths
        return Spread(median / self.unit, lower / self.unit, upper / self.unit, count)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page.

    Raises:
        NothingStored: If no run has a motion.
    """
    known = {key: each.length for key, each in shipped_best_known().items()}
    return page_of_runs(of_results(results.evolved, known), results, settings)


def page_of_runs(
    runs: Sequence[PlannerRuns],
    results: Results,
    settings: ReportSettings,
    given: GivenData | None = None,
) -> Page:
    """Build the page from runs that are judged already.

    Raises:
        NothingStored: If there are none.
    """
    if not runs:
        raise NothingStored(f"{results.experiment or 'compare'}: no stored solution is a motion")
    ranks, rows = standing(runs), rated(runs, settings)
    num_problems, ranked = len(problem_order(runs)), set(ranks.problems)
    first = f" The first {MAX_PANELS} of {num_problems}; the CSV has all."
    return own_page(
        "comparison",
        results,
        settings,
        runs=runs,
        given_words=_of_file(given) if given else "",
        problem_rows=tuple(_problem_rows(runs)),
        too_few_ranks=ranking.too_few(ranks),
        answer_rows=tuple(_answers(rows, settings)),
        coin_rows=tuple(_coins(rows)),
        compared_lengths=_comparisons(runs, settings),
        compared_conditions=stored_conditions(runs),
        unequal=_unequal(runs),
        one_problem=num_problems == 1,
        more_problems=num_problems > 1,
        more_panels=first * (num_problems > MAX_PANELS),
        ranks=ranks,
        rank_rows=ranking.rank_rows(ranks),
        left_out=ranking.left_out(ranks),
        rank_test=ranking.rank_test(ranks, settings),
        never_proven=ranking.never_proven(ranks),
        num_ranked=len(ranks.problems),
        ranked_conditions=stored_conditions(own for own in runs if own.problem.name in ranked),
    )


def _of_file(given: GivenData) -> str:
    """Say whose word the given answers are."""
    return (
        f" Planners marked{MARK} were not run here: their answers count as {given.name} "
        f"(SHA-256 {given.sha256[:12]}…) tells them, the certifier has not seen them, and as seeds "
        "are not common they are not compared pair by pair."
    )


def _unequal(runs: Sequence[PlannerRuns]) -> str:
    """Warn where planners were run on different problems; empty if all were run on the same."""
    problems: dict[str, set[str]] = {}
    for own in runs:
        problems.setdefault(own.planner, set()).add(own.problem.name)
    if len({frozenset(names) for names in problems.values()}) == 1:
        return ""
    return (
        " Each planner's curve is over the problems that it was run on, which are not the same for "
        "all: compare them problem by problem. In brackets: targets of those run on fewer."
    )


def rated(runs: Sequence[PlannerRuns], settings: ReportSettings) -> list[Rated]:
    """Return the conditions that have motions, rated by their proven answers."""
    return [_rated(own, settings) for own in runs]


def _rated(own: PlannerRuns, settings: ReportSettings) -> Rated:
    effort, reached = own.first_reached()
    verdicts = own.condition.verdicts if own.condition else None
    found = Rated(
        own.label,
        own.planner,
        own.problem.name,
        len(own.replicates),
        int(reached.sum()),
        _first_own(own),
        expected_effort(effort, reached),
        expected_interval(effort, reached, settings.confidence, settings.num_resamples),
        spread(own.best_lengths),
        own.problem.straight,
        own.problem.best_known,
        own.problem.unit,
        verdicts.solved_refuted if verdicts else 0,
        verdicts.judged if verdicts else 0,
    )
    return found if own.condition is None else _in_other_coins(found, own, own.condition)


def _in_other_coins(row: Rated, own: PlannerRuns, condition: ConditionResults) -> Rated:
    """Add tests of bodies, evaluations and CPU time to an answer, and the planner's own cost."""

    def to_an_answer(name: str, spent: FloatArray) -> float:
        if own.table[name].isna().any():
            return np.nan
        effort, reached = first_reached(own.table, own.replicates, np.inf, spent, name)
        return expected_effort(effort, reached)

    _, problem = condition.prepared
    return row._replace(
        body_tests=num_body_tests(problem),
        evaluations=to_an_answer("evaluations", condition.column("evaluations")),
        cpu_s=to_an_answer("cpu_s", search_seconds(condition)),
        own_cost=spread(condition.column("best_cost")),
    )


def _first_own(own: PlannerRuns) -> float:
    """Return the median effort to an answer that the planner's own model accepts; NaN: unknown."""
    if own.condition is None:
        return np.nan
    good = own.table[own.table["solved"].astype(bool)]
    first = good.groupby("replicate")["collision_queries"].min().reindex(list(own.replicates))
    return quantile(first.to_numpy(np.float64, na_value=np.inf), 0.5)


def _problem_rows(runs: Sequence[PlannerRuns]) -> Iterator[tuple[str, ...]]:
    """Yield of each problem the lengths that answers are measured by."""
    found: dict[str, tuple[Problem, list[float]]] = {}
    for own in runs:
        best = found.setdefault(own.problem.name, (own.problem, []))[1]
        best.append(float(own.best_lengths.min()))
    for name, (problem, best) in found.items():
        lengths = map(markdown.number, (problem.straight, problem.best_known, min(best)))
        yield name, f"`{problem.key}`" if problem.key else "–", *lengths, problem.unit_name


def _answers(rows: Sequence[Rated], settings: ReportSettings) -> Iterator[tuple[object, ...]]:
    """Yield each condition's proven answers: how many, their effort and their lengths."""
    for row in rows:
        yield (
            row.condition,
            row.runs,
            Proportion(row.proven, row.runs).with_interval(settings.confidence, 0),
            markdown.number(row.first_own),
            f"{effort_text(row.queries)} ({' to '.join(map(effort_text, row.interval))})",
            markdown.spread(row.lengths),
            markdown.spread(row.in_units) if row.unit > 0.0 else "–",
            f"{row.refuted} of {row.judged}" if row.judged else "–",
        )


def _coins(rows: Sequence[Rated]) -> Iterator[tuple[str, ...]]:
    """Yield the effort of each condition that was run here, counted in other ways."""
    for row in rows:
        if row.own_cost.num_values:
            yield (
                row.condition,
                markdown.number(row.body_tests),
                effort_text(row.queries * row.body_tests),
                effort_text(row.evaluations),
                markdown.number(row.cpu_s),
                markdown.spread(row.own_cost),
            )


def effort_text(queries: float) -> str:
    """Return a number of collision queries as a whole number; inf and NaN as `markdown.number`."""
    return markdown.number(round(queries) if np.isfinite(queries) else queries)


def _comparisons(
    runs: Sequence[PlannerRuns], settings: ReportSettings
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare the planners of each problem."""
    stored = [(own, own.condition) for own in runs if own.condition is not None]
    by_label = {own.label: own for own, _ in stored}
    pairs = [
        (first, second)
        for (a, first), (b, second) in itertools.combinations(stored, 2)
        if a.problem == b.problem
    ]

    def lengths(condition: ConditionResults) -> FloatArray:
        return by_label[condition.label].best_lengths

    rows = compared(pairs, lengths, settings, named=lambda a, b: f"{a.label} – {b.label}")
    return (("best proven length", rows),) if rows else ()
