"""What Lavoie & Boudreau 2001 claim, judged by their experiment and by sweeps over its settings."""

import numpy as np

from evoexp.papers.lavoie import measures
from evoexp.papers.lavoie.measures import PRINTED, Printed
from evoexp.report import claims, markdown
from evoexp.report.claims import Claim, judge_greater
from evoexp.report.judging import claim, not_judged
from evoexp.report.proportions import Proportion, fisher_exact, newcombe
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

SOURCE = "section 5, Fig. 3"
ELSEWHERE = (
    (
        "A smaller stopping value gives a better precision, with more generations",
        "section 6",
        "lavoie_stopping",
    ),
    ("Real coding performs better than binary coding", "section 2", "lavoie_coding"),
)


def judge_equal(not_judged: str, one: Proportion, two: Proportion, confidence: float) -> str:
    """Judge a claim that two proportions of independent runs are the same.

    Args:
        not_judged: Why it is not to be judged; empty: judge it.
        one: Of our runs.
        two: Of the paper's.
        confidence: Level of Newcombe's interval of their difference.

    Returns:
        Reproduced if 0 lies within the interval, else contradicted.
    """
    if not_judged:
        return claims.NOT_JUDGED
    if not one.total or not two.total:
        return claims.INCONCLUSIVE
    low, high = newcombe(one, two, confidence)
    return claims.REPRODUCED if low <= 0.0 <= high else claims.CONTRADICTED


def percentages(why: str, condition: ConditionResults, settings: ReportSettings) -> list[Claim]:
    """Return the claims that the percentages printed for an arm of so many joints make.

    Args:
        why: Why they are not to be judged; empty: judge them.
        condition: Whose runs they are judged on.
        settings: Level of the intervals.
    """
    joints = measures.num_joints(condition)
    return [
        _percentage(why, condition, printed, settings)
        for printed in PRINTED
        if printed.joints == joints
    ]


def _percentage(
    why: str, condition: ConditionResults, printed: Printed, settings: ReportSettings
) -> Claim:
    level = settings.confidence
    own, theirs = measures.below(condition, printed.bound), printed.proportion
    low, high = newcombe(own, theirs, level)
    within = own.interval(level)
    place = "within" if within.low <= theirs.share <= within.high else "outside"
    told = (
        f"{measures.text(own, level)}; the printed one lies {place}, its own thousand runs give "
        f"[{100 * theirs.interval(level).low:.1f}, {100 * theirs.interval(level).high:.1f}]; ours "
        f"− printed {100 * (own.share - theirs.share):+.1f} [{100 * low:+.1f}, {100 * high:+.1f}] "
        "points".replace("-", "−")
        + f" (reproduced: 0 within the {100 * level:g} % interval of the difference by "
        "Newcombe; both are samples)"
    )
    text = (
        f"{condition.label}: a position error below {printed.bound:g} in {100 * theirs.share:.1f} "
        "% of runs"
    )
    return claim(text, SOURCE, told, judge_equal(why, own, theirs, level), why)


def more_joints_are_better(results: Results, settings: ReportSettings) -> list[Claim]:
    """Return the claims that the arm of ten joints does better than that of seven.

    None without both.
    """
    by_joints = {measures.num_joints(c): c for c in results.with_data}
    if not {7, 10} <= set(by_joints):
        return []
    found, both = [], (by_joints[10], by_joints[7])
    why = not_judged(results)
    for bound in measures.BOUNDS:
        ten, seven = (measures.below(c, bound) for c in both)
        told = (
            f"{measures.text(ten, settings.confidence)} against "
            f"{measures.text(seven, settings.confidence)}; Fisher's exact p = "
            f"{markdown.p_value(fisher_exact(ten, seven))}, two-sided"
        )
        text = f"The arm of ten joints does better than that of seven: errors below {bound:g}"
        found.append(
            claim(text, SOURCE, told, judge_greater(why, ten, seven, settings.significance), why)
        )
    return found


def no_start_needed(results: Results, condition: ConditionResults) -> Claim:
    """Return the claim that random populations are a good enough start."""
    why = not_judged(results)
    told = (
        f"{markdown.share(condition.solved, condition.done)} runs from uniform random populations "
        "end with a solution (reproduced: all of them; one without contradicts)"
    )
    text = f"{condition.label}: no starting solution is needed"
    return claim(
        text,
        "section 6",
        told,
        claims.judge_all(why, condition.solved, condition.done, condition.planned),
        why,
    )


def free_of_collision(
    results: Results, condition: ConditionResults, refuted: Proportion, settings: ReportSettings
) -> Claim:
    """Return the claim that accepted motions touch nothing."""
    why = not_judged(results)
    free = int(
        np.count_nonzero(
            measures.solved(condition) & condition.summaries["certified"].eq(True).fillna(False)
        )
    )
    told = (
        f"{markdown.share(free, refuted.total)} certified; refuted "
        f"{measures.text(refuted, settings.confidence)}"
    )
    planned = condition.planned if condition.solved == condition.done else 0
    verdict = claims.judge_all(why, free, refuted.total, planned)
    return claim(
        f"{condition.label}: accepted motions avoid the obstacles",
        "sections 3 and 4",
        told,
        verdict,
        why,
    )


def judged_elsewhere() -> list[Claim]:
    """Return the claims that need a sweep."""
    return [
        Claim(
            text,
            source,
            f"judged by its sweep: `evoexp run experiment={experiment}`",
            claims.NOT_JUDGED,
        )
        for text, source, experiment in ELSEWHERE
    ]
