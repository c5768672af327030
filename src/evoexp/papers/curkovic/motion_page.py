"""The page of motions of Curkovic et al. 2013, Figs. 7–11: curves, their defects, scenes."""

import itertools
from functools import partial

import numpy as np

from evoexp.papers import run_values
from evoexp.papers.curkovic import link_motions, measures
from evoexp.papers.curkovic.figures import (
    body_distances,
    joint_values,
    link_intersection,
    robot_motions,
)
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
    unit = results.with_data[0].condition.length_unit
    tools = _tools(results, settings)
    speed = "greatest speed of a link over what Eq. 2 allows"
    kept = generic.quantity(results, f"{KEPT}, its centre line", unit, tool_distance)
    return PAPER.page(
        results,
        "motion",
        base,
        quantities=(
            base.quantities[0]._replace(name="best cost of a collision-free team"),
            measures.clearance_quantity(results),
            generic.quantity(results, speed, "–", measures.times_over_limit),
            *((kept,) if tools else ()),
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
            points = arm.points(np.ascontiguousarray(links[:, r, :, None]))[:, :, 0]
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
    pairs = [(own[-1], own[0]) for own in _by_radius(results).values() if len(own) > 1]
    return kit.compared(pairs, tool_distance, settings, lower_is_better=False, named=_pair)


def _pair(largest: kit.ConditionResults, smallest: kit.ConditionResults) -> str:
    """Name the comparison of two radii."""
    substeps = largest.planner.collision.collision_substeps
    tested = "" if substeps == 1 else f" (tested at {substeps} substeps)"
    return f"{KEPT}: {largest.label} against {smallest.label}{tested}"


def _claims(
    results: kit.Results, settings: kit.ReportSettings, tools: tuple[kit.Comparison, ...]
) -> tuple[kit.Claim, ...]:
    judge, found = judging.judge(results, settings, RULES), list[kit.Claim]()
    for c in results.main:
        scene, where = _scene_claim(c)
        certified = run_values.certified(c).having
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


def _drawings(results: kit.Results, settings: kit.ReportSettings) -> list[kit.Drawing]:
    first, drawn = results.main[0], []
    problem = first.problem(Problem)
    if len(problem.start) == 2 and not _enveloped(first) and problem.moving.all():
        drawn.append(
            PAPER.drawing(
                "fig_7_intersection",
                partial(link_intersection.intersection_table, first),
                link_intersection.draw_intersection,
                (first,),
            )
        )
    for condition, suffix in results.suffixed:
        drawn += _of_condition(results, condition, suffix)
    if radii := _by_radius(results):
        shown = tuple(c for conditions in radii.values() for c in conditions)
        drawn.append(
            PAPER.drawing(
                "fig_11_safety",
                partial(robot_motions.tools_table, shown),
                robot_motions.draw_tools,
                shown,
            )
        )
    shown = results.main
    drawn.append(
        PAPER.drawing(
            "distances",
            partial(body_distances.distances_table, shown, settings.samples_per_segment),
            body_distances.draw_distances,
            shown,
        )
    )
    return drawn


def _of_condition(
    results: kit.Results, condition: kit.ConditionResults, suffix: str
) -> list[kit.Drawing]:
    problem = condition.problem(Problem)
    if not problem.moving.all():
        number, title = "10", "Fig. 10: one robot stands still"
    elif len(problem.start) > 2 or _by_radius(results):
        number, title = "", f"Motion of {len(problem.start)} robots"
    else:
        number, title = "8", "Fig. 8: motion of the two robots"
    best = (kit.PlayedRun(condition, condition.best_replicate),)
    motion = {"stem": f"fig_{number}_motion" if number else "motion", "title": title}
    joints = {"stem": "fig_9_joints", "what": "Fig. 9: link"}
    if number != "8":
        joints = {"stem": "joints", "what": "Link"}
    table, draw = partial(robot_motions.motion_table, condition), robot_motions.draw_motion
    angles = partial(joint_values.joints_table, condition)
    return [
        PAPER.drawing("motion", table, draw, (condition,), best, suffix, **motion),
        PAPER.drawing(
            "joints", angles, joint_values.draw_joints, (condition,), (), suffix, **joints
        ),
    ]
