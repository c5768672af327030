"""The part of `evoexp compare`'s page that ranks planners over problems.

The functions give what the page `comparison` of `page.yaml` names.
"""

import numpy as np

from evoexp.report.pages import markdown
from evoexp.report.report_settings import ReportSettings
from evoexp.report.statistics.problem_ranks import (
    MIN_PLANNERS,
    MIN_PROBLEMS,
    Standing,
    critical_difference,
    friedman,
)


def rank_rows(ranks: Standing) -> list[tuple[str, ...]]:
    """Return mean ranks, best first; none where there is but one planner, or one problem."""
    if not ranks.can_be_profiled:
        return []
    lengths = ranks.lengths
    best = (lengths == lengths.min(axis=1, keepdims=True)) & np.isfinite(lengths)
    return [
        (
            planner,
            f"{ranks.mean_ranks[k]:.2f}",
            markdown.share(int(best[:, k].sum()), len(lengths)),
            markdown.share(int(np.isfinite(lengths[:, k]).sum()), len(lengths)),
            markdown.share(int(np.isfinite(ranks.efforts[:, k]).sum()), len(lengths)),
        )
        for k, planner in sorted(
            enumerate(ranks.planners), key=lambda each: ranks.mean_ranks[each[0]]
        )
    ]


def too_few_ranks(ranks: Standing) -> str:
    """Say why planners are not ranked; empty if they are."""
    if ranks.can_be_profiled:
        return ""
    return (
        " Planners are not ranked: a problem counts once, however many seeds it has, and it takes "
        "two planners, and two problems at least that both were run on."
    )


def left_out(ranks: Standing) -> str:
    """Name the problems and planners that do not count; empty if all do."""
    names = ", ".join(ranks.left_out)
    problems = f" Left out, as some planner was not run on them: {names}." if names else ""
    if not ranks.outsiders:
        return problems
    planners = ", ".join(ranks.outsiders)
    return f"{problems} Not ranked, as run on less than half of the problems: {planners}."


def rank_test(ranks: Standing, settings: ReportSettings) -> str:
    """Tell the outcome of the tests, or why there are none."""
    planners, problems = len(ranks.planners), len(ranks.problems)
    if not ranks.can_be_tested:
        return (
            f"Too few for a test of ranks and its diagram: that takes {MIN_PLANNERS} planners and "
            f"{MIN_PROBLEMS} problems that all of them were run on; here are {planners} planners "
            f"and {problems} such problems."
        )
    test = friedman(ranks.lengths)
    difference = critical_difference(planners, problems, settings.significance)
    says = (
        "the planners rank differently"
        if test.p_value < settings.significance
        else "no planner is shown to rank differently from another, whatever their differences"
    )
    return (
        f"Friedman's test over {problems} problems: χ² = {test.statistic:.3g}, p = "
        f"{markdown.p_value(test.p_value)}: {says}. Nemenyi's critical difference of mean ranks at "
        f"{settings.significance:g}: {difference:.2f}."
    )


def never_proven(ranks: Standing) -> str:
    """Tell how many problems no planner has a proven answer on; empty if there is none."""
    unsolved = int(np.isinf(ranks.efforts).all(axis=1).sum())
    return f" No planner has a proven answer on {unsolved} of them." if unsolved else ""
