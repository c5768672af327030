"""Rana & Zalzala 1995: two planar arms (section 3) and two PUMA-like arms (section 4).

Claims, known defects.
"""

from functools import partial

import numpy as np

from evoexp.papers.rana import drawings
from evoexp.papers.rana.drawings import AT, BETWEEN, Measured, measure
from evoexp.paths.redistribution import redistribute
from evoexp.paths.relaxation import relax
from evoexp.paths.workspace import prepare_redistribution
from evoexp.report import claims, markdown, motion_geometry
from evoexp.report.page import Page, Quantity
from evoexp.report.pages import generic, planar_arms
from evoexp.report.parameters import overridden, parameters, planned_replicates
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import spread

LANES = 8  # kernels take whole vectors
CLEARANCE = generic.by_column("clearance")
WHAT = {True: "two planar arms", False: "two PUMA-like arms"}
COMPARED = (  # with the controls: name, whether lower is better, values
    ("best cost", True, generic.by_column("best_cost")),
    (
        "path length over that of the straight line",
        True,
        generic.by_column("term_path_length_ratio"),
    ),
    ("colliding instants C5 of the best", True, generic.by_column("term_collisions")),
    ("clearance of the bodies over the whole motion", False, CLEARANCE),
)
INTRODUCTION = (
    "Two arms change sides; the paths of both are strings of via-points, evolved together. The "
    "paper maximises the fitness F = C_max − cost; everything else here is a cost, lower is "
    "better. Instant i is the i-th via-point of both arms."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the paper, or the generic page if its figures cannot draw a robot."""
    if not results.with_data or not all(_fits(condition) for condition in results.with_data):
        return generic.page(results, settings)
    comparisons = generic.comparisons(results, settings, COMPARED)
    drawn = [measure(c, suffix, settings) for c, suffix in planar_arms.suffixed(results)]
    found = [claim for one in drawn for claim in _claims(results, settings, one, comparisons)]
    checks = [
        (f"{_who(results, one)}{what}", finding) for one in drawn for what, finding in _checks(one)
    ]
    drawn_figures = [
        *drawings.fitness(results, drawn),
        *(d for one in drawn for d in drawings.drawings(one)),
    ]
    planar = {one.planar for one in drawn}
    return Page(
        f"Rana & Zalzala 1995: {' and '.join(WHAT[flat] for flat in sorted(planar, reverse=True))}",
        INTRODUCTION,
        _quantities(results),
        claims=tuple(found),
        checks=tuple(checks),
        comparisons=comparisons,
        drawings=tuple(sorted(drawn_figures, key=drawings.order)),
    )


def _fits(condition: ConditionResults) -> bool:
    """Whether the paper's figures can draw a condition.

    Several arms of two joints in a plane, or of three in space.
    """
    assembly = getattr(condition.prepared.problem, "assembly", None)
    if assembly is None or assembly.num_arms < 2 or not hasattr(condition.planner, "objective"):
        return False
    joints = 2 if assembly.table.planar else 3
    return all(stop - first >= joints for first, stop in assembly.arm_slices)


def _quantities(results: Results) -> tuple[Quantity, ...]:
    unit = results.with_data[0].condition.length_unit
    row = partial(generic.quantity, results)
    cost, first, *effort = generic.quantities(results)
    ratio = row(
        "path length over that of the straight line",
        "–",
        generic.by_column("term_path_length_ratio"),
    )
    return (
        cost,
        row("fitness F of the best", "–", generic.by_column("term_fitness")),
        first._replace(
            name="first generation with a collision-free individual (over the runs that have one)"
        ),
        row("colliding instants C5 of the best", "–", generic.by_column("term_collisions")),
        ratio,
        row(
            "least distance of centres of circles or spheres at via-points",
            unit,
            generic.by_column(AT),
        ),
        row("the same, sampled between via-points too", unit, generic.by_column(BETWEEN)),
        row(
            "clearance: least distance of the bodies themselves over the whole motion (exact)",
            unit,
            CLEARANCE,
        ),
        *effort,
    )


def not_judged(results: Results, condition: ConditionResults) -> str:
    """Return why claims are not judged on a condition; empty if they are."""
    if results.budget != "paper":
        return f"budget {results.budget or 'unknown'}"
    if condition.planned < planned_replicates(results.experiment):
        return f"{condition.planned} of {planned_replicates(results.experiment)} replicates planned"
    changed = overridden(parameters(results, condition))
    return f"overridden: {', '.join(changed)}" if changed else ""


def _claims(
    results: Results,
    settings: ReportSettings,
    one: Measured,
    comparisons: tuple[tuple[str, tuple[claims.Comparison, ...]], ...],
) -> list[claims.Claim]:
    """Return the paper's claims with verdicts on one condition."""
    c, unit, reason = (
        one.condition,
        one.condition.condition.length_unit,
        not_judged(results, one.condition),
    )
    who = _who(results, one)
    every = partial(claims.judge_all, reason, done=c.done, planned=c.planned)
    at, between, links = c.column(AT), c.column(BETWEEN), c.column("clearance")
    found = [
        claims.Claim(
            f"{who}The motion is free of collision at the via-points, in every run",
            "section 3.5, Fig. 4" if one.planar else "section 4.2, Fig. 11",
            f"{markdown.share(c.solved, c.done)} finished runs of {c.planned} planned",
            every(c.solved),
        )
    ]
    for where, values in (("at via-points", at), ("between via-points", between)):
        safe = int(np.count_nonzero(values >= one.margin))
        evidence = (
            f"{markdown.share(safe, c.done)} runs never below {one.margin:g} {unit}; least "
            f"{markdown.number(float(np.min(values)))}, median "
            f"{markdown.number(spread(values).median)} {unit}"
        )
        if where == "between via-points":
            kept = markdown.share(c.verdicts.with_margin, c.verdicts.judged)
            evidence += (
                f"; the bodies themselves come as close as {markdown.number(float(links.min()))} "
                f"{unit} (margin certified in {kept})"
            )
        text = f"{who}The minimum distance never goes below the safety distance: {where}"
        source = "section 3.5, Fig. 7" if one.planar else "section 4.2, Fig. 13"
        found.append(claims.Claim(text, source, evidence, every(safe)))
    against = [
        rows[0] for heading, rows in comparisons if heading.startswith(f"{c.label} against ")
    ]
    best = against[0] if against else None
    found.append(
        claims.Claim(
            f"{who}Relaxation and redistribution improve the search",
            "section 5",
            "judged by its ablations: `evoexp run "
            f"experiment=rana_{'planar' if one.planar else 'puma'}_ablations`",
            claims.NOT_JUDGED,
        )
    )
    found.append(
        claims.Claim(
            f"{who}Evolution adds to that: better than random search that redistributes and "
            "relaxes, too (our reading)",
            "section 5",
            _evidence(best) if best else "no random search beside it",
            claims.judge_better(reason, best, settings.significance),
        )
    )
    if reason:
        found = [claim._replace(verdict=f"{claims.NOT_JUDGED} ({reason})") for claim in found]
    return found


def _who(results: Results, one: Measured) -> str:
    """Return what begins a line about one condition where there are several."""
    return f"{one.condition.label}: " if len(results.main) > 1 else ""


def _evidence(comparison: claims.Comparison) -> str:
    low, high = comparison.better.interval
    return (
        f"at equal evaluations the best cost is lower in {100 * comparison.better.a12:.0f} % of "
        f"pairs of runs (A12 {comparison.better.a12:.3f} [{low:.3f}, {high:.3f}]), p = "
        f"{markdown.p_value(comparison.p_adjusted)} on {comparison.num_seeds} common seeds"
    )


def _checks(one: Measured) -> list[tuple[str, str]]:
    """Return known defects and checks of the scene, as numbers."""
    c, unit = one.condition, one.condition.condition.length_unit
    prepared = c.prepared
    collisions = prepared.planner.evaluate(
        prepared.problem, motion_geometry.straight_line(prepared)
    )["collisions"]
    straight = one.sampled[one.sampled["replicate"] == -1]
    dips = int(np.count_nonzero(c.column(BETWEEN) < one.margin))
    closer = int(np.count_nonzero(c.column("clearance") < one.margin))
    verdicts = c.verdicts
    after = {
        name: colliding_after(c, relaxed)
        for name, relaxed in (("redistribution", False), ("both", True))
    }
    return [
        (
            "The scene is not trivial: colliding instants of the straight line in configuration "
            "space",
            f"C5 = {collisions:.0f} of {c.planner.num_via_points} instants; its least distance of "
            f"centres is {markdown.number(float(straight['centres'].min()))} {unit} (safety "
            f"{one.margin:g} {unit})",
        ),
        (
            "Runs that dip below the safety distance between via-points, where the algorithm "
            "does not test",
            f"centres of circles or spheres: {dips} of {c.done}; the bodies themselves: {closer} "
            f"of {c.done}; bodies in contact (refuted): {verdicts.refuted} of {verdicts.judged}, "
            f"of these {verdicts.solved_refuted} solved by the paper's model",
        ),
        (
            "Redistribution and relaxation are blind to collisions: applied once more to final, "
            "collision-free strings",
            f"of {c.solved} strings {after['redistribution']} collide at a via-point after "
            f"redistribution, {after['both']} after redistribution and relaxation",
        ),
    ]


def colliding_after(condition: ConditionResults, relaxed: bool) -> int:
    """Count the collision-free final strings that collide once redistributed (and relaxed)."""
    planner, problem = condition.planner, condition.prepared.problem
    solved = condition.summaries.index[condition.summaries["solved"].to_numpy(dtype=bool)]
    q = [
        motion_geometry.configurations(condition.prepared, condition.solutions[int(k)])
        for k in solved
    ]
    if not q:
        return 0
    lanes = -(-len(q) // LANES) * LANES
    strings = np.zeros((*q[0].shape, lanes))
    strings[:, :, : len(q)] = np.stack(q, axis=2)
    joints = int(np.max(problem.arm_slices[:, 1] - problem.arm_slices[:, 0]))
    spline = prepare_redistribution(
        planner.num_via_points, joints, planner.spline_end, planner.samples_per_segment
    )
    redistribute(strings, problem.arm_slices, len(q), spline)
    if relaxed:
        relax(strings, planner.relaxation_step, len(q))
    judged = planner.cost(problem, np.ascontiguousarray(strings[:, :, : len(q)]))
    return int(np.count_nonzero(~judged.feasible[: len(q)]))
