"""Settings compared: sweeps (`run -m`), and searches of the best ones (`sweep=optuna`).

The conditions of a sweep differ in the settings that their labels end with, and in nothing else.
`run -m` labels a condition of a sweep "via-point GA · population_size=20 · num_elites=0". What does
not depend on the sweep, the scene and the motion, is shown once, of the best condition.

A trial of a search is an experiment with some settings changed. Trial 0 is the experiment as it is:
what every other trial is compared with, condition by condition. A search makes the score of a trial
least. The functions give what the pages `sweep` and `search` of `page.yaml` name.
"""

import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evoexp.report.figures import Rows, records, table_of
from evoexp.report.pages import markdown
from evoexp.report.results.run_measures import certified, search_seconds, solved, success
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference
from evoexp.report.statistics.comparisons import Values, by_column

JOIN = " · "  # between the parts of a label
_SETTING = re.compile(r"([\w.@/-]+)=(.*)")
MOST_PANELS = 18  # of a figure


class Swept(NamedTuple):
    """A condition of a sweep."""

    base: str  # what its label says beside the settings; empty if nothing
    values: tuple[str, ...]  # of the settings, in their order
    results: ConditionResults  # its results


class Sweep(NamedTuple):
    """The conditions of a sweep."""

    settings: tuple[str, ...]  # names of the swept settings
    conditions: tuple[Swept, ...]  # in the order of the experiment

    @property
    def bases(self) -> tuple[str, ...]:
        """The conditions that were swept, each once."""
        return tuple(dict.fromkeys(each.base for each in self.conditions))

    def levels(self, setting: int) -> tuple[str, ...]:
        """Return the values of a setting, each once: numbers by size, others as they came."""
        found = list(dict.fromkeys(each.values[setting] for each in self.conditions))
        try:
            return tuple(sorted(found, key=float))
        except ValueError:
            return tuple(found)


def sweep_of(results: Results) -> Sweep | None:
    """Return the sweep that these results are; None if they are none."""
    conditions = [c for c in results.conditions if not c.is_reference]
    labels = [_split(c.label) for c in conditions]
    if len({tuple(settings) for _, settings in labels}) != 1:
        return None
    # a setting that is the same in all conditions is no axis
    names = [name for name in labels[0][1] if len({settings[name] for _, settings in labels}) > 1]
    swept = tuple(
        Swept(base, tuple(map(settings.__getitem__, names)), c)
        for (base, settings), c in zip(labels, conditions, strict=True)
    )
    is_repeated = len({condition[:2] for condition in swept}) < len(swept)
    return None if not names or is_repeated else Sweep(tuple(names), swept)


def _split(label: str) -> tuple[str, dict[str, str]]:
    """Return the base of a label, and the settings that it ends with."""
    parts, settings = label.split(JOIN), dict[str, str]()
    while parts and (match := _SETTING.fullmatch(parts[-1])) and match[1] not in settings:
        settings = {match[1]: match[2], **settings}
        parts.pop()
    return JOIN.join(parts), settings


@table_of("base setting first other pairs difference low high better")
def main_effects(sweep: Sweep, values: Values, confidence: float, num_resamples: int) -> Rows:
    """Return each value of a setting against its first one, all else and seeds being equal.

    Columns base (the swept condition), setting, first, other (its values), pairs (of runs),
    difference (median of the other's minus the first's), low, high (its interval, by resampling
    seeds), better (share of pairs in which the other is lower; ties count half).
    """
    for base, (k, setting) in itertools.product(sweep.bases, enumerate(sweep.settings)):
        first, *others = sweep.levels(k)
        for other in others:
            pairs = _pairs(sweep, base, k, (first, other), values)
            if not pairs.size:
                continue
            rng = np.random.Generator(np.random.PCG64(inference.BOOTSTRAP_SEED))
            drawn = rng.integers(0, len(pairs), (num_resamples, len(pairs)))
            medians = np.array([inference.quantile(pairs[seeds].ravel(), 0.5) for seeds in drawn])
            known = pairs[~np.isnan(pairs)]
            better = float((known < 0.0).mean() + 0.5 * (known == 0.0).mean())
            ends = inference.percentiles(medians, confidence)
            numbers = len(known), inference.quantile(known, 0.5), *ends, better
            yield base, setting, first, other, *numbers


def _pairs(
    sweep: Sweep, base: str, setting: int, levels: tuple[str, str], values: Values
) -> np.ndarray:
    """Return differences of two values of a setting, (seeds, combinations of the others); NaN."""
    runs = pd.concat(
        pd.DataFrame(
            {
                "seed": each.results.summaries.index,
                "level": each.values[setting],
                "rest": str(each.values[:setting] + each.values[setting + 1 :]),
                "value": values(each.results),
            }
        )
        for each in sweep.conditions
        if each.base == base
    ).set_index(["seed", "rest"])
    first, other = (runs.loc[runs["level"] == level, "value"] for level in levels)
    first, other = first.align(other, join="inner")
    differences = (other - first).where(other != first, 0.0)  # both may be infinite
    return differences.unstack("rest").to_numpy(np.float64)


def labelled(sweep: Sweep, names: Sequence[str]) -> str:
    """Return values with the names of their settings: "population_size = 20, num_elites = 0".

    Fewer values than settings are those of the first settings.
    """
    return ", ".join(f"{s} = {v}" for s, v in zip(sweep.settings, names, strict=False))


MOST_CURVES = 60  # curves of convergence on a page
SHARES = ("solved", "solved and proven free of contact")
MEASURES: dict[str, Values] = {  # that pages of sweeps tell, by name
    "best cost": by_column("best_cost"),
    "evaluations": by_column("evaluations"),
    "CPU time of the search [s]": search_seconds,
}


def best_condition(sweep: Sweep, results: Results) -> Results:
    """Return the results of the condition of the least median cost alone."""
    with_data = (each.results for each in sweep.conditions if each.results.done)
    best = sorted(with_data, key=lambda c: inference.quantile(c.column("best_cost"), 0.5))[:1]
    return results._replace(conditions=tuple(best))


def sweep_words(sweep: Sweep) -> dict[str, object]:
    """Return the words of the page's texts."""
    bases = [base for base in sweep.bases if base]
    panels = {(each.base, *each.values[:-2]) for each in sweep.conditions}
    return {
        "conditions": len(sweep.conditions),
        "combinations": len({each.values for each in sweep.conditions}),
        "names": " and ".join(f"`{name}`" for name in sweep.settings),
        "bases": f", each of {', '.join(bases)}" if len(bases) > 1 else "",
        "settings": labelled(sweep, ["…"] * len(sweep.settings)).replace(" = …", ""),
        "last": sweep.settings[-1],
        "more_grids": _more(len(panels)),
        "more_facets": _more(len({(each.base, *each.values[:-1]) for each in sweep.conditions})),
    }


def combinations(sweep: Sweep, confidence: float) -> Iterator[tuple[object, ...]]:
    """Yield a row per combination: shares of runs, and the spreads of what they took."""
    for each in sweep.conditions:
        c = each.results
        proven = inference.Proportion(certified(c).having, c.done)
        shares = (runs.with_interval(confidence) for runs in (success(c), proven))
        yield (
            *((each.base,) if any(sweep.bases) else ()),
            *each.values,
            f"`{c.hash12}`",
            c.done,
            *(shares if c.done else ("–", "–")),
            *(markdown.spread(inference.spread(of(c))) for of in MEASURES.values()),
        )


def effect_rows_by_value(effects: pd.DataFrame) -> Iterator[tuple[object, ...]]:
    """Yield a row per value that is compared with the first one of its setting."""
    for each in records(effects):
        difference, low, high = map(markdown.number, (each.difference, each.low, each.high))
        yield (
            *((each.base,) if effects["base"].any() else ()),
            each.setting,
            f"{each.first} → {each.other}",
            each.pairs,
            f"{difference} [{low}, {high}]",
            f"{100.0 * each.better:.0f} %",
        )


def _more(count: int) -> str:
    most = MOST_PANELS
    return f" The first {most} of {count} panels; the data have all." if count > most else ""


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


def best_trials(searched: Searched, trials: pd.DataFrame) -> Iterator[tuple[str, Any]]:
    """Yield words and row of each of the best trials, and of the experiment as it is."""
    best = trials.sort_values("score", kind="stable").head(MOST_ROWS)
    words = {trial.number: words_of(trial) for trial in searched.trials}
    for row in records(pd.concat([best, trials[:1]]).drop_duplicates("trial")):
        yield words[row.trial], row


def best_trial_by_problem(best_trial: Trial, search_scores: pd.DataFrame) -> Rows:
    """Yield (id, score as it is, score of the best trial) of each problem."""
    of_trial = search_scores["trial"]
    own, best = (search_scores[of_trial == number] for number in (0, best_trial.number))
    yield from zip(best_trial.ids, records(own), records(best), strict=True)


def best_of(results: Results) -> Results:
    """Return the results of the best trial of a search alone."""
    searched: Searched = results.searched
    trials = trial_table(searched, score_table(searched, results.conditions))
    ids = best_trial(searched, trials).ids
    return results._replace(conditions=tuple(c for c in results.with_data if c.condition.id in ids))


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "swept_conditions": lambda sweep: [c.results for c in sweep.conditions if c.results.done],
    "curves_are_few": lambda swept_conditions: 0 < len(swept_conditions) <= MOST_CURVES,
    "combination_headers": lambda sweep: (
        *["condition"] * any(sweep.bases),
        *(*sweep.settings, "hash", "n", *SHARES, *MEASURES),
    ),
    # effect of each value of each setting on the best cost
    "effects": lambda sweep, settings: main_effects(
        sweep, by_column("best_cost"), settings.confidence, settings.num_resamples
    ),
    "effect_table": lambda effects: effects,
    "effect_headers": lambda effects: (
        *["condition"] * bool(effects["base"].any()),
        *("setting", "value", "pairs", "change of the best cost", "better in"),
    ),
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
