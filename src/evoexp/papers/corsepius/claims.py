"""What Corsépius 2001 claims of single tasks, judged by their experiments."""

import numpy as np

from evoexp.papers.corsepius import measures
from evoexp.report import claims, markdown
from evoexp.report.claims import Claim, judge_greater
from evoexp.report.judging import claim, not_judged
from evoexp.report.proportions import fisher_exact
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

MANY_JOINTS = 6  # more than these are redundant
TILTS = ("upright", "keep_parallel")
BALL = "ball"  # the object of the task whose planning time the paper prints


def of_tasks(results: Results, settings: ReportSettings) -> tuple[Claim, ...]:
    """Return the claims that the conditions of an experiment can be judged by."""
    found: list[Claim] = []
    for c in results.main:
        found += [*_free_of_collision(results, c, settings), *_tilt(results, c)]
        found += _planning_time(c)
    return (*found, *_redundant(results, settings), *_stuck(results, settings))


def _free_of_collision(
    results: Results, condition: ConditionResults, settings: ReportSettings
) -> list[Claim]:
    """Judge that binary ratings of distances keep the whole motion free."""
    why, refuted = not_judged(results), measures.refuted(condition)
    free = measures.certified(condition).having
    told = f"{markdown.share(free, refuted.total)} solved runs certified; refuted "
    told += (
        f"{measures.text(refuted, settings.confidence)}: postures are free, what lies between "
        "them is not rated"
    )
    planned = refuted.total if condition.done == condition.planned else 0
    verdict = claims.judge_all(why, free, refuted.total, planned)
    return [claim(f"{condition.label}: paths avoid obstacles", "section 4.3.3", told, verdict, why)]


def _tilt(results: Results, condition: ConditionResults) -> list[Claim]:
    """Judge that a grasped object is not tilted."""
    why, found = not_judged(results), []
    for term in TILTS:
        limit = getattr(condition.planner.objective, term)
        if limit is None:
            continue
        having = measures.solved(condition)
        at, between = (
            condition.column(f"term_greatest_{term}{part}_deg")[having] for part in ("", "_between")
        )
        if not len(at):
            continue
        kept = int(np.count_nonzero(between <= limit.limit))
        told = (
            f"greatest tilt at postures {markdown.number(float(at.max()))}°, between them "
            f"{markdown.number(float(between.max()))}°, limit {limit.limit:g}°; within it all the "
            f"way: {markdown.share(kept, len(at))} solved runs"
        )
        planned = len(at) if condition.done == condition.planned else 0
        verdict = claims.judge_all(why, kept, len(at), planned)
        found.append(
            claim(
                f"{condition.label}: the grasped object is not tilted",
                "section 6",
                told,
                verdict,
                why,
            )
        )
    return found


def _redundant(results: Results, settings: ReportSettings) -> list[Claim]:
    """Judge that the approach applies to highly redundant arms.

    That it finds a certified path for one.
    """
    why, texts, certified = not_judged(results), [], 0
    for c in results.main:
        joints = len(c.condition.scenario.q_start)  # type: ignore[attr-defined]
        if joints > MANY_JOINTS:
            free = measures.certified(c).having
            certified += free
            met = measures.text(measures.success(c), settings.confidence)
            texts.append(f"{c.label}, {joints} joints: goal met {met}, {free} of them certified")
    if not texts:
        return []
    told = f"{'; '.join(texts)} (reproduced: a certified path, in one task at least)"
    found = claims.REPRODUCED if certified else claims.CONTRADICTED
    text = "The approach works for highly redundant arms"
    return [claim(text, "section 6", told, claims.NOT_JUDGED if why else found, why)]


def _planning_time(condition: ConditionResults) -> list[Claim]:
    """Set the planning time that the paper prints beside ours."""
    goals = [phase.goal for phase in condition.condition.scenario.phases]  # type: ignore[attr-defined]
    if len(goals) != 1 or getattr(goals[0], "object", "") != BALL or not condition.solved:
        return []
    seconds, cycles = measures.usual_seconds(condition), measures.cycles(condition)
    told = (
        f"here {1e3 * seconds.min():.2g} to {1e3 * seconds.max():.2g} ms of search on one core, "
        f"{cycles.min():.0f} to {cycles.max():.0f} cycles; theirs: a Pentium III, and some 30 000 "
        f"spheres to this model's {condition.prepared.problem.bodies.num_shapes}"
    )
    text = f"{condition.label}: planning takes a couple of seconds up to a few minutes"
    return [Claim(text, "section 5", told, f"{claims.NOT_JUDGED} (another machine, another model)")]


def _stuck(results: Results, settings: ReportSettings) -> list[Claim]:
    """Judge that the search gets stuck where a sub-goal shows that there is a way."""
    why, found = not_judged(results), []
    for c in results.main:
        for other in results.main:
            if not measures.only_subgoals_differ(c, other):
                continue
            stuck, helped = measures.success(c), measures.success(other)
            told = (
                f"goal met {measures.text(stuck, settings.confidence)}; {other.label}: "
                f"{measures.text(helped, settings.confidence)}; Fisher's exact p = "
                f"{markdown.p_value(fisher_exact(helped, stuck))}; ended by stagnation: "
                f"{measures.text(measures.reasons(c)['stagnation'], settings.confidence)}"
            )
            verdict = judge_greater(why, helped, stuck, settings.significance)
            found.append(
                claim(
                    f"{c.label}: the search gets stuck in a local minimum",
                    "section 6",
                    told,
                    verdict,
                    why,
                )
            )
    return found
