"""The page of what Curkovic et al. 2013 leave open: method V beside method I and beside elites."""

from functools import partial

from evoexp.papers.curkovic import measures
from evoexp.papers.curkovic.rules import RULES
from evoexp.records import FloatArray
from evoexp.report.kit import (
    Claim,
    Comparison,
    ConditionResults,
    Headline,
    Judge,
    Page,
    ReportSettings,
    Results,
    Values,
    assumptions,
    by_column,
    compared,
    generic,
    judging,
    markdown,
)

EFFORT = "evaluations to a team whose cost is the threshold"
CLEARANCE = "least clearance of the bodies (exact; 0: contact)"
METHOD, PLAIN, ELITES = "V", "I", "15 elites"


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of assumptions, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    effort = partial(_effort, settings)
    headlines = (
        Headline("faster", EFFORT, effort, partial(_faster, results, settings, effort)),
        Headline(
            "hall_beyond_elites",
            "best cost",
            by_column("best_cost"),
            partial(_beyond_elites, results, settings),
        ),
        Headline("free_motion", CLEARANCE, by_column("clearance"), _free),
    )
    own = tuple(c for c in results.conditions if _treatment(c) == METHOD)
    method = results._replace(conditions=own)
    found = assumptions.page(method, settings, RULES, "Curkovic et al. 2013", headlines)
    return found._replace(quantities=generic.quantities(results))


def _effort(settings: ReportSettings, condition: ConditionResults) -> FloatArray:
    """Return each run's evaluations to a team of the threshold's cost in its own scene, (done,)."""
    threshold = settings.threshold_ratio * measures.lower_bound(condition)
    return measures.evaluations_to(condition, threshold)


def _treatment(condition: ConditionResults) -> str:
    """Return "V", "I" or "15 elites"; labels are "V" or "V, 50 individuals"."""
    return condition.label.partition(", ")[0]


def _against(
    results: Results,
    settings: ReportSettings,
    condition: ConditionResults,
    other: str,
    values: Values,
) -> tuple[Comparison, ...]:
    """Compare method V with another treatment under the same numbers.

    Numbers of the hall are no numbers of a treatment without one: that is as assumed then.
    """
    _, comma, changed = condition.label.partition(", ")
    by_label = {c.label: c for c in results.with_data}
    twin = by_label.get(f"{other}{comma}{changed}", by_label.get(other))
    return compared([] if twin is None else [(condition, twin)], values, settings)


def _faster(
    results: Results,
    settings: ReportSettings,
    effort: Values,
    judge: Judge,
    condition: ConditionResults,
    controls: tuple[ConditionResults, ...],
) -> Claim:
    rows = _against(results, settings, condition, PLAIN, effort)
    hearing = judge.on("faster", who="", measure=EFFORT, pair=f": {METHOD} against {PLAIN}")
    return hearing.better(next(iter(rows), None), "lower")


def _beyond_elites(
    results: Results,
    settings: ReportSettings,
    judge: Judge,
    condition: ConditionResults,
    controls: tuple[ConditionResults, ...],
) -> Claim:
    rows = _against(results, settings, condition, ELITES, by_column("best_cost"))
    told = "; ".join(judging.evidence(row, "lower") for row in rows) or "nothing to compare"
    hearing = judge.on("hall_beyond_elites", who="", elites=ELITES, measure="best cost")
    return hearing.better_than_all(told, rows)


def _free(
    judge: Judge, condition: ConditionResults, controls: tuple[ConditionResults, ...]
) -> Claim:
    certified = int(
        (condition.summaries["certified"].eq(True) & condition.summaries["solved"]).sum()
    )
    judged = condition.done - condition.verdicts.undecided
    hearing = judge.on(
        "free_motion",
        condition="Figs. 8, 9",
        scene="a collision-free motion of two robots in each other's way",
        judge="the exact verdict on the whole motion",
        where="section 4, Figs. 8, 9",
    )
    told = f"{markdown.share(certified, judged)} runs"
    return hearing.every(told, certified, judged, condition.planned)
