"""The assumed numbers of Chen & Zalzala 1995, and which headline claims on paths survive others."""

from functools import partial

from evoexp.papers.chen import path_claims, path_measures
from evoexp.papers.chen.rules import RULES
from evoexp.records import FloatArray
from evoexp.report.kit import (
    Claim,
    ConditionResults,
    Headline,
    Judge,
    Page,
    ReportSettings,
    Results,
    assumptions,
    by_column,
    generic,
)

Controls = tuple[ConditionResults, ...]


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of assumed numbers, or the generic page if another planner was run."""
    if not path_measures.fits(results):
        return generic.page(results, settings)
    headlines = (
        Headline(
            "much_longer",
            "length above shortest [%]",
            partial(_excess, results),
            partial(_much_longer, results=results),
        ),
        Headline(
            "nearly_best",
            "cost above best known [%]",
            partial(_gaps, results),
            partial(_nearly_best, results=results),
        ),
        Headline(
            "path_evolution",
            "cost C",
            by_column("best_cost"),
            partial(_evolution, settings=settings),
        ),
    )
    return assumptions.page(results, settings, RULES, "Chen & Zalzala 1995", headlines)


def _truth(results: Results, condition: ConditionResults) -> ConditionResults:
    """Return the reference of the same map, potentials and weights, whatever the algorithm is."""
    return next(c for c in results.references if _problem(c) == _problem(condition))


def _problem(condition: ConditionResults) -> tuple[object, ...]:
    planner, own = condition.planner, condition.condition
    return own.robot, own.scenario, planner.objective, planner.collision, planner.revisits


def _shortest(truth: ConditionResults) -> float:
    return float(truth.array("frontier")[:, 1].min())


def _excess(results: Results, condition: ConditionResults) -> FloatArray:
    return path_claims.excess_of(condition, _shortest(_truth(results, condition)))


def _gaps(results: Results, condition: ConditionResults) -> FloatArray:
    truth = _truth(results, condition)
    return path_measures.gaps(condition, float(truth.column("best_cost")[0]))


def _much_longer(
    judge: Judge, condition: ConditionResults, controls: Controls, results: Results
) -> Claim:
    truth = _truth(results, condition)
    return path_claims.much_longer(judge, condition, condition.label, _shortest(truth), truth)


def _nearly_best(
    judge: Judge, condition: ConditionResults, controls: Controls, results: Results
) -> Claim:
    truth = _truth(results, condition)
    known, bound = (float(truth.column(name)[0]) for name in ("best_cost", "term_lower_bound"))
    return path_claims.nearly_best(judge, condition, condition.label, known, bound)


def _evolution(
    judge: Judge, condition: ConditionResults, controls: Controls, settings: ReportSettings
) -> Claim:
    return path_claims.evolution(judge, settings, condition, condition.label, controls)
