"""Curkovic et al. 2013: motions of robots. Figs.

7–11, known defects of the executed curves, claims about scenes.
"""

import itertools
from functools import partial

import numpy as np

from evoexp.papers.curkovic import link_motions, measures
from evoexp.papers.curkovic.figures import (
    body_distances,
    joint_values,
    link_intersection,
    robot_motions,
)
from evoexp.records import FloatArray
from evoexp.report import claims, judging, markdown
from evoexp.report.claims import Claim, Comparison
from evoexp.report.page import Drawing, Page
from evoexp.report.pages import generic, planar_arms
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

INTRODUCTION = (
    "Link angles are absolute, from the positive x-axis; one instant is one sampling step from a "
    "configuration to the next. The search looks for collisions at the configurations (and at "
    "collision substeps between them, where a condition has them); the exact verdict judges the "
    "executed curve, straight or cubic between configurations."
)
SAMPLES = 20  # per segment, where the distance of end-effectors from other robots is measured
KEPT = "least distance of an end-effector from another robot's links"


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of motions, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    unit = results.with_data[0].condition.length_unit
    row = partial(generic.quantity, results)
    tools = _tools(results, settings)
    return base._replace(
        title=f"Curkovic et al. 2013: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=(
            base.quantities[0]._replace(name="best cost of a collision-free team"),
            row(
                "clearance of the bodies over the whole motion (exact)",
                unit,
                generic.by_column("clearance"),
            ),
            row("greatest speed of a link over what Eq. 2 allows", "–", measures.times_over_limit),
            *((row(f"{KEPT}, its centre line", unit, tool_distance),) if tools else ()),
            *base.quantities[1:],
        ),
        claims=_claims(results, settings, tools),
        checks=_checks(results),
        comparisons=(
            *base.comparisons,
            *((("Largest against smallest radius", tools),) if tools else ()),
        ),
        drawings=(*_drawings(results, settings), measures.convergence_drawing(results)),
    )


def tool_distance(condition: ConditionResults) -> FloatArray:
    """Return how near any end-effector comes to a link of another robot, lines without thickness,.

    Done,.
    """
    prepared, found = condition.prepared, []
    arms = prepared.problem.collision.arms
    for k in condition.summaries.index:
        motion = link_motions.executed(prepared, condition.solutions[int(k)])
        links = link_motions.sampled(motion, SAMPLES).links
        points = [
            arm.points(np.ascontiguousarray(np.radians(links[:, r])[:, :, None]))
            for r, arm in enumerate(arms)
        ]
        least = np.inf
        for one, own in enumerate(points):
            for other, (arm, theirs) in enumerate(zip(arms, points, strict=True)):
                if one != other:
                    chain = [
                        np.broadcast_to(arm.base, (len(links), 2)),
                        theirs[:, :2, 0],
                        theirs[:, 2:, 0],
                    ]
                    tips = own[:, 2:, 0]
                    least = min(
                        least, *(to_segment(tips, a, b) for a, b in itertools.pairwise(chain))
                    )
        found.append(least)
    return np.array(found)


def to_segment(points: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the least distance of points from segments, row by row; each (rows, 2)."""
    along = end - start
    share = np.clip(((points - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    return float(np.sqrt(((points - start - share[:, None] * along) ** 2).sum(axis=1)).min())


def _by_radius(results: Results) -> dict[int, list[ConditionResults]]:
    """Return the conditions by their collision substeps, each list by growing radius.

    Empty if no radius differs.
    """
    found: dict[int, list[ConditionResults]] = {}
    for c in sorted(results.main, key=lambda c: float(c.planner.collision.tcp_radius)):
        found.setdefault(c.planner.collision.collision_substeps, []).append(c)
    several = len({c.planner.collision.tcp_radius for c in results.main}) > 1
    return found if several else {}


def _tools(results: Results, settings: ReportSettings) -> tuple[Comparison, ...]:
    """Compare the largest radius with the smallest one, for every number of collision substeps."""
    rows = []
    for substeps, (*smaller, largest) in _by_radius(results).items():
        if smaller:
            what = f"{KEPT}: {largest.label} against {smaller[0].label}" + _tested(substeps)
            rows.append(
                generic.compare_on_common_seeds(
                    largest, smaller[0], what, False, tool_distance, settings
                ),
            )
    return tuple(claims.adjusted([row for row in rows if row is not None]))


def _tested(substeps: int) -> str:
    return "" if substeps == 1 else f" (tested at {substeps} substeps)"


def _claims(
    results: Results, settings: ReportSettings, tools: tuple[Comparison, ...]
) -> tuple[Claim, ...]:
    reason, found = judging.not_judged(results), []
    for c in results.main:
        problem = c.prepared.problem
        if len(problem.start) > 2:
            text, source = (
                "The method takes new robots: it finds a collision-free motion of three",
                "section 5",
            )
        elif not problem.moving.all():
            text, source = (
                "One robot stands still, obstacles stand around: a collision-free motion",
                "section 4, Fig. 10",
            )
        elif problem.collision.enveloped:
            text, source = (
                "Envelopes and circles: a collision-free motion of the robots with their bodies",
                "section 4",
            )
        else:
            text, source = (
                "A collision-free motion of two robots in each other's way",
                "section 4, Figs. 8, 9",
            )
        certified = int((c.summaries["certified"].eq(True) & c.summaries["solved"]).sum())
        decided = c.done - c.verdicts.undecided
        for judge, holds, judged in (
            ("the paper's model", c.solved, c.done),
            ("the exact verdict on the whole motion", certified, decided),
        ):
            verdict = claims.judge_all(reason, holds, judged, c.planned)
            evidence = f"{markdown.share(holds, judged)} runs"
            found.append(
                judging.claim(
                    f"{c.label}: {text}, in every run, by {judge}",
                    source,
                    evidence,
                    verdict,
                    reason,
                )
            )
    for comparison in tools:
        text = f"A larger radius forces the robots further apart: {comparison.quantity}"
        verdict = claims.judge_better(reason, comparison, settings.significance)
        found.append(
            judging.claim(
                text, "section 4, Fig. 11", judging.evidence(comparison, "larger"), verdict, reason
            )
        )
    return tuple(found)


def _checks(results: Results) -> tuple[tuple[str, str], ...]:
    defects = [
        (f"Solved motions that fail: {rate.defect}", measures.rates_text(results, which))
        for which, rate in enumerate(measures.rates(results.with_data[0]))
    ]
    first = results.with_data[0]
    prepared = first.prepared
    if prepared.problem.collision.enveloped:
        sticks = [c.label for c in results.with_data if _sticks_out(c)]
        what = (
            "Boundary lines have no ends: the body of a link, round at its end, sticks out where "
            "the tool is smaller"
        )
        defects.append((what, "; ".join(sticks) or "nowhere"))
    notes = [
        ("Length of the chromosome (Eqs. 2, 3)", note)
        for note in first.planner.notes(prepared.problem)
    ]
    return (*defects, *notes)


def _sticks_out(condition: ConditionResults) -> bool:
    collision = condition.planner.collision
    return bool(collision.tcp_radius < collision.half_width)


def _drawings(results: Results, settings: ReportSettings) -> list[Drawing]:
    first, drawn = results.main[0], []
    problem = first.prepared.problem
    if len(problem.start) == 2 and not problem.collision.enveloped and problem.moving.all():
        drawn.append(
            Drawing(
                "fig_7_intersection",
                "Fig. 7: the intersection of the top links",
                "The paper defines the vectors and the parameters μ and ν (Eqs. 11, 12). Here: "
                "both robots on the straight line from start to goal in link angles, where their "
                "top links cross best.",
                partial(link_intersection.intersection_table, first),
                link_intersection.draw_intersection,
                (first,),
            )
        )
    for condition, suffix in planar_arms.suffixed(results):
        drawn += _of_condition(results, condition, suffix)
    if radii := _by_radius(results):
        shown = tuple(c for conditions in radii.values() for c in conditions)
        drawn.append(
            Drawing(
                "fig_11_safety",
                "Fig. 11: the safety factor of the end-effector",
                "The paper shows three trajectories, which move away from the other robot by "
                "various amounts. Here: end-effectors of each condition's best replicate, with a "
                "circle of its radius at each configuration.",
                partial(robot_motions.tools_table, shown),
                robot_motions.draw_tools,
                shown,
            )
        )
    shown = results.main
    drawn.append(
        Drawing(
            "distances",
            "Least distance of bodies along the motions",
            "Of links (and tools) of different robots, and of robots from obstacles; at the "
            "configurations, where the paper looks, and between them. Sampled; the counts are "
            "the exact verdict's.",
            partial(body_distances.distances_table, shown, settings.samples_per_segment),
            body_distances.draw_distances,
            shown,
        )
    )
    return drawn


def _of_condition(results: Results, condition: ConditionResults, suffix: str) -> list[Drawing]:
    problem = condition.prepared.problem
    name = f" ({condition.label})" if suffix else ""
    if not problem.moving.all():
        number, title = "10", "Fig. 10: one robot stands still"
    elif len(problem.start) > 2 or _by_radius(results):
        number, title = "", f"Motion of {len(problem.start)} robots"
    else:
        number, title = "8", "Fig. 8: motion of the two robots"
    return [
        Drawing(
            f"fig_{number}_motion{suffix}" if number else f"motion{suffix}",
            f"{title}{name}",
            "As the paper draws it: trail of the arms, end-effectors as points, a circle at the "
            "start, a cross at the goal. a) best replicate (lowest cost); thin lines: postures "
            "at equal times, boundaries of links and circles of tools at the configurations. b) "
            "end-effectors of all replicates. Dark red crosses: where bodies first touch in the "
            "motions that the exact verdict refutes.",
            partial(robot_motions.motion_table, condition),
            robot_motions.draw_motion,
            (condition,),
        ),
        Drawing(
            f"fig_9_joints{suffix}" if number == "8" else f"joints{suffix}",
            f"{'Fig. 9: link' if number == '8' else 'Link'} angles and their speeds{name}",
            "The paper interpolates the configurations by a polynomial of the third order and "
            "asks for a check of its gradient. Here: best replicate; b) turns per sampling step; "
            "dotted: limits by Eq. 2's formula (the angles that the paper states beside it are "
            "twice as large).",
            partial(joint_values.joints_table, condition),
            joint_values.draw_joints,
            (condition,),
        ),
    ]
