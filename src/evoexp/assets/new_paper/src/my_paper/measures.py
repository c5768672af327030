"""What is measured on stored runs, and how the headline claims are judged."""

from collections.abc import Sequence

import numpy as np

from evoexp.planners.arm_tasks import ArmProblem
from evoexp.records import FloatArray
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results.run_measures import success
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.judging import Judge


def excess(condition: ConditionResults) -> FloatArray:
    """Return how much longer than the straight line each run's best path is, (done,) [%]."""
    problem = condition.problem(ArmProblem)
    straight = float(np.linalg.norm(problem.goal - problem.start))
    return np.asarray(100.0 * (condition.column("term_length_deg") / straight - 1.0))


def judge_free(
    judge: Judge, condition: ConditionResults, controls: Sequence[ConditionResults]
) -> Claim:
    """Judge under one reading that motions are free at the tested configurations."""
    free = success(condition)
    return judge.on("free", who=condition.label).majority(judge.share(free), *free)
