"""The claims of Lavoie & Boudreau 2001, judged by their experiment; sweeps judge some of them."""

from collections.abc import Iterator, Sequence

import numpy as np

from evoexp.papers.lavoie import measures
from evoexp.papers.lavoie.measures import Percentage
from evoexp.report.kit import (
    Claim,
    ConditionResults,
    Judge,
    Proportion,
    counted,
    fisher_exact,
    markdown,
    newcombe,
    solved,
    verdicts,
)

SOURCE = "section 5, Fig. 3"
ELSEWHERE = (
    (
        "A smaller stopping value gives a better precision, with more generations",
        "section 6",
        "lavoie_stopping",
    ),
    ("Real coding performs better than binary coding", "section 2", "lavoie_coding"),
)


def judge_equal(one: Proportion, two: Proportion, confidence: float) -> str:
    """Judge a claim that two proportions of independent runs are the same.

    Args:
        one: Proportion of our runs.
        two: Proportion of the paper's.
        confidence: Level of Newcombe's interval of their difference.

    Returns:
        Reproduced if 0 lies within the interval, else contradicted.
    """
    if not one.total or not two.total:
        return verdicts.INCONCLUSIVE
    low, high = newcombe(one, two, confidence)
    return verdicts.judged(low <= 0.0 <= high)


def percentages(judge: Judge, condition: ConditionResults, level: float) -> list[Claim]:
    """Judge the percentages printed for an arm of so many joints.

    Args:
        judge: The judge of the experiment.
        condition: The condition whose runs they are judged by.
        level: Level of the intervals.
    """
    return [_percentage(judge, condition, one, level) for one in measures.printed(condition)]


def _percentage(
    judge: Judge, condition: ConditionResults, printed: Percentage, level: float
) -> Claim:
    own, theirs = measures.below(condition, printed.bound), printed.proportion
    low, high = newcombe(own, theirs, level)
    within, their_own = own.interval(level), theirs.interval(level)
    place = "within" if within.low <= theirs.share <= within.high else "outside"
    difference = (
        f"ours − printed {100 * (own.share - theirs.share):+.1f} "
        f"[{100 * low:+.1f}, {100 * high:+.1f}]"
    ).replace("-", "−")
    return judge.claim(
        text=(
            f"{condition.label}: a position error below {printed.bound:g} in "
            f"{100 * theirs.share:.1f} "
            "% of runs"
        ),
        source=SOURCE,
        evidence=(
            f"{measures.text(own, level)}; the printed share lies {place}, its own thousand runs "
            "give "
            f"[{100 * their_own.low:.1f}, {100 * their_own.high:.1f}]; {difference} points "
            f"(reproduced: 0 within the {100 * level:g} % interval of the difference by "
            "Newcombe; both are samples)"
        ),
        verdict=judge_equal(own, theirs, level),
    )


def more_joints_are_better(
    judge: Judge, conditions: Sequence[ConditionResults], level: float
) -> Iterator[Claim]:
    """Judge that the arm of ten joints does better than that of seven, where both were run."""
    by_joints = {measures.num_joints(c): c for c in conditions}
    for bound in measures.BOUNDS if {7, 10} <= set(by_joints) else ():
        ten, seven = (measures.below(by_joints[joints], bound) for joints in (10, 7))
        yield judge.greater(
            text=(f"The arm of ten joints does better than that of seven: errors below {bound:g}"),
            source=SOURCE,
            evidence=(
                f"{measures.text(ten, level)} against {measures.text(seven, level)}; Fisher's "
                "exact p "
                f"= {markdown.p_value(fisher_exact(ten, seven))}, two-sided"
            ),
            one=ten,
            two=seven,
        )


def no_start_needed(judge: Judge, condition: ConditionResults) -> Claim:
    """Judge that random populations are a good enough start."""
    told = (
        f"{markdown.share(condition.solved, condition.done)} runs from uniform random populations "
        "end with a solution (reproduced: all of them; one without contradicts)"
    )
    runs = condition.solved, condition.done, condition.planned
    text = f"{condition.label}: no starting solution is needed"
    return judge.every(text, "section 6", told, *runs)


def free_of_collision(
    judge: Judge, condition: ConditionResults, refuted: Proportion, level: float
) -> Claim:
    """Judge that accepted motions touch nothing."""
    certified = condition.summaries["certified"].eq(True).fillna(False).to_numpy(dtype=bool)
    free = counted(np.asarray(solved(condition) & certified)).having
    planned = condition.planned if condition.solved == condition.done else 0
    return judge.every(
        text=f"{condition.label}: accepted motions avoid the obstacles",
        source="sections 3 and 4",
        evidence=(
            f"{markdown.share(free, refuted.total)} certified; refuted "
            f"{measures.text(refuted, level)}"
        ),
        holds=free,
        done=refuted.total,
        planned=planned,
    )


def judged_elsewhere() -> list[Claim]:
    """Return the claims that need a sweep, not judged."""
    told = "judged by its sweep: `evoexp run experiment={}`"
    return [
        Claim(text, source, told.format(experiment), verdicts.NOT_JUDGED)
        for text, source, experiment in ELSEWHERE
    ]
