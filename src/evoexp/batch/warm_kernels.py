"""Compiles the kernels of conditions, or loads them, before their replicates are timed.

Each kind of condition searches for two generations and judges a motion; the server of worker
processes does so before it forks them.
"""

import contextlib
import itertools
import re
from collections.abc import Iterable

from evoexp.batch.jobs import Job, condition_of
from evoexp.batch.replicate_limits import ReplicateLimits, limited
from evoexp.records import generations

COMPILING_S = 600.0  # [s] that a short call may take; replicates that compile would be late, too
_NUMBER = re.compile(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?")


def one_of_each_kind(jobs: Iterable[Job]) -> list[Job]:
    """Return jobs that need all kernels that any needs: numbers make no difference."""
    texts = {job.condition_json: job for job in jobs}
    return list({_NUMBER.sub(b"0", text): job for text, job in texts.items()}.values())


def warm_kernels(jobs: Iterable[Job], limits: ReplicateLimits) -> None:
    """Run every kernel that the conditions of jobs need; errors are left to the replicates."""
    from evoexp.paths.motion import Motion  # and numba
    from evoexp.planners.proofs import judge_motion

    limits = limits._replace(timeout_s=max(limits.timeout_s or 0.0, COMPILING_S))
    for job in jobs:
        with contextlib.suppress(Exception), limited(limits, in_worker=False):
            condition = condition_of(job)
            planner, problem = condition.prepare()
            # a reference takes long; it needs the kernels of the planner beside it
            searching = planner.planner if condition.is_reference else planner
            search = generations(searching.evolve(problem, condition.rng(0)))
            *_, solution = [generation.best.copy() for generation in itertools.islice(search, 2)]
            searching.evaluate(problem, solution)
            motion = searching.motion(problem, solution)
            judge_motion(searching, problem, motion)
            if motion is not None:  # what touches nothing needs the kernels of the closest approach
                judge_motion(searching, problem, Motion(motion.q[[0, 0]]))
