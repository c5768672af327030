"""The claims of Curkovic et al. 2013 on methods and motions, and under assumed numbers."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from evoexp.papers.curkovic import measures
from evoexp.planners.coevolution.planner import Problem
from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim, Quantity, quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.comparisons import Comparison, by_column, compared
from evoexp.report.statistics.inference import Proportion
from evoexp.report.statistics.judging import Judge

Rows = tuple[Comparison, ...]
Conditions = Sequence[ConditionResults]
PAIRS = (("V", "I"), ("VI", "II"), ("VII", "III"), ("VIII", "IV"))  # with a hall, and without
EFFORT = "evaluations to a team whose cost is the threshold"
TWINS = dict(PAIRS)
METHOD, ELITES = "V", "15 elites"
KEPT = "least distance of an end-effector from another robot's links"


def matched_pairs(results: Results, settings: ReportSettings, threshold: float) -> list[Rows]:
    """Compare methods with their twins: by cost, generations, and cost with refuted ones worst."""
    by_label = {c.label: c for c in results.with_data}
    pairs = [(by_label[a], by_label[b]) for a, b in PAIRS if {a, b} <= set(by_label)]
    matched = partial(
        compared, pairs, settings=settings, named=lambda a, b: f"{a.label} against {b.label}"
    )
    generations = partial(measures.generations_to, threshold=threshold)
    values = by_column("best_cost"), generations, measures.certified_cost
    return list(map(matched, values))


def method_comparisons(matched_pairs: list[Rows], threshold: float) -> list[tuple[str, Rows]]:
    """Return (heading, comparisons) of matched pairs."""
    to = markdown.number(threshold)
    titles = "best cost of a team", f"generations to a team below {to}", measures.CERTIFIED
    return [
        (f"{title}: matched pairs of methods", rows)
        for title, rows in zip(titles, matched_pairs, strict=True)
        if rows
    ]


def judge_methods(
    judge: Judge, results: Results, matched_pairs: list[Rows], threshold: float
) -> list[Claim]:
    """Judge the claims on methods of co-evolution."""
    costs, generations, certified = matched_pairs
    judged = {  # measure → the word of the better one, comparisons
        f"a team of cost ≤ {markdown.number(threshold)}": ("earlier", generations),
        "the best cost at the end": ("lower", costs),
        measures.CERTIFIED: ("lower", certified),
    }
    found = [
        judge.on("faster", who="", measure=title, pair=f": {row.quantity}").better(row, word)
        for title, (word, rows) in judged.items()
        for row in rows
    ]
    slowest = max((float(c.column("cpu_s").max()) for c in results.with_data), default=np.nan)
    solved, done = sum(c.solved for c in results.with_data), sum(c.done for c in results.with_data)
    planned = sum(c.planned for c in results.conditions)
    told = (
        f"{markdown.share(solved, done)} runs found one; the slowest run took "
        f"{markdown.number(slowest)} s of CPU"
    )
    in_time = solved if slowest < judge.rules["in_time"].limits["seconds"] else 0
    return [*found, judge.on("in_time").every(told, in_time, done, planned)]


def radius_conditions(results: Results) -> tuple[ConditionResults, ...]:
    """Return conditions by collision substeps and growing radius; none if no radius differs."""
    by_radius = sorted(results.main, key=lambda c: float(c.planner.collision.tcp_radius))
    differ = len({c.planner.collision.tcp_radius for c in by_radius}) > 1
    return tuple(itertools.chain(*_by_substeps(by_radius))) if differ else ()


def _by_substeps(conditions: Conditions) -> tuple[tuple[ConditionResults, ...], ...]:
    return run_measures.grouped(conditions, lambda c: c.planner.collision.collision_substeps)


def compared_radii(radius_conditions: Conditions, settings: ReportSettings) -> Rows:
    """Compare the largest radius with the smallest one, for every number of collision substeps."""

    def named(largest: ConditionResults, smallest: ConditionResults) -> str:
        substeps = largest.planner.collision.collision_substeps
        tested = "" if substeps == 1 else f" (tested at {substeps} substeps)"
        return f"{KEPT}: {largest.label} against {smallest.label}{tested}"

    pairs = [(own[-1], own[0]) for own in _by_substeps(radius_conditions) if len(own) > 1]
    return compared(pairs, measures.tool_distance, settings, lower_is_better=False, named=named)


def tool_comparisons(compared_radii: Rows) -> list[tuple[str, Rows]]:
    """Return (heading, comparisons) of radii."""
    return [("Largest against smallest radius", compared_radii)] if compared_radii else []


def tools(results: Results, compared_radii: Rows) -> list[Quantity]:
    """Return the row of end-effectors' distances where radii differ."""
    name = f"{KEPT}, its centre line"
    unit = results.with_data[0].length_unit
    row = quantity(results, name, unit, measures.tool_distance) if compared_radii else None
    return [row] if row else []


def judge_motions(judge: Judge, results: Results, compared_radii: Rows) -> list[Claim]:
    """Judge the claims on motions and radii."""
    found = list[Claim]()
    for c in results.main:
        name, scene, where = _scene_claim(c)
        words = {"condition": c.label, "scene": scene, "where": where}
        hearing = judge.on(name, judge="the paper's model", **words)
        told = f"{markdown.share(c.solved, c.done)} runs"
        found.append(hearing.majority(told, c.solved, c.done))
        if enveloped(c):
            free = int(np.count_nonzero(measures.free_by_envelope(c)))
            told = f"{markdown.share(free, c.done)} runs, {measures.INSTANTS} instants per segment"
            hearing = judge.on(name, judge="the paper's own envelope on the whole motion", **words)
            found.append(hearing.majority(told, free, c.done))
        found.append(_whole_motion_free(judge, name, c, words))
    found += [
        judge.on("larger_radius", pair=row.quantity).better(row, "larger") for row in compared_radii
    ]
    return found


def _scene_claim(condition: ConditionResults) -> tuple[str, str, str]:
    """Return the name of the claim that the paper makes of a scene, its words, and its source."""
    problem, other = condition.problem(Problem), "free_in_other_scenes"
    if len(problem.start) > 2:
        text = "The method takes new robots: it finds a collision-free motion of three"
        return other, text, "section 5"
    if not problem.moving.all():
        text = "One robot stands still, obstacles stand around: a collision-free motion"
        return other, text, "section 4, Fig. 10"
    if enveloped(condition):
        text = "Envelopes and circles: a collision-free motion of the robots with their bodies"
        return other, text, "section 4"
    return (
        "free_motion",
        "A collision-free motion of two robots in each other's way",
        "section 4, Figs. 8, 9",
    )


def enveloped(condition: ConditionResults) -> bool:
    """Return whether the search tests more of the robots than their lines."""
    collision = condition.planner.collision
    return bool(collision.half_width > 0.0 or collision.tcp_radius > 0.0)


def judge_criteria(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge that each criterion that the paper added is needed: what it measures suffers without.

    The first condition has all criteria; its labels name what the others leave out.
    """
    first, *others = results.main
    for name, values, weight in (
        ("C3", measures.rotation, "rotation_weight"),
        ("C4", measures.unevenness, "evenness_weight"),
    ):
        without = [c for c in others if getattr(c.planner.objective, weight) == 0.0]
        rows = compared([(first, c) for c in without], values, judge.settings)
        medians = ", ".join(
            f"{c.label} {markdown.number(float(np.median(values(c))))}" for c in (first, *without)
        )
        told = "; ".join(f"{row.quantity}: {judging.evidence(row, 'smaller')}" for row in rows)
        hearing = judge.on("criterion_needed", criterion=name)
        yield hearing.better_than_all(f"median {name}: {medians}; {told}", rows)


def motion_checks(results: Results) -> tuple[tuple[str, str], ...]:
    """Return the rows on bodies that stick out, and on the length of the chromosome."""
    first = results.with_data[0]
    checks = []
    if enveloped(first):
        models = {c.label: c.planner.collision for c in results.with_data}
        sticks = [name for name, model in models.items() if model.tcp_radius < model.half_width]
        title = (
            "Boundary lines have no ends: the body of a link, round at its end, sticks out where "
            "the tool is smaller"
        )
        checks.append((title, "; ".join(sticks) or "nowhere"))
    notes = first.planner.notes(first.prepared.problem)
    return (*checks, *(("Length of the chromosome (Eqs. 2, 3)", note) for note in notes))


def crossing(main: Conditions) -> Conditions:
    """Return the first condition if it is one of two moving robots of lines; empty otherwise."""
    first = main[0]
    problem = first.problem(Problem)
    plain = len(problem.start) == 2 and not enveloped(first) and problem.moving.all()
    return (first,) if plain else ()


def motion_words(condition: ConditionResults, radius_conditions: Conditions) -> dict[str, str]:
    """Return stems and titles of the figures of a motion, and the beginning of that of angles."""
    problem = condition.problem(Problem)
    robots = len(problem.start)
    angles = {"joints_stem": "joints", "joints": "Link"}
    if not problem.moving.all():
        return {"stem": "fig_10_motion", "title": "Fig. 10: one robot stands still"} | angles
    if robots > 2 or radius_conditions:
        return {"stem": "motion", "title": f"Motion of {robots} robots"} | angles
    angles = {"joints_stem": "fig_9_joints", "joints": "Fig. 9: link"}
    return {"stem": "fig_8_motion", "title": "Fig. 8: motion of the two robots"} | angles


def with_hall(results: Results) -> Results:
    """Return the results of the methods with a hall, under all numbers."""
    treated = (c for c in results.conditions if _method(c) in TWINS)
    return results._replace(conditions=tuple(treated))


def _method(condition: ConditionResults) -> str:
    return condition.label.partition(", ")[0]


def effort(condition: ConditionResults, settings: ReportSettings) -> FloatArray:
    """Return the evaluations to a team of the threshold's cost in its own scene, (done,)."""
    threshold = settings.threshold_ratio * measures.lower_bound(condition)
    return measures.evaluations_to(condition, threshold)


def assumed_faster(judge: Judge, condition: ConditionResults, results: Results) -> Claim:
    """Judge a method with a hall against its twin without, under the same numbers."""
    method = _method(condition)
    pair = f": {method} against {TWINS[method]}"
    hearing = judge.on("faster", who="", measure=EFFORT, pair=pair)
    values = partial(effort, settings=judge.settings)
    twin = _twin(results, condition, TWINS[method])
    return hearing.better(judge.compared(condition, twin, values) if twin else None, "lower")


def assumed_refuted(judge: Judge, condition: ConditionResults, results: Results) -> Claim:
    """Judge the share of refuted motions beside that of the twin without a hall."""
    plain = TWINS[_method(condition)]
    twin = _twin(results, condition, plain)
    known = (measures.defects(c).refuted if c else Proportion(0, 0) for c in (condition, twin))
    own, others = known
    told = f"{own} with a hall, {others} without"
    return judge.on("refuted_more", plain=plain).greater(told, own, others)


def assumed_elites(judge: Judge, condition: ConditionResults, results: Results) -> Claim | None:
    """Judge method V against elites under the same numbers, where elites were run."""
    twin = _twin(results, condition, ELITES)
    if twin is None or _method(condition) != METHOD:
        return None
    row = judge.compared(condition, twin, by_column("best_cost"))
    hearing = judge.on("hall_beyond_elites", who="", elites=ELITES, measure="best cost")
    told = judging.evidence(row, "lower") if row else "nothing to compare"
    return hearing.better_than_all(told, [row] if row else [])


def _twin(results: Results, condition: ConditionResults, other: str) -> ConditionResults | None:
    """Return another treatment of the same scene under the same numbers, or None.

    Numbers of the hall are no numbers of a treatment without one: these are as assumed then.
    """
    readings = set(condition.label.split(", "))
    scene = condition.robot, condition.scenario
    twins = [c for c in results.with_data if _method(c) == other and (c.robot, c.scenario) == scene]
    alike = [c for c in twins if set(c.label.split(", ")) - {other} <= readings]
    return max(alike, key=lambda c: c.label.count(", "), default=None)


def assumed_free(judge: Judge, condition: ConditionResults) -> Claim | None:
    """Judge that the whole motion of method V is free, under assumed numbers."""
    if _method(condition) != METHOD:
        return None
    scene = "a collision-free motion of two robots in each other's way"
    words = {"condition": "Figs. 8, 9", "scene": scene, "where": "section 4, Figs. 8, 9"}
    return _whole_motion_free(judge, "free_motion", condition, words)


def _whole_motion_free(
    judge: Judge, name: str, c: ConditionResults, words: dict[str, str]
) -> Claim:
    free, judged = run_measures.certified(c).having, c.done - c.verdicts.undecided
    hearing = judge.on(name, judge="the exact verdict on the whole motion", **words)
    return hearing.majority(f"{markdown.share(free, judged)} runs", free, judged)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "pairs": lambda: PAIRS,
    "has_hall": lambda condition: condition.label in TWINS,
}
