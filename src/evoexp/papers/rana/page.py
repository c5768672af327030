"""The page of Rana & Zalzala 1995: two planar arms (section 3), two PUMA-like arms (section 4)."""

import numpy as np

from evoexp.papers.rana import drawings, motions
from evoexp.papers.rana.drawings import AT, BETWEEN, MeasuredMotions, measure
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.report.kit import (
    ConditionResults,
    Judge,
    Page,
    Quantity,
    ReportSettings,
    Results,
    by_column,
    compared_with_controls,
    generic,
    markdown,
    overridden,
    parameters,
    planned_replicates,
    spread,
    verdicts,
)

CLEARANCE = by_column("clearance")
ARMS = {True: "two planar arms", False: "two PUMA-like arms"}
COMPARED = (  # with the controls: name, whether lower is better, values
    ("best cost", True, by_column("best_cost")),
    (
        "path length over that of the straight line",
        True,
        by_column("term_path_length_ratio"),
    ),
    ("colliding instants C5 of the best", True, by_column("term_collisions")),
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
    comparisons = compared_with_controls(results, settings, COMPARED)
    drawn = [measure(c, suffix, settings) for c, suffix in results.suffixed]
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
        f"Rana & Zalzala 1995: {' and '.join(ARMS[flat] for flat in sorted(planar, reverse=True))}",
        INTRODUCTION,
        _quantities(results),
        claims=tuple(found),
        checks=tuple(checks),
        comparisons=comparisons,
        drawings=tuple(sorted(drawn_figures, key=drawings.order)),
    )


def _fits(condition: ConditionResults) -> bool:
    """Return whether the paper's figures can draw a condition.

    They draw several arms of two joints in a plane, or of three joints or more in space.
    """
    problem = condition.prepared.problem
    if not isinstance(problem, Problem) or problem.assembly.num_arms < 2:
        return False
    joints = 2 if problem.assembly.table.planar else 3
    return all(stop - first >= joints for first, stop in problem.arm_slices)


def _quantities(results: Results) -> tuple[Quantity, ...]:
    unit = results.with_data[0].condition.length_unit
    cost, first, *effort = generic.quantities(results)
    first_name = "first generation with a collision-free individual (over the runs that have one)"
    least = "least distance of centres of circles or spheres at via-points"
    clearance = "clearance: least distance of the bodies themselves over the whole motion (exact)"
    rows = (
        ("colliding instants C5 of the best", "–", "term_collisions"),
        ("path length over that of the straight line", "–", "term_path_length_ratio"),
        (least, unit, AT),
        ("the same, sampled between via-points too", unit, BETWEEN),
        (clearance, unit, "clearance"),
    )
    fitness = by_column("term_fitness")
    return (
        cost,
        generic.quantity(results, "fitness F of the best", "–", fitness),
        first._replace(name=first_name),
        *(generic.quantity(results, name, of, by_column(column)) for name, of, column in rows),
        *effort,
    )


def not_judged(results: Results, condition: ConditionResults) -> str:
    """Return why claims are not judged on a condition; empty if they are."""
    if results.budget != "paper":
        return f"budget {results.budget or 'unknown'}"
    planned = planned_replicates(results)
    if condition.planned < planned:
        return f"{condition.planned} of {planned} replicates planned"
    changed = overridden(parameters(results, condition))
    return f"overridden: {', '.join(changed)}" if changed else ""


def _claims(
    results: Results,
    settings: ReportSettings,
    one: MeasuredMotions,
    comparisons: tuple[tuple[str, tuple[verdicts.Comparison, ...]], ...],
) -> list[verdicts.Claim]:
    """Return the paper's claims with verdicts on one condition."""
    c, unit, who = one.condition, one.condition.condition.length_unit, _who(results, one)
    judge = Judge(not_judged(results, c), settings.significance)
    section, figures = ("section 3.5", ("4", "7")) if one.planar else ("section 4.2", ("11", "13"))
    told = f"{markdown.share(c.solved, c.done)} finished runs of {c.planned} planned"
    text = f"{who}The motion is free of collision at the via-points, in every run"
    source = f"{section}, Fig. {figures[0]}"
    found = [judge.every(text, source, told, c.solved, c.done, c.planned)]
    # the safety distance, where the paper looks and where it does not
    kept = markdown.share(c.verdicts.with_margin, c.verdicts.judged)
    bodies = (
        f"; the bodies themselves come as close as "
        f"{markdown.number(float(c.column('clearance').min()))} {unit} (margin certified in {kept})"
    )
    for where, column, more in (("at", AT, ""), ("between", BETWEEN, bodies)):
        values = c.column(column)
        safe = int(np.count_nonzero(values >= one.margin))
        told = (
            f"{markdown.share(safe, c.done)} runs never below {one.margin:g} {unit}; least "
            f"{markdown.number(float(np.min(values)))}, median "
            f"{markdown.number(spread(values).median)} {unit}{more}"
        )
        text = f"{who}The minimum distance never goes below the safety distance: {where} via-points"
        source = f"{section}, Fig. {figures[1]}"
        found.append(judge.every(text, source, told, safe, c.done, c.planned))
    # the two operators, and evolution besides them
    text, ablations = (
        f"{who}Relaxation and redistribution improve the search",
        "judged by its ablations",
    )
    command = f"`evoexp run experiment=rana_{'planar' if one.planar else 'puma'}_ablations`"
    told = f"{ablations}: {command}"
    found.append(judge.claim(text, "section 5", told, verdicts.NOT_JUDGED))
    text = (
        f"{who}Evolution adds to that: better than random search that redistributes and relaxes, "
        "too (our reading)"
    )
    own = f"{c.label} against "
    best = next((rows[0] for heading, rows in comparisons if heading.startswith(own)), None)
    told = _evidence(best) if best else "no random search beside it"
    verdict = verdicts.judge_better(best, settings.significance)
    return [*found, judge.claim(text, "section 5", told, verdict)]


def _who(results: Results, one: MeasuredMotions) -> str:
    """Return the label that begins a line about a condition, or nothing if there is one only."""
    return f"{one.condition.label}: " if len(results.main) > 1 else ""


def _evidence(comparison: verdicts.Comparison) -> str:
    low, high = comparison.better.interval
    return (
        f"at equal evaluations the best cost is lower in {100 * comparison.better.a12:.0f} % of "
        f"pairs of runs (A12 {comparison.better.a12:.3f} [{low:.3f}, {high:.3f}]), p = "
        f"{markdown.p_value(comparison.p_adjusted)} on {comparison.num_seeds} common seeds"
    )


def _checks(one: MeasuredMotions) -> list[tuple[str, str]]:
    """Return known defects and checks of the scene, as numbers."""
    c, unit = one.condition, one.condition.condition.length_unit
    collisions = c.evaluate(motions.straight_line(c))["collisions"]
    straight = one.sampled[one.sampled["replicate"] == -1]
    dips = int(np.count_nonzero(c.column(BETWEEN) < one.margin))
    closer = int(np.count_nonzero(c.column("clearance") < one.margin))
    verdicts = c.verdicts
    redistributed, both = (motions.colliding_after(c, relaxed) for relaxed in (False, True))
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
            f"of {c.solved} strings {redistributed} collide at a via-point after redistribution, "
            f"{both} after redistribution and relaxation",
        ),
    ]
