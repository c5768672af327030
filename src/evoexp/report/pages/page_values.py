"""Values that every page may name: of results and settings, comparisons, and motions."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.playback import player_page
from evoexp.playback.recording import Heading, NoMotion, Recording, record
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Drawing, PlayedRun, Player, Quantity, quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.run_measures import search_seconds, success
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import comparisons, judging
from evoexp.report.statistics.inference import Proportion, fisher_exact, holm, newcombe
from evoexp.store.log import TERM

FEW = 4  # conditions whose average costs can be drawn beside the best ones


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # evaluations of each run per second of its search, (done,) [1/s]
    "evaluations_per_second": lambda condition: (
        condition.column("evaluations") / search_seconds(condition)
    ),
    # motions that the exact verdict proves free, and further apart than required, of those judged
    "free": lambda condition: Proportion(condition.verdicts.certified, condition.verdicts.judged),
    "with_margin": lambda condition: Proportion(
        condition.verdicts.with_margin, condition.verdicts.judged
    ),
    # the quantities of a figure, without those that no run has
    "known": lambda of, results: {
        name: values
        for name, values in of.items()
        if any(not np.isnan(values(c)).all() for c in results.with_data)
    },
    # (quantity, position, condition, how many) of the shares of a figure
    "counts_of": lambda of, results: [
        (name, results.position(c.label), c.label, count(c))
        for name, count in of.items()
        for c in results.with_data
    ],
    "experiment": lambda results: results.experiment or "stored runs",  # as titles have it
    "conditions": lambda results: results.with_data,
    "main": lambda results: results.main,  # without controls and references
    "first": lambda results: results.with_data[0],
    "unit": lambda first: first.length_unit,  # of the first condition's scene
    "scenes_differ": lambda results: len({(c.robot, c.scenario) for c in results.with_data}) > 1,
    # some values of a figure are infinite
    "censored": lambda quantities, results: any(
        np.isposinf(of(c)).any() for of in quantities.values() for c in results.with_data
    ),
    "several": lambda results: len(results.with_data) > 1,  # there is something to compare
    "are_few": lambda results: len(results.evolved) <= FEW,
    # the first one against all others
    "whole": lambda conditions: [comparisons.Family.of(conditions)],
    "played": lambda condition: (PlayedRun(condition, condition.best_replicate),),
    "judge": lambda results, settings, rules: judging.judge(results, settings, rules),
    "confidence": lambda settings: settings.confidence,  # of every interval, in (0, 1)
    "level": lambda settings: 100 * settings.confidence,  # of every interval [%]
    "significance": lambda settings: settings.significance,
    "samples": lambda settings: settings.samples_per_segment,
}


def terms(results: Results) -> Iterator[Quantity]:
    """Yield the rows of the planner's own terms, those of the best solutions."""
    columns = {str(name) for c in results.with_data for name in c.summaries}
    for column in sorted(name for name in columns if name.startswith(TERM)):
        term = column.removeprefix(TERM)
        name, unit = term.replace("_", " "), "–"
        if term.endswith(("_deg", "_rad")):
            name, _, unit = name.rpartition(" ")
        elif "distance" in term or "clearance" in term:
            unit = results.with_data[0].length_unit or "–"
        yield quantity(results, name, unit, comparisons.by_column(column))


def effect_rows(
    compared: tuple[comparisons.FamilyComparison, ...], names: Mapping[str, str]
) -> dict[str, tuple[comparisons.Comparison, ...]]:
    """Return the comparisons of families by quantity: of all, or of the named ones."""
    rows = comparisons.rows_by_name(compared)
    return {shown: rows[name] for name, shown in names.items() if name in rows} if names else rows


# conditions of which every pair is tabled; of more, the first against each other one
MOST_PAIRED = 6


EFFORTS: dict[str, comparisons.Values] = {  # quantities that every planner records; lower is better
    "best cost": comparisons.by_column("best_cost"),
    "evaluations": comparisons.by_column("evaluations"),
    "collision queries": comparisons.by_column("collision_queries"),
    "CPU time, search [s]": search_seconds,
}
SHARES: dict[str, Callable[[ConditionResults], Proportion]] = {
    "solved": success,
    "certified": PAGE_VALUES["free"],
    "required margin kept": PAGE_VALUES["with_margin"],
}


def differing(results: Results) -> dict[str, comparisons.Values]:
    """Return the quantities that are not the same in every run, by name."""
    return {
        name: values
        for name, values in EFFORTS.items()
        if len(np.unique(np.concatenate([values(c) for c in results.evolved]))) > 1
    }


def _pairs(results: Results) -> list[comparisons.Pair]:
    """Return the pairs that tables hold; references have no seeds and stand aside."""
    first, *others = results.evolved
    if len(others) < MOST_PAIRED:
        return list(itertools.combinations(results.evolved, 2))
    return [(first, other) for other in others]


def pairs_of_conditions(
    results: Results, settings: ReportSettings, differing: dict[str, comparisons.Values]
) -> Iterator[tuple[str, tuple[comparisons.Comparison, ...]]]:
    """Compare pairs in every quantity in which they differ; p-values are adjusted within each."""
    of = "pairs of conditions"
    if len(results.evolved) > MOST_PAIRED:
        of = f"{results.evolved[0].label} against each other condition"
    pairs, named = _pairs(results), comparisons.AGAINST
    for name, values in differing.items():
        if rows := comparisons.compared(pairs, values, settings, named=named):
            yield f"{name}: {of}", rows


def difference_rows(results: Results, confidence: float) -> Iterator[tuple[str, ...]]:
    """Yield how far shares differ from each other; no row of one that is the same everywhere."""
    for name, of in SHARES.items():
        found = [(a, b, of(a), of(b)) for a, b in _pairs(results) if of(a).total and of(b).total]
        if len({p.share for _, _, *both in found for p in both}) < 2:
            continue
        p_values = [fisher_exact(one, two) for _, _, one, two in found]
        for (a, b, one, two), p, adjusted in zip(found, p_values, holm(p_values), strict=True):
            between = (one.share - two.share, *newcombe(one, two, confidence))
            difference, low, high = (f"{100 * x + 0.0:.0f}" for x in between)
            points = f"{difference} [{low}, {high}]".replace("-", "−")
            tests = markdown.p_value(p), markdown.p_value(adjusted)
            yield name, comparisons.AGAINST(a, b), points, *tests


JOIN = " · "  # between experiment and condition, as in the titles of `evoexp view`
VERDICTS = {True: "certified", False: "refuted", None: "undecided"}
MOST_SHOWN = 4  # conditions whose motions are shown, those with the least best cost


class ShownMotion(NamedTuple):
    """The best motion of a condition."""

    condition: ConditionResults  # the condition
    recording: Recording  # the motion of its best replicate


def players_of(drawings: Iterable[Drawing], experiment: str) -> dict[tuple[str, int], Player]:
    """Return the players of all motions that figures show, each once, by the keys of the runs."""
    players = dict[tuple[str, int], Player]()
    for c, k in {run.key: run for drawing in drawings for run in drawing.plays}.values():
        title = JOIN.join(dict.fromkeys(word for word in (experiment, c.label) if word))
        if motion := _recorded(c, k, title):
            words = f"{c.label}, replicate {k}: {VERDICTS[motion.verdict.certified]}"
            file = f"motion_{c.hash12}_{k:04d}.html"
            players[c.condition.id, k] = Player(words, file, player_page.page([motion]))
    return players


def _recorded(c: ConditionResults, replicate: int, title: str) -> Recording | None:
    try:
        return record(c.condition, c.solutions[replicate], Heading(title, replicate))
    except NoMotion:
        return None


def best_motions(results: Results) -> list[ShownMotion]:
    """Return the motions of the conditions with the least costs, at most `MOST_SHOWN`."""
    motions = (
        (c, _recorded(c, c.best_replicate, c.label))
        for c in sorted(results.with_data, key=_best_cost)
    )
    shown = itertools.islice((ShownMotion(c, own) for c, own in motions if own), MOST_SHOWN)
    return sorted(shown, key=lambda each: results.with_data.index(each.condition))


def motions(best_motions: Sequence[ShownMotion]) -> dict[str, Sequence[Any]]:
    """Return the values that figures of motions show, by name.

    `best` is the motion of the least cost alone, `covered` are those with the covers of their
    bodies, one per robot that has any.
    """
    covered: dict[object, tuple[ShownMotion, Sequence[Any]]] = {}
    for each in best_motions:
        planner, problem = each.condition.prepared
        if covers := tuple(planner.covers(problem)):
            key = each.condition.robot, len(covers)
            covered.setdefault(key, (each, covers))
    best = sorted(best_motions, key=lambda each: _best_cost(each.condition))[:1]
    return {
        "titled": [
            (f"{c.label}: {VERDICTS[recording.verdict.certified]}", recording)
            for c, recording in best_motions
        ],
        "conditions": [each.condition for each in best_motions],
        "runs": [PlayedRun(c, own.heading.replicate) for c, own in best_motions],
        "best": [each.recording for each in best],
        "best_condition": [each.condition for each in best],
        "covered": [(own.condition.label, own.recording, rows) for own, rows in covered.values()],
        "covered_conditions": [own.condition for own, _ in covered.values()],
    }


def notes(best_motions: Sequence[ShownMotion]) -> tuple[tuple[str, str], ...]:
    """Return (conditions, note): the notes on the conditions whose motions are shown."""
    labels: dict[str, dict[str, None]] = {}  # note → labels of its conditions, in order
    for motion in best_motions:
        for note in motion.condition.condition.notes():
            labels.setdefault(note, {})[motion.condition.label] = None
    return tuple((", ".join(own), note) for note, own in labels.items())


def _best_cost(condition: ConditionResults) -> float:
    cost = float(condition.summaries["best_cost"].astype("float64").min())
    return cost if np.isfinite(cost) else np.inf
