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
    holm,
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


def percentages(judge: Judge, conditions: Sequence[ConditionResults], level: float) -> list[Claim]:
    """Judge the percentages printed for arms of so many joints, as one family of tests.

    Both percentages are samples: a printed one is contradicted where Fisher's exact test, adjusted
    by Holm over all percentages judged here, tells it from ours.

    Args:
        judge: The judge of the experiment.
        conditions: The conditions whose runs they are judged by.
        level: Level of the tests and intervals.
    """
    pairs = [(c, printed) for c in conditions for printed in measures.printed(c)]
    ours = [measures.below(condition, printed.bound) for condition, printed in pairs]
    compared = [
        fisher_exact(own, one.proportion) for own, (_, one) in zip(ours, pairs, strict=True)
    ]
    return [
        _percentage(judge, *pair, own, level, p, len(pairs))
        for pair, own, p in zip(pairs, ours, holm(compared), strict=True)
    ]


def _percentage(
    judge: Judge,
    condition: ConditionResults,
    printed: Percentage,
    own: Proportion,
    level: float,
    p_adjusted: float,
    num_tests: int,
) -> Claim:
    theirs = printed.proportion
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
            f"{100 * theirs.share:.1f} % of runs"
        ),
        source=SOURCE,
        evidence=(
            f"{measures.text(own, level)}; the printed share lies {place}, its own thousand runs "
            f"give [{100 * their_own.low:.1f}, {100 * their_own.high:.1f}]; {difference} points "
            f"(Newcombe's {100 * level:g} % interval); Fisher's exact p, adjusted by Holm over "
            f"{num_tests}, {markdown.p_value(p_adjusted)} (contradicted below {1.0 - level:.2g}; "
            "both are samples)"
        ),
        verdict=(
            verdicts.judged(p_adjusted >= 1.0 - level) if own.total else verdicts.INCONCLUSIVE
        ),
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
