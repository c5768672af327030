"""The page of Rana & Zalzala 1995: two planar arms (section 3), two PUMA-like arms (section 4)."""

import numpy as np

from evoexp.papers.rana import drawings, measures, motions, operators_page
from evoexp.papers.rana.claims import evolution_told
from evoexp.papers.rana.drawings import AT, BETWEEN, MeasuredMotions, measure
from evoexp.papers.rana.rules import PAPER, RULES
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown, run_measures

CLEARANCE, COST = kit.by_column("clearance"), kit.by_column("best_cost")
PRINTED = "as printed"  # label of the printed setting among the ablations
ARMS = {True: "two planar arms", False: "two PUMA-like arms"}
COMPARED = (  # with the controls: name, whether lower is better, values
    ("best cost", True, COST),
    ("path length over that of the straight line", True, kit.by_column("term_path_length_ratio")),
    ("colliding instants C5 of the best", True, kit.by_column("term_collisions")),
    ("clearance of the bodies over the whole motion", False, CLEARANCE),
)


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the paper, or the generic page if its figures cannot draw a robot."""
    if not results.with_data or not all(_fits(condition) for condition in results.with_data):
        return generic.page(results, settings)
    comparisons = kit.compared_with_controls(results, settings, COMPARED)
    drawn = [measure(c, suffix, settings) for c, suffix in results.suffixed]
    found = [claim for one in drawn for claim in _claims(results, settings, one)]
    checks = [
        (f"{_who(results, one)}{what}", finding) for one in drawn for what, finding in _checks(one)
    ]
    drawn_figures = [
        *drawings.fitness(results, drawn),
        *(d for one in drawn for d in drawings.drawings(one)),
    ]
    planar = {one.planar for one in drawn}
    arms = " and ".join(ARMS[flat] for flat in sorted(planar, reverse=True))
    return PAPER.page(
        results,
        "arms",
        title=f"{PAPER.name}: {arms}",
        quantities=_quantities(results),
        claims=tuple(found),
        checks=tuple(checks),
        comparisons=comparisons,
        drawings=tuple(sorted(drawn_figures, key=drawings.order)),
    )


def _fits(condition: kit.ConditionResults) -> bool:
    """Return whether the paper's figures can draw a condition.

    They draw several arms of two joints in a plane, or of three joints or more in space.
    """
    problem = condition.prepared.problem
    if not isinstance(problem, Problem) or problem.assembly.num_arms < 2:
        return False
    joints = 2 if problem.assembly.table.planar else 3
    return all(stop - first >= joints for first, stop in problem.arm_slices)


def _quantities(results: kit.Results) -> tuple[kit.Quantity, ...]:
    unit = results.with_data[0].condition.length_unit
    cost, _, *effort = generic.quantities(results)
    least = "least distance of centres of circles or spheres at via-points"
    clearance = "clearance: least distance of the bodies themselves over the whole motion (exact)"
    rows = (
        ("colliding instants C5 of the best", "–", "term_collisions"),
        ("path length over that of the straight line", "–", "term_path_length_ratio"),
        (least, unit, AT),
        ("the same, sampled between via-points too", unit, BETWEEN),
        (clearance, unit, "clearance"),
    )
    fitness = kit.by_column("term_fitness")
    return (
        cost,
        generic.quantity(results, "fitness F of the best", "–", fitness),
        generic.quantity(results, measures.FIRST_FREE, "generation", run_measures.first_feasible),
        *(generic.quantity(results, name, of, kit.by_column(column)) for name, of, column in rows),
        *effort,
    )


def not_judged(results: kit.Results, condition: kit.ConditionResults) -> str:
    """Return why claims are not judged on a condition; empty if they are."""
    if results.budget != "paper":
        return f"budget {results.budget or 'unknown'}"
    if condition.is_control:
        return judging.ONLY_CONTROLS
    planned = kit.planned_replicates(results)
    if condition.planned < planned:
        return f"{condition.planned} of {planned} replicates planned"
    changed = kit.overridden(kit.parameters(results, condition))
    return f"overridden: {', '.join(changed)}" if changed else ""


def _claims(
    results: kit.Results, settings: kit.ReportSettings, one: MeasuredMotions
) -> list[kit.Claim]:
    """Return the paper's claims with verdicts on one condition."""
    c, unit, who = one.condition, one.condition.condition.length_unit, _who(results, one)
    judge = kit.Judge(not_judged(results, c), settings.significance, RULES)
    section, figures = ("section 3.5", ("4", "7")) if one.planar else ("section 4.2", ("11", "13"))
    told = f"{markdown.share(c.solved, c.done)} finished runs of {c.planned} planned"
    hearing = judge.on("free_at_via_points", who=who, source=f"{section}, Fig. {figures[0]}")
    found = [hearing.every(told, c.solved, c.done, c.planned)]
    # the safety distance, where the paper looks and where it does not
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
        safe = int(np.count_nonzero(values >= one.margin))
        told = (
            f"{markdown.share(safe, c.done)} runs never below {one.margin:g} {unit}; least "
            f"{markdown.number(float(np.min(values)))}, median "
            f"{markdown.number(kit.spread(values).median)} {unit}{more}"
        )
        hearing = judge.on(name, who=who, source=f"{section}, Fig. {figures[1]}")
        found.append(hearing.every(told, safe, c.done, c.planned))
    # the two operators, and evolution besides them
    return [
        *found,
        *_operator_claims(results, settings, one, judge),
        _evolution_claim(results, settings, one, judge),
    ]


def _operator_claims(
    results: kit.Results, settings: kit.ReportSettings, one: MeasuredMotions, judge: kit.Judge
) -> list[kit.Claim]:
    """Judge the claim about the two operators from the stored ablations of the same scene."""
    experiment = f"rana_{'planar' if one.planar else 'puma'}_ablations"
    stored, who = results.beside(experiment), _who(results, one)
    reason = judge.reason or (judging.not_judged(stored) if stored.with_data else "")
    own = judge._replace(reason=reason)
    found = operators_page.operator_claims(stored, settings, own, who, PRINTED)
    if found:
        return found
    told = f"its ablations are not stored: `evoexp run experiment={experiment}`"
    return [judge.on("operators_improve", who=who, without="each alone").elsewhere(told)]


def _evolution_claim(
    results: kit.Results, settings: kit.ReportSettings, one: MeasuredMotions, judge: kit.Judge
) -> kit.Claim:
    """Judge what evolution adds to every control, and tell how much to the best of them."""
    c = one.condition
    controls = [k for k in results.evolved if k.is_control and kit.beside(c.condition, k.condition)]
    told, rows = evolution_told(c, controls, settings)
    hearing = judge.on("evolution_adds", who=_who(results, one))
    return hearing.better_than_all(told, rows)


def _who(results: kit.Results, one: MeasuredMotions) -> str:
    """Return the label that begins a line about a condition, or nothing if there is one only."""
    return f"{one.condition.label}: " if len(results.main) > 1 else ""


def _checks(one: MeasuredMotions) -> list[tuple[str, str]]:
    """Return known defects and checks of the scene, as numbers."""
    c, unit = one.condition, one.condition.condition.length_unit
    line = c.evaluate(motions.straight_line(c))
    straight = one.sampled[one.sampled["series"] == motions.STRAIGHT]
    dips = int(np.count_nonzero(c.column(BETWEEN) < one.margin))
    closer = int(np.count_nonzero(c.column("clearance") < one.margin))
    verdicts = c.verdicts
    weights, total = c.planner.objective, motions.straight_length(c)
    longer = kit.spread(total * (c.column("term_path_length_ratio") - 1.0))
    redistributed, both = (motions.colliding_after(c, relaxed) for relaxed in (False, True))
    return [
        (
            "The scene is not trivial: colliding instants of the straight line in configuration "
            "space",
            f"C5 = {line['collisions']:.0f} of {c.planner.num_via_points} instants, fitness F = "
            f"{markdown.number(line['fitness'])}; its least distance of centres is "
            f"{markdown.number(float(straight['centres'].min()))} {unit} (safety {one.margin:g} "
            f"{unit})",
        ),
        (
            "A colliding instant against a longer path: how many degrees of path cost as much "
            "(k3 / k1)",
            f"{markdown.number(weights.collision_weight / weights.length_weight)}°; the straight "
            f"paths of all arms are {markdown.number(total)}° long and collide at "
            f"{line['collisions']:.0f} instants, the best motions are longer by "
            f"{markdown.spread(longer)}° and collide at none in {c.solved} of {c.done} runs",
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
