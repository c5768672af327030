"""The assumed numbers of Lavoie & Boudreau 2001, and which headline claims survive others."""

from evoexp.papers.lavoie import claims, measures
from evoexp.papers.lavoie.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import assumptions, generic

Controls = tuple[kit.ConditionResults, ...]


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of assumed numbers, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    unit = results.with_data[0].condition.length_unit
    # number of joints → the condition as assumed, which is the first one of the arm
    shipped = {kit.num_joints(c): c for c in reversed(results.main)}

    def share_below(judge: kit.Judge, condition: kit.ConditionResults, _: Controls) -> kit.Claim:
        """Judge the percentage that is printed for errors below 1, the least bound.

        The percentages of the other arm, as assumed, belong to the same family of tests, so that
        the verdict as assumed is that of the experiment itself.
        """
        others = [c for joints, c in shipped.items() if joints != kit.num_joints(condition)]
        return claims.percentages(judge, [condition, *others])[0]

    def no_start(judge: kit.Judge, condition: kit.ConditionResults, _: Controls) -> kit.Claim:
        claim = claims.no_start_needed(judge, condition)
        assert claim is not None, "the paper prints percentages for arms of seven and of ten joints"
        return claim

    def free(judge: kit.Judge, condition: kit.ConditionResults, _: Controls) -> kit.Claim:
        refuted = kit.counted(measures.touches(condition)[kit.solved(condition)])
        return claims.free_of_collision(judge, condition, refuted)

    headlines = (
        kit.Headline("share_below", f"position error [{unit}]", measures.errors, share_below),
        kit.Headline("no_start", "evaluations to a solution", measures.effort, no_start),
        kit.Headline("free_of_collision", f"clearance [{unit}]", kit.by_column("clearance"), free),
    )
    return assumptions.page(results, settings, RULES, PAPER.name, headlines)
