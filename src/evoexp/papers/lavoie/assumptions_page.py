"""The assumed numbers of Lavoie & Boudreau 2001, and which headline claims survive others."""

from functools import partial

from evoexp.papers.lavoie import claims, measures
from evoexp.papers.lavoie.rules import RULES
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
    counted,
    generic,
    solved,
)

Controls = tuple[ConditionResults, ...]


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of assumed numbers, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    level, unit = settings.confidence, results.with_data[0].condition.length_unit
    headlines = (
        Headline(
            "share_below",
            f"position error [{unit}]",
            measures.errors,
            partial(_share_below, shipped=_by_joints(results), level=level),
        ),
        Headline(
            "no_start",
            "evaluations to a solution",
            measures.effort,
            partial(_no_start, level=level),
        ),
        Headline(
            "free_of_collision",
            f"clearance [{unit}]",
            by_column("clearance"),
            partial(_free_of_collision, level=level),
        ),
    )
    return assumptions.page(results, settings, RULES, "Lavoie & Boudreau 2001", headlines)


def _by_joints(results: Results) -> dict[int, ConditionResults]:
    """Return the condition as assumed, which is the first one, of every arm by its joints."""
    return {measures.num_joints(c): c for c in reversed(results.main)}


def _share_below(
    judge: Judge,
    condition: ConditionResults,
    controls: Controls,
    shipped: dict[int, ConditionResults],
    level: float,
) -> Claim:
    """Judge the percentage that is printed for errors below 1, the least bound.

    The percentages of the other arm, as assumed, belong to the same family of tests, so that the
    verdict as assumed is that of the experiment itself.
    """
    others = [c for joints, c in shipped.items() if joints != measures.num_joints(condition)]
    return claims.percentages(judge, [condition, *others], level)[0]


def _no_start(judge: Judge, condition: ConditionResults, controls: Controls, level: float) -> Claim:
    found = claims.no_start_needed(judge, condition, level)
    assert found is not None, "the paper prints percentages for arms of seven and of ten joints"
    return found


def _free_of_collision(
    judge: Judge, condition: ConditionResults, controls: Controls, level: float
) -> Claim:
    refuted = counted(measures.touches(condition)[solved(condition)])
    return claims.free_of_collision(judge, condition, refuted, level)
