"""The assumed numbers of Chen & Zalzala 1995, and which headline claims on paths survive others."""

from evoexp.papers.chen import path_claims
from evoexp.papers.chen.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import assumptions, generic


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of assumed numbers, or the generic page if another planner was run."""
    if not path_claims.fits(results):
        return generic.page(results, settings)

    def truth(condition: kit.ConditionResults) -> kit.ConditionResults:
        """Return the reference of the same map, potentials and weights, of any algorithm."""
        return next(c for c in results.references if _problem(c) == _problem(condition))

    def shortest(condition: kit.ConditionResults) -> float:
        return float(truth(condition).array("frontier")[:, 1].min())

    def known(condition: kit.ConditionResults, column: str = "best_cost") -> float:
        return float(truth(condition).column(column)[0])

    headlines = (
        kit.Headline(
            "much_longer",
            "length above shortest [%]",
            lambda c: path_claims.excess_of(c, shortest(c)),
            lambda judge, c, _: path_claims.much_longer(judge, c, shortest(c), truth(c)),
        ),
        kit.Headline(
            "nearly_best",
            "cost above best known [%]",
            lambda c: path_claims.gaps(c, known(c)),
            lambda judge, c, _: path_claims.nearly_best(
                judge, c, known(c), known(c, "term_lower_bound")
            ),
        ),
        kit.Headline(
            "path_evolution",
            "cost C",
            kit.by_column("best_cost"),
            path_claims.evolution,
        ),
    )
    return assumptions.page(results, settings, RULES, PAPER.name, headlines)


def _problem(condition: kit.ConditionResults) -> tuple[object, ...]:
    planner, own = condition.planner, condition.condition
    return own.robot, own.scenario, planner.objective, planner.collision, planner.revisits
