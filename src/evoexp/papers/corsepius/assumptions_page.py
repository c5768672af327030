"""The numbers that Corsépius 2001 does not print, and which headline claims survive others."""

import numpy as np

from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius.rules import RULES
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
    solved,
)

LEVEL = 0.95  # of the intervals in the evidence


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the assumed numbers."""
    return assumptions.page(
        results,
        settings,
        RULES,
        "Corsépius 2001",
        (
            Headline("goals_met", "cycles to the goal [-]", cycles_to_goal, judge_met),
            Headline(
                "paths_avoid_obstacles", "least distance [m]", by_column("clearance"), judge_free
            ),
        ),
    )


def cycles_to_goal(condition: ConditionResults) -> FloatArray:
    """Return the cycles of each run that meets its goal, (done,); inf without it."""
    return np.where(solved(condition), measures.cycles(condition), np.inf)


def judge_met(judge: Judge, condition: ConditionResults, _: tuple[ConditionResults, ...]) -> Claim:
    """Judge that goals are met."""
    return claims.judge_met(judge, condition, LEVEL)


def judge_free(judge: Judge, condition: ConditionResults, _: tuple[ConditionResults, ...]) -> Claim:
    """Judge that the paths to the goals avoid obstacles."""
    return claims.judge_free(judge, condition, LEVEL)
