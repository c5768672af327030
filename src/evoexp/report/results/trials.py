"""Trials of a search of settings (`sweep=optuna`), and the score that a search makes least.

A trial is an experiment with some settings changed. Trial 0 is the experiment as it is: what every
other trial is compared with, condition by condition.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from evoexp.report.results.run_measures import solved
from evoexp.report.results.stored_results import ConditionResults


class Trial(NamedTuple):
    """An experiment with some settings changed."""

    number: int  # 0: as it is; the others by the order in which they were asked for
    settings: Mapping[str, str]  # key → value, as one types them; empty for trial 0
    ids: tuple[str, ...]  # of its conditions, one per problem


class Searched(NamedTuple):
    """The trials of a search so far."""

    problems: tuple[str, ...]  # labels of the conditions that have the searched settings
    trials: tuple[Trial, ...]  # finished ones, trial 0 first
    num_replicates: int  # of every condition: the first ones, whatever else is stored
    unsolved: float  # score of a run without a proven answer
    refused: Mapping[str, str] = {}  # settings that do not go together → why
    importance: Mapping[str, float] = {}  # key → share for being among the best trials


def proven(condition: ConditionResults) -> np.ndarray:
    """Return whether each run is proven, (done,): solved, and its motion, if any, certified."""
    certified = condition.summaries["certified"].eq(True).fillna(False).to_numpy(dtype=bool)
    return solved(condition) & (certified | np.isnan(condition.column("clearance")))


def score_table(searched: Searched, runs: Mapping[str, ConditionResults]) -> pd.DataFrame:
    """Return the score of every trial on every problem.

    A run that is proven counts its cost, divided by the mean cost of the proven runs of trial 0 on
    the same problem (of all its runs where none is proven), `unsolved` at most; any other run
    counts `unsolved`. The score of a trial is the mean over runs and problems.

    Args:
        searched: Problems and trials.
        runs: Results by the id of their condition.

    Returns:
        Columns trial, problem, score, proven (runs), runs (planned), queries (mean per run).
    """
    rows, references = [], dict[str, float]()
    for trial in searched.trials:
        for problem, key in zip(searched.problems, trial.ids, strict=True):
            first = np.asarray(runs[key].summaries.index < searched.num_replicates)
            holds = proven(runs[key]) & first
            costs = runs[key].column("best_cost")[holds]
            if trial.number == 0:
                every = runs[key].column("best_cost")[first]
                finite = costs if len(costs) else every[np.isfinite(every)]
                references[problem] = float(finite.mean()) if len(finite) else np.inf
            reference = references[problem]
            ratios = costs / reference if np.isfinite(reference) else np.ones(len(costs))
            ratios = np.minimum(ratios, searched.unsolved)
            missing = searched.num_replicates - len(costs)
            score = (ratios.sum() + searched.unsolved * missing) / searched.num_replicates
            queries = runs[key].column("collision_queries")[first].mean() if first.any() else 0.0
            numbers = float(score), len(costs), searched.num_replicates, float(queries)
            rows.append((trial.number, problem, *numbers))
    names = ["trial", "problem", "score", "proven", "runs", "queries"]
    return pd.DataFrame(rows, columns=names)
