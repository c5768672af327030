"""The numbers that Corsépius 2001 does not print, and which headline claims survive others."""

import numpy as np

from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius.rules import PAPER, RULES
from evoexp.records import FloatArray
from evoexp.report.kit import (
    ConditionResults,
    Headline,
    Page,
    ReportSettings,
    Results,
    assumptions,
    by_column,
    solved,
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the assumed numbers."""
    level = settings.confidence
    headlines = (
        Headline(
            "goals_met",
            "cycles to the goal [-]",
            cycles_to_goal,
            lambda judge, c, _: claims.judge_met(judge, c, level),
        ),
        Headline(
            "paths_avoid_obstacles",
            "least distance [m]",
            by_column("clearance"),
            lambda judge, c, _: claims.judge_free(judge, c, level),
        ),
    )
    return assumptions.page(results, settings, RULES, PAPER.name, headlines)


def cycles_to_goal(condition: ConditionResults) -> FloatArray:
    """Return the cycles of each run that meets its goal, (done,); inf without it."""
    return np.where(solved(condition), measures.cycles(condition), np.inf)
