"""The numbers that Corsépius 2001 does not print, and which headline claims survive others."""

from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import assumptions


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the assumed numbers."""
    headlines = (
        kit.Headline(
            "goals_met",
            "cycles to the goal [-]",
            kit.where_solved(measures.cycles),
            lambda judge, c, _: claims.judge_met(judge, c),
        ),
        kit.Headline(
            "paths_avoid_obstacles",
            "least distance [m]",
            kit.by_column("clearance"),
            lambda judge, c, _: claims.judge_free(judge, c),
        ),
    )
    return assumptions.page(results, settings, RULES, PAPER.name, headlines)
