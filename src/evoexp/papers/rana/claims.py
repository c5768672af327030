"""The claims of Rana & Zalzala 1995, judged by their experiments, ablations and controls."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from evoexp.papers.rana import measures
from evoexp.papers.rana.measures import AT, BETWEEN, EVENNESS
from evoexp.planners.baselines.controls import IteratedLocalSearch
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.parameters import overridden, parameters, planned_replicates
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import comparisons, judging
from evoexp.report.statistics.comparisons import Comparison, Family, Measure
from evoexp.report.statistics.inference import Proportion, fisher_family, spread
from evoexp.report.statistics.judging import Judge, Rules

PRINTED = "as printed"  # label of the printed setting among the ablations
PARTS = ("no redistribution", "no relaxation (δ = 0)", "neither")  # of the claim
NO_LOCAL_SEARCH = "no local search beside it: see rana_claims"
COST = "best cost"
BEST = comparisons.by_column("best_cost")
COMPARED = Measure(COST, BEST), Measure(EVENNESS, measures.unevenness, "deg")
Controls = Sequence[ConditionResults]


def not_judged(results: Results, condition: ConditionResults) -> str:
    """Return why claims are not judged on a condition; empty if they are."""
    if results.budget != "paper":
        return f"budget {results.budget or 'unknown'}"
    if condition.is_control:
        return judging.ONLY_CONTROLS
    planned = planned_replicates(results)
    if condition.planned < planned:
        return f"{condition.planned} of {planned} replicates planned"
    changed = overridden(parameters(results, condition))
    return f"overridden: {', '.join(changed)}" if changed else ""


def own_judge(
    results: Results, settings: ReportSettings, rules: Rules, condition: ConditionResults
) -> Judge:
    """Return the judge of a condition's claims."""
    return Judge(not_judged(results, condition), settings, rules)


def operators(
    results: Results, own_judge: Judge, condition: ConditionResults, who: str
) -> list[Claim]:
    """Judge the claim about the two operators from the stored ablations of the same scene."""
    experiment = f"rana_{'planar' if measures.planar(condition) else 'puma'}_ablations"
    stored = results.beside(experiment)
    reason = own_judge.reason or (judging.not_judged(stored) if stored.with_data else "")
    own = own_judge._replace(reason=reason)
    told = f"its ablations are not stored: `evoexp run experiment={experiment}`"
    alone = own_judge.on("operators_improve", who=who, without="each alone")
    return [*operator_claims(stored, own, who, PRINTED)] or [alone.elsewhere(told)]


def operator_claims(
    results: Results, judge: Judge, who: str = "", first: str = ""
) -> Iterator[Claim]:
    """Judge the paper's claim about relaxation and redistribution, part by part that was run.

    `who` begins each claim; `first` is the label of the printed setting, or else the first one.
    """
    named = {condition.label: condition for condition in results.with_data}
    printed = named.get(first or next(iter(named), ""))
    if printed is None:
        return
    others = [other for other in named.values() if other is not printed]
    found = comparisons.compare_families([Family.of([printed, *others])], COMPARED, judge.settings)
    rows = {one.measure.name: {row.quantity: row for row in one.rows} for one in found}
    parts = [other for other in others if other.label in PARTS]
    counts = {c.label: measures.refuted(c) for c in (printed, *parts)}
    own, level = counts[printed.label], judge.settings.significance
    p_values = fisher_family([(own, counts[part.label]) for part in parts])
    for part, p_value in zip(parts, p_values, strict=True):
        other = counts[part.label]
        says = [by[part.label].says(level) for by in rows.values() if part.label in by]
        says.append(judging.greater(other, own, p_value, level))
        medians = [float(np.median(measures.unevenness(c))) for c in (printed, part)]
        told: dict[str, object] = {
            "cost": _told(rows[COST].get(part.label), COST, ""),
            "evenness": _told(rows[EVENNESS].get(part.label), EVENNESS, " deg", medians),
        }
        told |= {"own": own, "other": other, "p": p_value}
        hearing = judge.on("operators_improve", who=who, without=part.label)
        yield hearing.own(told, printed.done, improves(says))


def improves(says: list[int]) -> bool | None:
    """Return whether a part improves the search; None: nobody can say, or it is a trade.

    Each quantity says 1 if it is significantly better with the part, −1 if worse, else 0.
    """
    better, worse = 1 in says, -1 in says
    return None if better == worse else better


def _told(row: Comparison | None, name: str, unit: str, medians: Sequence[float] = ()) -> str:
    """Return a comparison in words, with the medians with and without a part, where given."""
    if row is None:
        return f"{name}: nothing to compare"
    numbers = [f"{markdown.number(each)}{unit}" for each in (*medians, row.median_difference)]
    of_both = "{} with, {} without, ".format(*numbers) if medians else ""
    told = judging.evidence(row, "lower")
    return f"{name}: {of_both}difference of medians {numbers[-1]}, {told}"


def evolution(results: Results, own_judge: Judge, condition: ConditionResults, who: str) -> Claim:
    """Judge what evolution adds to every control of a condition."""
    beside = [
        c
        for c in results.evolved
        if c.is_control and comparisons.beside(condition.condition, c.condition)
    ]
    return evolution_adds(own_judge, condition, beside, who)


def evolution_adds(
    judge: Judge, condition: ConditionResults, controls: Controls, who: str = ""
) -> Claim:
    """Judge what evolution adds to each control, that of the lowest median cost first.

    It is not judged beside weaker controls than local search alone.
    """
    if not any(isinstance(c.condition.planner, IteratedLocalSearch) for c in controls):
        judge = judge._replace(reason=judge.reason or NO_LOCAL_SEARCH)
    pairs = [(condition, control) for control in controls if control.done]
    rows = {row.quantity: row for row in comparisons.compared(pairs, BEST, judge.settings)}
    shown = [control for control in controls if control.label in rows]
    shown.sort(key=lambda control: float(np.median(BEST(control))))
    found = {c.label: spread(c.column("term_fitness")) for c in (condition, *shown)}
    fitness = " · ".join(f"{label} {markdown.spread(own)}" for label, own in found.items())
    straight = condition.evaluate(measures.straight_line(condition))["fitness"]
    told = [f"fitness F: {fitness} · straight line {markdown.number(straight)}"]
    for place, control in enumerate(shown):
        row = rows[control.label]
        which = f"the best control, {control.label}" if place == 0 else control.label
        told.append(
            f"to {which}, evolution adds {markdown.number(-row.median_difference)} to the median: "
            f"its best cost is {judging.evidence(row, 'lower')}"
        )
    if not shown:
        told.append("no control beside it")
    compared = [rows[control.label] for control in shown]
    return judge.on("evolution_adds", who=who).better_than_all("; ".join(told), compared)


def extensions(condition: ConditionResults) -> Iterator[str]:
    """Yield section 5's claims of extension: to static obstacles, to more than two arms."""
    if measures.TO_OBSTACLES in measures.kinds_of_pairs(condition):
        yield "The algorithm can easily be extended to static obstacles"
    if (arms := condition.problem(Problem).assembly.num_arms) > 2:
        yield f"The algorithm plans for any multi-arm system, here for {arms} arms"


def least_distances(condition: ConditionResults) -> str:
    """Return the least distance of each kind of pairs, and in how many motions it is enough."""
    exact, unit = measures.approaches(condition), condition.length_unit
    return ", ".join(
        f"{kind} {markdown.number(float(own['clearance'].min()))} {unit} at least (required "
        f"{margin:g}, kept in {counted(own['kept'])})"
        for kind, (_, margin) in measures.kinds_of_pairs(condition).items()
        for own in (exact[exact["kind"] == kind],)
    )


def outweighs(share_of_path: float, rules: Rules) -> bool | None:
    """Return whether no shorter path outweighs a collision; None: nobody can say."""
    least = rules["collisions_outweigh_paths"].limits["share"]
    return True if share_of_path >= 1.0 else False if share_of_path < least else None


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "safe_at": lambda condition, margin: condition.column(AT) >= margin,
    "safe_between": lambda condition, margin: condition.column(BETWEEN) >= margin,
    "least_share_at": lambda condition, margin: condition.column(AT).min() / margin,
    "certified_of_all": lambda condition: Proportion(condition.verdicts.certified, condition.done),
    "margin_of_all": lambda condition: Proportion(condition.verdicts.with_margin, condition.done),
    # a colliding instant costs so many straight paths of all arms together
    "share_of_path": lambda worth, straight_length: worth / straight_length,
    "percent_of_path": lambda share_of_path: 100.0 * share_of_path,
}
