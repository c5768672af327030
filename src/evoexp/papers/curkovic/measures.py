"""What the pages on Curkovic et al.

2013 measure alike: effort to a threshold, known defects, whether to judge.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from evoexp.papers.curkovic import link_motions
from evoexp.records import FloatArray
from evoexp.report import markdown
from evoexp.report.figures import convergence
from evoexp.report.page import Drawing, Quantity
from evoexp.report.pages import generic
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import Interval, quantile, wilson

ROUNDING = 1e-9  # [deg] a curve may leave the range by this much and still touch its end
REFUTED = "collides between its configurations (exact verdict)"
LEAVES = "executed curve leaves [0, π]"
TOO_FAST = "a link is faster than Eq. 2 allows"


class Rate(NamedTuple):
    """How many of a condition's solved motions have a defect."""

    defect: str
    failing: int
    solved: int

    def interval(self, confidence: float) -> Interval:
        """Return Wilson's interval of the share."""
        return wilson(self.failing, self.solved, confidence)


def fits(results: Results) -> bool:
    """Whether there are results, and all of co-evolving robots."""
    return bool(results.with_data) and all(
        hasattr(c.prepared.problem, "moving") for c in results.with_data
    )


def lower_bound(condition: ConditionResults) -> float:
    """Return a lower bound of a team's cost.

    Straight end-effector paths, least turns, no unevenness.
    """
    problem, objective = condition.prepared.problem, condition.planner.objective
    total = 0.0
    for arm, start, goal in zip(problem.collision.arms, problem.start, problem.goal, strict=True):
        tips = [
            arm.points(np.ascontiguousarray(q.reshape(1, 2, 1)))[0, 2:, 0] for q in (start, goal)
        ]
        path = float(np.sqrt(np.sum((tips[1] - tips[0]) ** 2)))
        total += objective.path_weight * path + objective.rotation_weight * float(
            np.sum(np.abs(goal - start))
        )
    return total


def generations_to(condition: ConditionResults, threshold: float) -> FloatArray:
    """Return the first generation with a team at or below a cost, per replicate (done,).

    Inf if there is none.
    """
    return _first(condition, threshold, "index")


def evaluations_to(condition: ConditionResults, threshold: float) -> FloatArray:
    """Return the evaluations until there is a team at or below a cost, per replicate (done,).

    Inf if there is none.
    """
    return _first(condition, threshold, "evaluations")


def expected_evaluations(condition: ConditionResults, threshold: float) -> float:
    """Return the expected running time in evaluations.

    All that were spent, over the runs that got there.
    """
    first = evaluations_to(condition, threshold)
    reached = np.isfinite(first)
    spent = np.where(reached, first, condition.column("evaluations"))
    return float(spent.sum() / reached.sum()) if reached.any() else np.inf


def expected_seconds(condition: ConditionResults, threshold: float) -> float:
    """Return the same in seconds of CPU time.

    At what an evaluation costs in the median run's search.
    """
    searching = condition.column("cpu_s") - condition.column("certificate_s")
    price = quantile(searching / condition.column("evaluations"), 0.5)
    return expected_evaluations(condition, threshold) * price


def effort_quantities(results: Results, threshold: float) -> tuple[Quantity, ...]:
    """Return what it takes to get to a team at or below a cost: rows of the table of results."""
    row, to = partial(generic.quantity, results), f"team of cost ≤ {markdown.number(threshold)}"
    expected = f"to a {to}, failures included (expected running time)"
    return (
        row(f"generations to a {to}", "generation", lambda c: generations_to(c, threshold)),
        row(f"evaluations to a {to}", "–", lambda c: evaluations_to(c, threshold)),
        row(
            f"evaluations {expected}", "–", lambda c: np.rint([expected_evaluations(c, threshold)])
        ),
        row(
            f"CPU time of the search {expected}",
            "s",
            lambda c: np.array([expected_seconds(c, threshold)]),
        ),
    )


def team_quantities(results: Results, threshold: float, *more: Quantity) -> tuple[Quantity, ...]:
    """Return the rows of the table of results that methods and sweeps share.

    `more` ones follow the clearance.
    """
    row = partial(generic.quantity, results)
    cost, _, *effort = generic.quantities(results)
    unit = results.with_data[0].condition.length_unit
    return (
        cost._replace(name="best cost of a collision-free team"),
        *effort_quantities(results, threshold),
        row(
            "clearance of the bodies over the whole motion (exact)",
            unit,
            generic.by_column("clearance"),
        ),
        *more,
        *effort,
        row("CPU time of a run", "s", generic.by_column("cpu_s")),
    )


def convergence_drawing(results: Results, more: str = "") -> Drawing:
    """Return the figure of the best cost only.

    That of an average individual, full of collisions, would hide it.
    """
    caption = f"Median of the best cost so far over replicates. Lower is better.{more}"
    table = partial(convergence.cost_table, results)
    return Drawing(
        "convergence", "Convergence", caption, table, convergence.draw_best, results.with_data
    )


def refuted(condition: ConditionResults) -> FloatArray:
    """Return whether the exact verdict refutes each replicate's motion, (done,) 0 or 1.

    NaN where nothing is solved.
    """
    found = condition.summaries["certified"].eq(False).fillna(False).to_numpy(dtype=np.float64)
    return np.where(_solved(condition), found, np.nan)


def rates(condition: ConditionResults) -> tuple[Rate, ...]:
    """Count the known defects among a condition's solved motions."""
    solved = _solved(condition)
    columns = [name for name in condition.summaries if str(name).startswith("term_out_of_range")]
    beyond = (
        np.max([condition.column(str(name)) for name in columns], axis=0)
        if columns
        else np.zeros(condition.done)
    )
    found = (
        (REFUTED, refuted(condition) == 1.0),
        (LEAVES, beyond > ROUNDING),
        (TOO_FAST, times_over_limit(condition) > 1.0),
    )
    return tuple(
        Rate(name, int(np.count_nonzero(has & solved)), int(solved.sum())) for name, has in found
    )


def times_over_limit(condition: ConditionResults) -> FloatArray:
    """Return each replicate's greatest speed of a link over what Eq. 2 allows it, (done,) [-]."""
    prepared = condition.prepared
    solutions = [condition.solutions[int(k)] for k in condition.summaries.index]
    return np.array([link_motions.times_over_limit(prepared, solution) for solution in solutions])


def rates_text(results: Results, which: int) -> str:
    """Return one defect's counts of all conditions: "I: 9 of 20; II: …"."""
    found = ((c.label, rates(c)[which]) for c in results.with_data)
    return "; ".join(
        f"{label}: {markdown.share(rate.failing, rate.solved)}" for label, rate in found
    )


def _solved(condition: ConditionResults) -> np.ndarray:
    return condition.summaries["solved"].to_numpy(dtype=bool)


def _first(condition: ConditionResults, threshold: float, column: str) -> FloatArray:
    rows = condition.generations
    first = rows[rows["best_cost"] <= threshold].groupby("replicate")[column].min()
    return first.reindex(condition.summaries.index).fillna(np.inf).to_numpy(np.float64)
