"""The page of motions of Curkovic et al. 2013, Figs. 7–11: curves, their defects, scenes."""

import itertools
from collections.abc import Iterator

import numpy as np

from evoexp.papers.curkovic import link_motions, measures
from evoexp.papers.curkovic.figures import link_intersection, motion_curves, robot_motions
from evoexp.papers.curkovic.rules import PAPER, RULES
from evoexp.planners.coevolution.link_problem import Problem
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown

SAMPLES = 20  # per segment, where the distance of end-effectors from other robots is measured
KEPT = "least distance of an end-effector from another robot's links"


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of motions, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    tools = _tools(results, settings)
    own = {"times_over_limit": measures.times_over_limit, "tool_distance": tool_distance}
    return PAPER.page(
        results,
        "motion",
        base,
        quantities=(
            *PAPER.quantities(results, "motion", own),
            *(PAPER.quantities(results, "tools", own) if tools else ()),
            *base.quantities[1:],
        ),
        claims=_claims(results, settings, tools),
        checks=_checks(results),
        comparisons=(
            *base.comparisons,
            *((("Largest against smallest radius", tools),) if tools else ()),
        ),
        drawings=(*_drawings(results, settings), generic.best_drawing(results)),
    )


def tool_distance(condition: kit.ConditionResults) -> FloatArray:
    """Return how near any end-effector comes to a link of another robot, (done,) [length unit].

    Links and end-effectors have no thickness here.
    """
    prepared, found = condition.prepared, []
    arms = link_motions.arms(prepared)
    for k in condition.summaries.index:
        motion = link_motions.executed(prepared, condition.solutions[int(k)])
        links = np.radians(link_motions.sampled(motion, SAMPLES).links)
        chains = []  # of each robot: base, elbows, tips
        for r, arm in enumerate(arms):
            points = arm.outlines(links[:, r, :, None])[:, :4, 0]
            base = np.broadcast_to(arm.base, (len(links), 2))
            chains.append((base, points[:, :2], points[:, 2:]))
        distances = (
            to_segment(own[-1], start, end)
            for own, other in itertools.permutations(chains, 2)
            for start, end in itertools.pairwise(other)
        )
        found.append(min(distances))
    return np.array(found)


def to_segment(points: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the least distance of points from segments, row by row; each (rows, 2)."""
    along = end - start
    share = np.clip(((points - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    return float(np.sqrt(((points - start - share[:, None] * along) ** 2).sum(axis=1)).min())


def _by_radius(results: kit.Results) -> dict[int, list[kit.ConditionResults]]:
    """Return collision substeps → conditions by growing radius; nothing if no radius differs."""
    found: dict[int, list[kit.ConditionResults]] = {}
    for c in sorted(results.main, key=lambda c: float(c.planner.collision.tcp_radius)):
        found.setdefault(c.planner.collision.collision_substeps, []).append(c)
    several = len({c.planner.collision.tcp_radius for c in results.main}) > 1
    return found if several else {}


def _tools(results: kit.Results, settings: kit.ReportSettings) -> tuple[kit.Comparison, ...]:
    """Compare the largest radius with the smallest one, for every number of collision substeps."""

    def named(largest: kit.ConditionResults, smallest: kit.ConditionResults) -> str:
        substeps = largest.planner.collision.collision_substeps
        tested = "" if substeps == 1 else f" (tested at {substeps} substeps)"
        return f"{KEPT}: {largest.label} against {smallest.label}{tested}"

    pairs = [(own[-1], own[0]) for own in _by_radius(results).values() if len(own) > 1]
    return kit.compared(pairs, tool_distance, settings, lower_is_better=False, named=named)


def _claims(
    results: kit.Results, settings: kit.ReportSettings, tools: tuple[kit.Comparison, ...]
) -> tuple[kit.Claim, ...]:
    judge, found = judging.judge(results, settings, RULES), list[kit.Claim]()
    for c in results.main:
        scene, where = _scene_claim(c)
        certified = kit.certified(c).having
        for who, holds, judged in (
            ("the paper's model", c.solved, c.done),
            ("the exact verdict on the whole motion", certified, c.done - c.verdicts.undecided),
        ):
            hearing = judge.on(
                "free_motion", condition=c.label, scene=scene, judge=who, where=where
            )
            told = f"{markdown.share(holds, judged)} runs"
            found.append(hearing.every(told, holds, judged, c.planned))
    found += [judge.on("larger_radius", pair=row.quantity).better(row, "larger") for row in tools]
    return tuple(found)


def _scene_claim(condition: kit.ConditionResults) -> tuple[str, str]:
    """Return the claim that the paper makes of a scene, and its source."""
    problem = condition.problem(Problem)
    if len(problem.start) > 2:
        return "The method takes new robots: it finds a collision-free motion of three", "section 5"
    if not problem.moving.all():
        text = "One robot stands still, obstacles stand around: a collision-free motion"
        return text, "section 4, Fig. 10"
    if _enveloped(condition):
        text = "Envelopes and circles: a collision-free motion of the robots with their bodies"
        return text, "section 4"
    return "A collision-free motion of two robots in each other's way", "section 4, Figs. 8, 9"


def _enveloped(condition: kit.ConditionResults) -> bool:
    """Return whether the search tests more of the robots than their lines."""
    collision = condition.planner.collision
    return bool(collision.half_width > 0.0 or collision.tcp_radius > 0.0)


def _checks(results: kit.Results) -> tuple[tuple[str, str], ...]:
    first = results.with_data[0]
    checks = [measures.rates_check(results, defect) for defect in measures.DEFECTS]
    if _enveloped(first):
        models = {c.label: c.planner.collision for c in results.with_data}
        sticks = [name for name, model in models.items() if model.tcp_radius < model.half_width]
        title = (
            "Boundary lines have no ends: the body of a link, round at its end, sticks out where "
            "the tool is smaller"
        )
        checks.append((title, "; ".join(sticks) or "nowhere"))
    notes = first.planner.notes(first.prepared.problem)
    return (*checks, *(("Length of the chromosome (Eqs. 2, 3)", note) for note in notes))


def _drawings(results: kit.Results, settings: kit.ReportSettings) -> Iterator[kit.Drawing]:
    first, shown, samples = results.main[0], results.main, settings.samples_per_segment
    problem = first.problem(Problem)
    if len(problem.start) == 2 and not _enveloped(first) and problem.moving.all():
        yield PAPER.drawing("fig_7_intersection", link_intersection.INTERSECTION, (first,), first)
    for condition, suffix in results.suffixed:
        yield from _of_condition(results, condition, suffix)
    if radii := _by_radius(results):
        by_radius = tuple(c for conditions in radii.values() for c in conditions)
        yield PAPER.drawing("fig_11_safety", robot_motions.TOOLS, by_radius, by_radius)
    yield PAPER.drawing("distances", motion_curves.DISTANCES, shown, shown, samples)


def _of_condition(
    results: kit.Results, condition: kit.ConditionResults, suffix: str
) -> Iterator[kit.Drawing]:
    problem, best = condition.problem(Problem), kit.PlayedRun(condition, condition.best_replicate)
    stem, title = "fig_8_motion", "Fig. 8: motion of the two robots"
    if not problem.moving.all():
        stem, title = "fig_10_motion", "Fig. 10: one robot stands still"
    elif len(problem.start) > 2 or _by_radius(results):
        stem, title = "motion", f"Motion of {len(problem.start)} robots"
    yield PAPER.drawing(
        "motion",
        (robot_motions.motion_table, robot_motions.draw_motion),
        (condition,),
        condition,
        plays=(best,),
        suffix=suffix,
        stem=stem,
        title=title,
    )
    stem, what = ("fig_9_joints", "Fig. 9: link") if stem == "fig_8_motion" else ("joints", "Link")
    joints = motion_curves.joints_table, motion_curves.draw_joints
    yield PAPER.drawing(
        "joints", joints, (condition,), condition, suffix=suffix, stem=stem, what=what
    )
