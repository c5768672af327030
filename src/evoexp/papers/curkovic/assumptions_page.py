"""The page of what Curkovic et al. 2013 leave open: method V beside method I and beside elites."""

from evoexp.papers.curkovic import measures
from evoexp.papers.curkovic.rules import PAPER, RULES
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import assumptions, generic, judging, markdown

EFFORT = "evaluations to a team whose cost is the threshold"
CLEARANCE = "least clearance of the bodies (exact; 0: contact)"
METHOD, PLAIN, ELITES = "V", "I", "15 elites"
Controls = tuple[kit.ConditionResults, ...]


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of assumptions, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)

    def effort(condition: kit.ConditionResults) -> FloatArray:
        """Return the evaluations to a team of the threshold's cost in its own scene, (done,)."""
        threshold = settings.threshold_ratio * measures.lower_bound(condition)
        return measures.evaluations_to(condition, threshold)

    def against(
        judge: kit.Judge, c: kit.ConditionResults, other: str, values: kit.Values
    ) -> kit.Comparison | None:
        """Compare method V with another treatment under the same numbers.

        Numbers of the hall are no numbers of a treatment without one: that is as assumed then.
        """
        _, comma, changed = c.label.partition(", ")
        by_label = {c.label: c for c in results.with_data}
        twin = by_label.get(f"{other}{comma}{changed}", by_label.get(other))
        return None if twin is None else judge.compared(c, twin, values)

    def faster(judge: kit.Judge, c: kit.ConditionResults, _: Controls) -> kit.Claim:
        hearing = judge.on("faster", who="", measure=EFFORT, pair=f": {METHOD} against {PLAIN}")
        return hearing.better(against(judge, c, PLAIN, effort), "lower")

    def beyond_elites(judge: kit.Judge, c: kit.ConditionResults, _: Controls) -> kit.Claim:
        row = against(judge, c, ELITES, cost)
        told = judging.evidence(row, "lower") if row else "nothing to compare"
        hearing = judge.on("hall_beyond_elites", who="", elites=ELITES, measure="best cost")
        return hearing.better_than_all(told, [row] if row else [])

    cost = kit.by_column("best_cost")
    headlines = (
        kit.Headline("faster", EFFORT, effort, faster),
        kit.Headline("hall_beyond_elites", "best cost", cost, beyond_elites),
        kit.Headline("free_motion", CLEARANCE, kit.by_column("clearance"), _free),
    )
    treated = [c for c in results.conditions if c.label.partition(", ")[0] == METHOD]
    method = results._replace(conditions=tuple(treated))
    found = assumptions.page(method, settings, RULES, PAPER.name, headlines)
    return found._replace(quantities=generic.quantities(results))


def _free(judge: kit.Judge, condition: kit.ConditionResults, controls: Controls) -> kit.Claim:
    certified = kit.certified(condition).having
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
