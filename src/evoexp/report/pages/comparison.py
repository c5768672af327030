"""The page of `evoexp compare`: planners in one currency, by their proven answers alone.

The functions give what the page `comparison` of `page.yaml` names.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evoexp.errors import NothingStored
from evoexp.planners.answers import num_body_tests
from evoexp.report.figures import effort_curves
from evoexp.report.pages import markdown
from evoexp.report.pages.page_builder import own_page
from evoexp.report.pages.page_parts import Page
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.comparison_files import GivenData, shipped_best_known
from evoexp.report.results.planner_runs import PlannerRuns, Problem, of_results, stored_conditions
from evoexp.report.results.run_measures import counted, search_seconds
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference
from evoexp.report.statistics.comparisons import Comparison, adjusted, compare

CSV_COLUMNS = [
    *("planner", "problem", "n", "proven", "effort", "effort_low", "effort_high"),
    *("length", "length_lower", "length_upper", "body_queries", "evaluations", "cpu_s"),
]


NO_VALUES = inference.Spread(np.nan, np.nan, np.nan, 0)


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
    interval: inference.Interval  # of it, by bootstrap
    lengths: inference.Spread  # best proven length of a run: median and quartiles [rad, m]
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
    own_cost: inference.Spread = NO_VALUES

    @property
    def share(self) -> inference.Proportion:
        """The runs with a proven answer, of all."""
        return inference.Proportion(self.proven, self.runs)

    @property
    def in_units(self) -> inference.Spread:
        """Lengths in units of the targets, if there is a unit."""
        median, lower, upper, count = self.lengths
        units = median / self.unit, lower / self.unit, upper / self.unit, count
        return inference.Spread(*units) if self.unit > 0.0 else NO_VALUES

    @property
    def body_queries(self) -> float:
        """Expected pairs of shapes that are compared up to a proven answer."""
        return self.queries * self.body_tests


def page(
    results: Results,
    settings: ReportSettings,
    runs: Sequence[PlannerRuns] | None = None,
    given: GivenData | None = None,
) -> Page:
    """Build the page, of runs that are judged already or of all results.

    Raises:
        NothingStored: If no run has a motion.
    """
    if runs is None:
        known = {key: each.length for key, each in shipped_best_known().items()}
        runs = of_results(results.evolved, known)
    if not runs:
        raise NothingStored(f"{results.experiment or 'compare'}: no stored solution is a motion")
    return own_page("comparison", results, settings, runs=runs, given=given)


ranks = effort_curves.standing
compared_conditions = stored_conditions


def rated(runs: Sequence[PlannerRuns], settings: ReportSettings) -> Iterator[Rated]:
    """Yield the conditions that have motions, rated by their proven answers."""
    for own in runs:
        effort, reached = own.first_reached()
        levels = settings.confidence, settings.num_resamples
        row = Rated(
            condition=own.label,
            planner=own.planner,
            problem=own.problem.name,
            runs=len(own.replicates),
            proven=int(reached.sum()),
            first_own=np.nan,
            queries=inference.expected_effort(effort, reached),
            interval=inference.expected_interval(effort, reached, *levels),
            lengths=inference.spread(own.best_lengths),
            straight=own.problem.straight,
            best_known=own.problem.best_known,
            unit=own.problem.unit,
            refuted=own.condition.verdicts.solved_refuted if own.condition else 0,
            judged=own.condition.verdicts.judged if own.condition else 0,
        )
        yield row if own.condition is None else _with_coins(row, own, own.condition)


def _with_coins(row: Rated, own: PlannerRuns, condition: ConditionResults) -> Rated:
    """Return a row with what only runs tell that were run here."""
    solved = own.table[own.table["solved"].astype(bool)]
    first = solved.groupby("replicate")["collision_queries"].min().reindex(list(own.replicates))
    spent = {"evaluations": condition.column("evaluations"), "cpu_s": search_seconds(condition)}
    per_answer: dict[str, Any] = {
        name: inference.expected_effort(*own.first_reached(effort=name, spent=whole))
        for name, whole in spent.items()
        if not own.table[name].isna().any()
    }
    return row._replace(
        first_own=inference.quantile(first.to_numpy(np.float64, na_value=np.inf), 0.5),
        body_tests=num_body_tests(condition.prepared.problem),
        own_cost=inference.spread(condition.column("best_cost")),
        **per_answer,
    )


def problem_rows(runs: Sequence[PlannerRuns]) -> Iterator[tuple[str, ...]]:
    """Yield of each problem the lengths that answers are measured by."""
    found: dict[str, tuple[Problem, list[float]]] = {}
    for own in runs:
        best = found.setdefault(own.problem.name, (own.problem, []))[1]
        best.append(float(own.best_lengths.min()))
    for name, (problem, best) in found.items():
        lengths = map(markdown.number, (problem.straight, problem.best_known, min(best)))
        unit = "straight line" if np.isnan(problem.best_known) else "best known"
        if np.isnan(problem.unit):
            unit = "none: any proven answer is the only target"
        yield name, f"`{problem.key}`" if problem.key else "–", *lengths, unit


def compared_lengths(
    runs: Sequence[PlannerRuns], settings: ReportSettings
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare the planners of each problem that were run here."""
    rows = [
        compare(f"{a.label} – {b.label}", a.best_lengths, b.best_lengths, True, settings.confidence)
        for a, b in itertools.combinations([own for own in runs if own.condition is not None], 2)
        if a.problem == b.problem
    ]
    return (("best proven length", tuple(adjusted(rows))),) if rows else ()


def rank_rows(ranks: effort_curves.Standing) -> list[tuple[str, ...]]:
    """Return mean ranks, best first; none where there is but one planner, or one problem."""
    if not ranks.can_be_profiled:
        return []
    lengths = ranks.lengths
    best = (lengths == lengths.min(axis=1, keepdims=True)) & np.isfinite(lengths)
    having = best, np.isfinite(lengths), np.isfinite(ranks.efforts)
    counts = [[str(counted(column)) for column in holds.T] for holds in having]
    rows = zip(ranks.mean_ranks, ranks.planners, *counts, strict=True)
    ordered = sorted(rows, key=itemgetter(0))
    return [(planner, f"{rank:.2f}", *numbers) for rank, planner, *numbers in ordered]


def as_csv(rows: Sequence[Rated]) -> bytes:
    """Return the answers as CSV, numbers with all digits, `inf` where there is no proven answer.

    Efforts are expected to a proven answer, in collision queries with their interval, in pairs of
    shapes (body_queries), evaluations and CPU time; unknown ones are empty.
    """
    answers = [
        (
            *(row.planner, row.problem, row.runs, row.proven, row.queries, *row.interval),
            *(*row.lengths[:3], row.body_queries, row.evaluations, row.cpu_s),
        )
        for row in rows
    ]
    table = pd.DataFrame(answers, columns=CSV_COLUMNS)
    return table.to_csv(index=False, lineterminator="\n").encode()


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # conditions of problems that count for ranks
    "ranked_conditions": lambda runs, ranks: stored_conditions(
        own for own in runs if own.problem.name in ranks.problems
    ),
    "num_problems": lambda runs: len(effort_curves.problem_order(runs)),
    "one_problem": lambda num_problems: num_problems == 1,
    # some problems have no panel
    "hidden_problems": lambda num_problems: num_problems > effort_curves.MAX_PANELS,
    # planners were run on different problems
    "unequal": lambda runs: (
        len({frozenset(b.problem.name for b in runs if b.planner == a.planner) for a in runs}) > 1
    ),
    "left_out": lambda ranks: ", ".join(ranks.left_out),
    "outsiders": lambda ranks: ", ".join(ranks.outsiders),
    "friedman_test": lambda ranks: effort_curves.friedman(ranks.lengths),
    "ranks_differ": lambda ranks, settings: (
        ranks.can_be_tested
        and effort_curves.friedman(ranks.lengths).p_value < settings.significance
    ),
    "ranks_are_alike": lambda ranks, ranks_differ: ranks.can_be_tested and not ranks_differ,
    "nemenyi": lambda ranks, settings: effort_curves.critical_difference(
        len(ranks.planners), len(ranks.problems), settings.significance
    ),
    # problems that no planner has a proven answer on
    "never_proven": lambda ranks: int(np.isinf(ranks.efforts).all(axis=1).sum()),
}
