"""The page of the numbers that Rana & Zalzala 1995 leave open, and the claims under others."""

import numpy as np

from evoexp.papers.rana.measures import evolution_told
from evoexp.papers.rana.motions import problem
from evoexp.papers.rana.page import AT, BETWEEN
from evoexp.papers.rana.rules import PAPER, RULES
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import assumptions, markdown

SOURCE = "sections 3.5 and 4.2"
Controls = tuple[kit.ConditionResults, ...]


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the paper's assumptions."""
    safety = "least distance of centres over the safety distance [-]"
    hits = kit.by_column("term_collisions")
    headlines = (
        kit.Headline("free_at_via_points", "colliding instants C5", hits, _free),
        kit.Headline("safety_between_via_points", safety, _kept_share, _safe),
        kit.Headline("evolution_adds", "fitness F", kit.by_column("term_fitness"), _evolution),
    )
    return assumptions.page(results, settings, RULES, PAPER.name, headlines)


def _free(judge: kit.Judge, c: kit.ConditionResults, _: Controls) -> kit.Claim:
    told = f"{markdown.share(c.solved, c.done)} finished runs of {c.planned} planned"
    hearing = judge.on("free_at_via_points", who="", source=SOURCE)
    return hearing.every(told, c.solved, c.done, c.planned)


def _evolution(judge: kit.Judge, c: kit.ConditionResults, controls: Controls) -> kit.Claim:
    return judge.on("evolution_adds", who="").better_than_all(*evolution_told(judge, c, controls))


def _kept_share(condition: kit.ConditionResults) -> FloatArray:
    """Return the least distance of centres between via-points in units of the safety distance."""
    return np.asarray(condition.column(BETWEEN) / problem(condition).security_margin)


def _safe(judge: kit.Judge, c: kit.ConditionResults, controls: Controls) -> kit.Claim:
    values = _kept_share(c)
    safe = int(np.count_nonzero(values >= 1.0))
    told = (
        f"{markdown.share(safe, c.done)} runs never below it; least "
        f"{markdown.number(float(np.min(values)))} times, at via-points "
        f"{markdown.number(float(np.min(c.column(AT))) / problem(c).security_margin)} times"
    )
    hearing = judge.on("safety_between_via_points", who="", source=SOURCE)
    return hearing.every(told, safe, c.done, c.planned)
