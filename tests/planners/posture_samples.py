"""Conditions of posture searches that tests share."""

import functools
from typing import Any

import numpy as np

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.records import FloatArray
from evoexp.store.log_reader import LogContents, read_log


def condition(name: str, *overrides: str, label: int = 0) -> Condition:
    """Return a condition of an experiment."""
    return composed(f"experiment={name}", *overrides, label=label)


@functools.cache
def log(name: str, *overrides: str, replicate: int = 0, label: int = 0) -> LogContents:
    """Return the log of a replicate."""
    return read_log(run_replicate(condition(name, *overrides, label=label), replicate).content)


def postures(found: LogContents, nq: int = 6) -> FloatArray:
    """Return the path of a log (postures, nq)."""
    return found.solutions[-1].values.reshape(-1, nq)


def prepared(name: str, *overrides: str) -> Any:
    """Return planner and problem."""
    return condition(name, *overrides).prepare()


def random_postures(problem: Any, count: int, seed: int = 0) -> FloatArray:
    """Return postures within the limits, (nq, count)."""
    low, high = problem.limits.T
    return np.random.default_rng(seed).uniform(low[:, None], high[:, None], (len(low), count))
