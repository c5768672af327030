"""The page of the numbers that Rana & Zalzala 1995 leave open, and the claims under others."""

import numpy as np

from evoexp.papers.rana.claims import evolution_told
from evoexp.papers.rana.drawings import AT, BETWEEN
from evoexp.papers.rana.motions import problem
from evoexp.papers.rana.rules import RULES
from evoexp.records import FloatArray
from evoexp.report.kit import (
    Claim,
    ConditionResults,
    Judge,
    Page,
    ReportSettings,
    Results,
    assumptions,
    by_column,
    markdown,
)

SOURCE = "sections 3.5 and 4.2"


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the paper's assumptions."""

    def evolution(
        judge: Judge, condition: ConditionResults, controls: tuple[ConditionResults, ...]
    ) -> Claim:
        told, rows = evolution_told(condition, controls, settings)
        return judge.on("evolution_adds", who="").better_than_all(told, rows)

    headlines = (
        assumptions.Headline(
            "free_at_via_points",
            "colliding instants C5",
            by_column("term_collisions"),
            _free,
        ),
        assumptions.Headline(
            "safety_between_via_points",
            "least distance of centres over the safety distance [-]",
            _kept_share,
            _safe,
        ),
        assumptions.Headline("evolution_adds", "fitness F", by_column("term_fitness"), evolution),
    )
    return assumptions.page(results, settings, RULES, "Rana & Zalzala 1995", headlines)


def _free(
    judge: Judge, condition: ConditionResults, controls: tuple[ConditionResults, ...]
) -> Claim:
    c = condition
    told = f"{markdown.share(c.solved, c.done)} finished runs of {c.planned} planned"
    hearing = judge.on("free_at_via_points", who="", source=SOURCE)
    return hearing.every(told, c.solved, c.done, c.planned)


def _kept_share(condition: ConditionResults) -> FloatArray:
    """Return the least distance of centres between via-points in units of the safety distance."""
    return np.asarray(condition.column(BETWEEN) / problem(condition).security_margin)


def _safe(
    judge: Judge, condition: ConditionResults, controls: tuple[ConditionResults, ...]
) -> Claim:
    c, values = condition, _kept_share(condition)
    safe = int(np.count_nonzero(values >= 1.0))
    told = (
        f"{markdown.share(safe, c.done)} runs never below it; least "
        f"{markdown.number(float(np.min(values)))} times, at via-points "
        f"{markdown.number(float(np.min(c.column(AT))) / problem(c).security_margin)} times"
    )
    hearing = judge.on("safety_between_via_points", who="", source=SOURCE)
    return hearing.every(told, safe, c.done, c.planned)
