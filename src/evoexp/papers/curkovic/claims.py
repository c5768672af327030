"""The claims of Curkovic et al. 2013 on methods and motions, and under assumed numbers."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from evoexp.papers.curkovic import measures
from evoexp.planners.coevolution.planner import Problem
from evoexp.report.pages.page_parts import Claim, Quantity, quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Comparison, compared
from evoexp.report.statistics.inference import Proportion
from evoexp.report.statistics.judging import Judge

Rows = tuple[Comparison, ...]
Conditions = Sequence[ConditionResults]
METHOD, ELITES = "V", "15 elites"
KEPT = "least distance of an end-effector from another robot's links"


def radius_conditions(results: Results) -> tuple[ConditionResults, ...]:
    """Return conditions by collision substeps and growing radius; none if no radius differs."""
    by_radius = sorted(results.main, key=lambda c: float(c.planner.collision.tcp_radius))
    differ = len({c.planner.collision.tcp_radius for c in by_radius}) > 1
    return tuple(itertools.chain(*_by_substeps(by_radius))) if differ else ()


def _by_substeps(conditions: Conditions) -> tuple[tuple[ConditionResults, ...], ...]:
    return run_measures.grouped(conditions, lambda c: c.planner.collision.collision_substeps)


def compared_radii(radius_conditions: Conditions, settings: ReportSettings) -> Rows:
    """Compare the largest radius with the smallest one, for every number of collision substeps."""

    def named(largest: ConditionResults, smallest: ConditionResults) -> str:
        substeps = largest.planner.collision.collision_substeps
        tested = "" if substeps == 1 else f" (tested at {substeps} substeps)"
        return f"{KEPT}: {largest.label} against {smallest.label}{tested}"

    pairs = [(own[-1], own[0]) for own in _by_substeps(radius_conditions) if len(own) > 1]
    return compared(pairs, measures.tool_distance, settings, lower_is_better=False, named=named)


def tool_comparisons(compared_radii: Rows) -> list[tuple[str, Rows]]:
    """Return (heading, comparisons) of radii."""
    return [("Largest against smallest radius", compared_radii)] if compared_radii else []


def tools(results: Results, compared_radii: Rows) -> list[Quantity]:
    """Return the row of end-effectors' distances where radii differ."""
    name = f"{KEPT}, its centre line"
    unit = results.with_data[0].length_unit
    row = quantity(results, name, unit, measures.tool_distance) if compared_radii else None
    return [row] if row else []


def enveloped(condition: ConditionResults) -> bool:
    """Return whether the search tests more of the robots than their lines."""
    collision = condition.planner.collision
    return bool(collision.half_width > 0.0 or collision.tcp_radius > 0.0)


def kinds(condition: ConditionResults, radius_conditions: Conditions) -> dict[str, bool]:
    """Tell what a scene is: `many` robots, one `still`, two of `thick` bodies or `crossing` lines.

    Figs. 8 and 9 (`fig_8`) show two robots of one radius; `other` are motions of no figure.
    """
    problem = condition.problem(Problem)
    many, all_move = len(problem.start) > 2, bool(problem.moving.all())
    two, thick = all_move and not many, enveloped(condition)
    found = {"many": many, "still": not (many or all_move), "fig_8": two and not radius_conditions}
    found |= {"thick": two and thick, "crossing": two and not thick}
    return found | {"other": not (found["still"] or found["fig_8"])}


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


def larger_radius(judge: Judge, compared_radii: Rows) -> Iterator[Claim]:
    """Judge that a larger radius forces the robots further apart."""
    for row in compared_radii:
        yield judge.on("larger_radius", pair=row.quantity).better(row, "larger")


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "firsts": lambda main: main[:1],
    # bodies that stick out of boundary lines, and the length of the chromosome
    "is_enveloped": lambda first: enveloped(first),
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
    "refuted_motions": lambda defects: defects.refuted,
}
