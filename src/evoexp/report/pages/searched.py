"""Searches of settings (`sweep=optuna`): trials, their scores, and the words of the page `search`.

A trial is an experiment with some settings changed. Trial 0 is the experiment as it is: what every
other trial is compared with, condition by condition. A search makes the score of a trial least.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evoexp.report.figures import Rows, records, table_of
from evoexp.report.results.run_measures import solved
from evoexp.report.results.stored_results import ConditionResults, Results

MUCH_MORE = 1.1  # queries of a trial, in those of the experiment as it is
MOST_ROWS = 10  # trials in the table of the best ones; the data have all


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
    told: tuple[float, ...] = ()  # scores that the search learned from, behind trial 0


def _proven(condition: ConditionResults) -> np.ndarray:
    """Return whether each run is proven, (done,): solved, and its motion, if any, certified."""
    certified = condition.summaries["certified"].eq(True).fillna(False).to_numpy(dtype=bool)
    return solved(condition) & (certified | np.isnan(condition.column("clearance")))


@table_of("trial problem score proven runs queries")
def score_table(searched: Searched, conditions: Iterable[ConditionResults]) -> Rows:
    """Return the score of every trial on every problem.

    A run that is proven counts its cost, divided by the mean cost of the proven runs of trial 0 on
    the same problem (of all its runs where none is proven; 1 where that is not above 0),
    `unsolved` at most; any other run counts `unsolved`. The score of a trial is the mean over runs
    and problems.

    Args:
        searched: Problems and trials.
        conditions: Results of all their conditions.

    Returns:
        Columns trial, problem, score, proven (runs), runs (planned), queries (mean per run).
    """
    runs = {each.condition.id: each for each in conditions}
    references = dict[str, float]()
    for trial in searched.trials:
        for problem, key in zip(searched.problems, trial.ids, strict=True):
            first = np.asarray(runs[key].summaries.index < searched.num_replicates)
            holds = _proven(runs[key]) & first
            costs = runs[key].column("best_cost")[holds]
            if trial.number == 0:
                every = runs[key].column("best_cost")[first]
                finite = costs if len(costs) else every[np.isfinite(every)]
                references[problem] = float(finite.mean()) if len(finite) else np.inf
            reference = references[problem]
            ratios = costs / reference if 0.0 < reference < np.inf else np.ones(len(costs))
            ratios = np.clip(ratios, 0.0, searched.unsolved)
            missing = searched.num_replicates - len(costs)
            score = (ratios.sum() + searched.unsolved * missing) / searched.num_replicates
            queries = runs[key].column("collision_queries")[first].mean() if first.any() else 0.0
            numbers = float(score), len(costs), searched.num_replicates, float(queries)
            yield trial.number, problem, *numbers


def words_of(trial: Trial) -> str:
    """Return the settings of a trial as one types them."""
    return " ".join(f"{key}={value}" for key, value in trial.settings.items()) or "as it is"


def trial_table(searched: Searched, search_scores: pd.DataFrame) -> pd.DataFrame:
    """Return the trials in their order.

    Columns trial (0: the experiment as it is), score, best (least score so far, the experiment as
    it is included), proven and runs (of all problems), queries (mean per run), and one per setting.
    """
    by_trial = search_scores.groupby("trial", as_index=False)
    table = by_trial.agg({"score": "mean", "proven": "sum", "runs": "sum", "queries": "mean"})
    table.insert(2, "best", table["score"].cummin())
    for key in searched.trials[-1].settings:
        table[key] = [trial.settings.get(key, "") for trial in searched.trials]
    return table


def best_trial(searched: Searched, trials: pd.DataFrame) -> Trial:
    """Return the trial of the least score, the first of equal ones; trial 0 if none is better."""
    return searched.trials[int(trials["score"].to_numpy().argmin())]


def search_words(searched: Searched, best_trial: Trial, trials: pd.DataFrame) -> dict[str, object]:
    """Return the words of the page's texts."""
    rows = {row.trial: row for row in records(trials)}
    best, own = rows[best_trial.number], rows[0]
    scores = zip(trials["trial"][1:], trials["score"][1:], searched.told, strict=True)
    changed = [str(number) for number, score, told in scores if not np.isclose(score, told)]
    return {
        "count": len(searched.trials) - 1,
        "settings": " and ".join(map("`{}`".format, searched.trials[-1].settings)) or "no setting",
        "changed": ", ".join(changed),
        "problems": f"{count} problems" if (count := len(searched.problems)) > 1 else "one problem",
        "replicates": searched.num_replicates,
        "unsolved": f"{searched.unsolved:g}",
        "best": f"`{words_of(best_trial)}`",
        "score": f"{best.score:.3g}",
        "own": f"{own.score:.3g}",
        "proven": f"{best.proven} of {best.runs}",
        "own_proven": f"{own.proven} of {own.runs}",
    }


def best_trial_rows(searched: Searched, trials: pd.DataFrame) -> Rows:
    """Yield a row for each of the best trials, and for the experiment as it is."""
    best = trials.sort_values("score", kind="stable").head(MOST_ROWS)
    for row in records(pd.concat([best, trials[:1]]).drop_duplicates("trial")):
        words = next(words_of(each) for each in searched.trials if each.number == row.trial)
        proven, queries = f"{row.proven} of {row.runs}", f"{row.queries:,.0f}"
        yield row.trial, f"`{words}`", f"{row.score:.3g}", proven, queries


def best_trial_by_problem(best_trial: Trial, search_scores: pd.DataFrame) -> Rows:
    """Yield a row per problem: the experiment as it is beside the best trial."""
    of_trial = search_scores["trial"]
    own, best = (search_scores[of_trial == number] for number in (0, best_trial.number))
    for key, one, other in zip(best_trial.ids, records(own), records(best), strict=True):
        shares = (f"{each.proven} of {each.runs}" for each in (one, other))
        yield one.problem, f"{one.score:.3g}", f"{other.score:.3g}", *shares, f"`{key[:12]}`"


def best_of(results: Results) -> Results:
    """Return the results of the best trial of a search alone."""
    searched: Searched = results.searched
    trials = trial_table(searched, score_table(searched, results.conditions))
    ids = best_trial(searched, trials).ids
    return results._replace(conditions=tuple(c for c in results.with_data if c.condition.id in ids))


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "search_scores": lambda searched, results: score_table(searched, results.conditions),
    "trials": lambda searched, search_scores: trial_table(searched, search_scores),
    "effort_differs": lambda trials: (
        trials["queries"].max() > MUCH_MORE * trials["queries"].iloc[0]
    ),
    "is_improved": lambda best_trial: best_trial.number > 0,
    "importance": lambda searched: searched.importance,
    "refused_rows": lambda searched: tuple(searched.refused.items()),
    "conditions_of_best": lambda results: best_of(results).conditions,
}
