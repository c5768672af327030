"""The numbers that Corsépius 2001 does not print, and which headline claims survive others."""

from functools import partial

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


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the assumed numbers."""
    level, distance = settings.confidence, by_column("clearance")
    met, free = partial(judge_met, level=level), partial(judge_free, level=level)
    headlines = (
        Headline("goals_met", "cycles to the goal [-]", cycles_to_goal, met),
        Headline("paths_avoid_obstacles", "least distance [m]", distance, free),
    )
    return assumptions.page(results, settings, RULES, "Corsépius 2001", headlines)


def cycles_to_goal(condition: ConditionResults) -> FloatArray:
    """Return the cycles of each run that meets its goal, (done,); inf without it."""
    return np.where(solved(condition), measures.cycles(condition), np.inf)


def judge_met(
    judge: Judge, condition: ConditionResults, _: tuple[ConditionResults, ...], level: float
) -> Claim:
    """Judge that goals are met."""
    return claims.judge_met(judge, condition, level)


def judge_free(
    judge: Judge, condition: ConditionResults, _: tuple[ConditionResults, ...], level: float
) -> Claim:
    """Judge that the paths to the goals avoid obstacles."""
    return claims.judge_free(judge, condition, level)
