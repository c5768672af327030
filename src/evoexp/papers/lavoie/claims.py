"""The claims of Lavoie & Boudreau 2001, judged by their experiment; sweeps judge some of them."""

from collections.abc import Iterator, Sequence

from evoexp.papers import run_values
from evoexp.papers.lavoie import measures
from evoexp.papers.lavoie.measures import Percentage
from evoexp.papers.lavoie.rules import RULES
from evoexp.report import kit
from evoexp.report.kit import markdown

ELSEWHERE = (
    ("more_solutions", {"who": "", "control": ""}),
    ("precision", {"where": ", with more generations"}),
    ("coding", {"where": "", "word": "better"}),
)


def percentages(
    judge: kit.Judge, conditions: Sequence[kit.ConditionResults], level: float
) -> list[kit.Claim]:
    """Judge the percentages printed for arms of so many joints, as one family of tests.

    Both percentages are samples: a printed one is contradicted where Fisher's exact test, adjusted
    by Holm over all percentages judged here, tells it from ours.
    """
    pairs = [(c, printed) for c in conditions for printed in measures.printed(c)]
    ours = [measures.below(condition, printed.bound) for condition, printed in pairs]
    compared = [
        kit.fisher_exact(own, one.proportion) for own, (_, one) in zip(ours, pairs, strict=True)
    ]
    return [
        _percentage(judge, *pair, own, level, p, len(pairs))
        for pair, own, p in zip(pairs, ours, kit.holm(compared), strict=True)
    ]


def _percentage(
    judge: kit.Judge,
    condition: kit.ConditionResults,
    printed: Percentage,
    own: kit.Proportion,
    level: float,
    p_adjusted: float,
    num_tests: int,
) -> kit.Claim:
    theirs = printed.proportion
    within, their_own = own.interval(level), theirs.interval(level)
    each = 1.0 - (1.0 - level) / num_tests  # Bonferroni: all intervals together have the level
    place = "within" if within.low <= theirs.share <= within.high else "outside"
    evidence = (
        f"{measures.text(own, level)}; the printed share lies {place}, its own thousand runs "
        f"give [{100 * their_own.low:.1f}, {100 * their_own.high:.1f}]; "
        f"{_difference(own, theirs, each)}, {100 * level:g} % over the {num_tests} together; "
        f"Fisher's exact p, adjusted by Holm over {num_tests}, {markdown.p_value(p_adjusted)}"
    )
    words = {"bound": f"{printed.bound:g}", "share": f"{100 * theirs.share:.1f}"}
    hearing = judge.on("share_below", who=condition.label, **words)
    return hearing.same_share(evidence, own, theirs, p_adjusted)


def _difference(own: kit.Proportion, theirs: kit.Proportion, level: float) -> str:
    """Return how many points more our share has than the paper's, with its interval."""
    low, high = kit.newcombe(own, theirs, level)
    points = (
        f"ours − printed {100 * (own.share - theirs.share):+.1f} "
        f"[{100 * low:+.1f}, {100 * high:+.1f}] points"
    ).replace("-", "−")
    return f"{points} (Newcombe's {100 * level:g} % interval)"


def more_joints_are_better(
    judge: kit.Judge, conditions: Sequence[kit.ConditionResults], level: float
) -> Iterator[kit.Claim]:
    """Judge that the arm of ten joints does better than that of seven, where both were run."""
    by_joints = {run_values.num_joints(c): c for c in conditions}
    for bound in measures.BOUNDS if {7, 10} <= set(by_joints) else ():
        ten, seven = (measures.below(by_joints[joints], bound) for joints in (10, 7))
        p = markdown.p_value(kit.fisher_exact(ten, seven))
        told = " against ".join(measures.text(share, level) for share in (ten, seven))
        evidence = f"{told}; Fisher's exact p = {p}, two-sided"
        yield judge.on("longer_arm", bound=f"{bound:g}").greater(evidence, ten, seven)


def no_start_needed(
    judge: kit.Judge, condition: kit.ConditionResults, level: float
) -> kit.Claim | None:
    """Judge that random populations are a good enough start.

    The paper's own runs do not all end with a solution. An error of 2 or more is none (the
    objective is at least the error, and a search is successful below 2), so the share that the
    paper prints for errors below 2 is its share of runs with a solution.

    Returns:
        None for an arm of which the paper prints no share.
    """
    printed = [one for one in measures.printed(condition) if one.bound == max(measures.BOUNDS)]
    if not printed:
        return None
    own, theirs = kit.success(condition), printed[0].proportion
    hearing = judge.on("no_start", who=condition.label)
    low, high = kit.newcombe(own, theirs, level)
    margin = -0.01 * hearing.rule.limits["margin"]
    holds = None if low <= margin <= high else low > margin
    evidence = (
        f"runs with a solution: {measures.text(own, level)}; the paper's own, errors below "
        f"{printed[0].bound:g}: {measures.text(theirs, level)}; {_difference(own, theirs, level)}"
    )
    return hearing.own(evidence, f"{own.total} and {theirs.total}", holds)


def free_of_collision(
    judge: kit.Judge, condition: kit.ConditionResults, refuted: kit.Proportion, level: float
) -> kit.Claim:
    """Judge that accepted motions touch nothing."""
    free = run_values.certified(condition).having
    planned = condition.planned if condition.solved == condition.done else 0
    evidence = (
        f"{markdown.share(free, refuted.total)} certified; refuted {measures.text(refuted, level)}"
    )
    hearing = judge.on("free_of_collision", who=condition.label)
    return hearing.every(evidence, free, refuted.total, planned)


def judged_elsewhere(judge: kit.Judge) -> list[kit.Claim]:
    """Return the claims that need controls or a sweep, not judged."""
    told = "judged by `evoexp run experiment={}`"
    return [
        judge.on(name, **words).elsewhere(told.format(RULES[name].experiments[0]))
        for name, words in ELSEWHERE
    ]
