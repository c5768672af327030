"""The claims of Rana & Zalzala 1995, judged by their experiments, ablations and controls."""

from collections.abc import Iterator, Sequence

import numpy as np

from evoexp.papers.rana import measures
from evoexp.papers.rana.measures import AT, BETWEEN, EVENNESS
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.parameters import overridden, parameters, planned_replicates
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import comparisons, judging
from evoexp.report.statistics.claim_rules import Rules
from evoexp.report.statistics.comparisons import Comparison, Family, Measure
from evoexp.report.statistics.inference import fisher_family, spread
from evoexp.report.statistics.judging import Judge

PRINTED = "as printed"  # label of the printed setting among the ablations
PARTS = ("no redistribution", "no relaxation (δ = 0)", "neither")  # of the claim
ASSUMED = "sections 3.5 and 4.2"  # where the paper makes claims that assumed numbers touch
COST = "best cost"
COMPARED = (
    Measure(COST, comparisons.by_column("best_cost")),
    Measure(EVENNESS, measures.unevenness, "deg"),
)
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


def free_at_via_points(own_judge: Judge, condition: ConditionResults, who: str) -> Claim:
    """Judge that the motion is free of collision at the via-points."""
    source = "section 3.5, Fig. 4" if measures.planar(condition) else "section 4.2, Fig. 11"
    return _free(own_judge, condition, who, source)


def assumed_free(judge: Judge, condition: ConditionResults) -> Claim:
    """Judge that the motion is free at the via-points, under assumed numbers."""
    return _free(judge, condition, "", ASSUMED)


def _free(judge: Judge, c: ConditionResults, who: str, source: str) -> Claim:
    told = f"{markdown.share(c.solved, c.done)} finished runs of {c.planned} planned"
    hearing = judge.on("free_at_via_points", who=who, source=source)
    return hearing.majority(told, c.solved, c.done)


def safety(own_judge: Judge, condition: ConditionResults, who: str) -> Iterator[Claim]:
    """Judge the safety distance, where the paper looks and where it does not."""
    c, unit, margin = condition, condition.length_unit, measures.margin(condition)
    source = "section 3.5, Fig. 7" if measures.planar(c) else "section 4.2, Fig. 13"
    kept = markdown.share(c.verdicts.with_margin, c.verdicts.judged)
    bodies = (
        f"; the bodies themselves come as close as "
        f"{markdown.number(float(c.column('clearance').min()))} {unit} (margin certified in {kept})"
    )
    for name, column, more in (
        ("safety_at_via_points", AT, ""),
        ("safety_between_via_points", BETWEEN, bodies),
    ):
        values = c.column(column)
        safe = int(np.count_nonzero(values >= margin))
        told = (
            f"{markdown.share(safe, c.done)} runs never below {margin:g} {unit}; least "
            f"{markdown.number(float(np.min(values)))}, median "
            f"{markdown.number(spread(values).median)} {unit}{more}"
        )
        hearing = own_judge.on(name, who=who, source=source)
        yield hearing.majority(told, safe, c.done)


def assumed_safety(judge: Judge, condition: ConditionResults) -> Claim:
    """Judge the safety distance between via-points under assumed numbers."""
    c, values = condition, measures.safety_share(condition)
    safe = int(np.count_nonzero(values >= 1.0))
    told = (
        f"{markdown.share(safe, c.done)} runs never below it; least "
        f"{markdown.number(float(np.min(values)))} times, at via-points "
        f"{markdown.number(float(np.min(c.column(AT))) / measures.margin(c))} times"
    )
    hearing = judge.on("safety_between_via_points", who="", source=ASSUMED)
    return hearing.majority(told, safe, c.done)


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
    return operator_claims(stored, own, who, PRINTED) or [alone.elsewhere(told)]


def evolution(results: Results, own_judge: Judge, condition: ConditionResults, who: str) -> Claim:
    """Judge what evolution adds to every control."""
    beside = [
        c
        for c in results.evolved
        if c.is_control and comparisons.beside(condition.condition, c.condition)
    ]
    told, rows = measures.evolution_told(own_judge, condition, beside)
    return own_judge.on("evolution_adds", who=who).better_than_all(told, rows)


def assumed_evolution(judge: Judge, condition: ConditionResults, controls: Controls) -> Claim:
    """Judge what evolution adds to every control, under assumed numbers."""
    told, rows = measures.evolution_told(judge, condition, controls)
    return judge.on("evolution_adds", who="").better_than_all(told, rows)


def operator_claims(results: Results, judge: Judge, who: str = "", first: str = "") -> list[Claim]:
    """Judge the paper's claim about relaxation and redistribution, part by part that was run.

    `who` begins each claim; `first` is the label of the printed setting, or else the first one.
    """
    named = {condition.label: condition for condition in results.with_data}
    printed = named.get(first or next(iter(named), ""))
    if printed is None:
        return []
    others = [other for other in named.values() if other is not printed]
    found = comparisons.compare_families(
        [Family.of([printed, *others])], COMPARED[:2], judge.settings
    )
    rows = {one.measure.name: {row.quantity: row for row in one.rows} for one in found}
    parts = [other for other in others if other.label in PARTS]
    counts = {c.label: measures.refuted(c) for c in (printed, *parts)}
    own, level = counts[printed.label], judge.settings.significance
    p_values = fisher_family([(own, counts[part.label]) for part in parts])
    claims = []
    for part, p_value in zip(parts, p_values, strict=True):
        other = counts[part.label]
        says = [by[part.label].says(level) for by in rows.values() if part.label in by]
        says.append(judging.greater(other, own, p_value, level))
        told = (
            f"{_told(rows[COST].get(part.label), COST, '–')}; "
            f"{_told(rows[EVENNESS].get(part.label), EVENNESS, 'deg', (printed, part))}; "
            f"refuted motions {markdown.share(own.having, own.total)} with, "
            f"{markdown.share(other.having, other.total)} without, p = {markdown.p_value(p_value)}"
        )
        hearing = judge.on("operators_improve", who=who, without=part.label)
        claims.append(hearing.own(told, printed.done, improves(says)))
    return claims


def improves(says: list[int]) -> bool | None:
    """Return whether a part improves the search; None: nobody can say, or it is a trade.

    Each quantity says 1 if it is significantly better with the part, −1 if worse, else 0.
    """
    better, worse = 1 in says, -1 in says
    return None if better == worse else better


def _told(
    row: Comparison | None,
    name: str,
    unit: str,
    pair: tuple[ConditionResults, ConditionResults] | None = None,
) -> str:
    """Return a comparison in words, with the medians of both where the pair is given."""
    if row is None:
        return f"{name}: nothing to compare"
    shown = "" if unit == "–" else f" {unit}"
    medians = ""
    if pair is not None:
        with_it, without = (markdown.number(float(np.median(measures.unevenness(c)))) for c in pair)
        medians = f"{with_it}{shown} with, {without}{shown} without, "
    difference = markdown.number(row.median_difference)
    told = judging.evidence(row, "lower")
    return f"{name}: {medians}difference of medians {difference}{shown}, {told}"


def extensions(judge: Judge, condition: ConditionResults) -> Iterator[Claim]:
    """Judge section 5's claims of extension: static obstacles, more than two arms."""
    problem, unit = condition.problem(Problem), condition.length_unit
    arms, kinds = problem.assembly.num_arms, measures.kinds_of_pairs(condition)
    found = []
    if measures.TO_OBSTACLES in kinds:
        found.append("The algorithm can easily be extended to static obstacles")
    if arms > 2:
        found.append(f"The algorithm plans for any multi-arm system, here for {arms} arms")
    exact, verdicts = measures.approaches(condition), condition.verdicts
    told = [
        f"{kind} {markdown.number(float(own['clearance'].min()))} {unit} at least (required "
        f"{margin:g}, kept in {markdown.share(int(own['kept'].sum()), len(own))})"
        for kind, (_, margin) in kinds.items()
        for own in (exact[exact["kind"] == kind],)
    ]
    for name in found:
        for rule, evidence, holds in (
            ("extends_at_via_points", "finished runs", condition.solved),
            ("extends_whole_motion", "motions certified", verdicts.certified),
            ("extends_with_margin", f"motions keep them; {', '.join(told)}", verdicts.with_margin),
        ):
            text = f"{markdown.share(holds, condition.done)} {evidence}"
            hearing = judge.on(rule, extension=name)
            yield hearing.majority(text, holds, condition.done)


def collision_weight(judge: Judge, first: ConditionResults) -> list[Claim]:
    """Judge that collisions are avoided at all costs, with the weight k3 as printed."""
    straight, worth = measures.straight_length(first), measures.worth(first)
    hits = first.evaluate(measures.straight_line(first))["collisions"]
    told = f"{markdown.share(first.solved, first.done)} finished runs end free at via-points"
    done, planned, share = first.done, first.planned, worth / straight
    evidence = (
        f"one colliding instant costs as much as {markdown.number(worth)}° of path, "
        f"{100 * share:.1f} % of the straight paths' {markdown.number(straight)}°; the straight "
        f"line collides at {hits:.0f} instants, the best strings are longer by "
        f"{markdown.number(float(np.median(measures.length(first))) - straight)}° in the median"
    )
    outweighs = judge.on("collisions_outweigh_paths")
    least = outweighs.rule.limits["share"]
    return [
        judge.on("collisions_avoided").every(told, first.solved, done, planned),
        outweighs.own(evidence, done, True if share >= 1.0 else False if share < least else None),
    ]
