"""The page of Rana & Zalzala 1995: two planar arms (section 3), two PUMA-like arms (section 4)."""

import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evoexp.papers.rana import motions, operators_page
from evoexp.papers.rana.figures import planar_models, planar_motion, spatial_models
from evoexp.papers.rana.measures import evolution_told
from evoexp.papers.rana.rules import PAPER, RULES
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.report import kit
from evoexp.report.kit import convergence, generic, judging, markdown

AT, BETWEEN = "term_arm_distance_at_via_points", "term_arm_distance_between_sampled"
PLANAR = (  # figures of arms in the plane: name, table of a condition, drawing of the table
    ("fig_1_arms", planar_models.arms_table, planar_models.draw_arms),
    ("fig_2_via_points", planar_models.via_points_table, planar_models.draw_via_points),
    ("fig_3_circles", planar_models.circles_table, planar_models.draw_circles),
    ("fig_4_snapshots", planar_motion.snapshots_table, planar_motion.draw_snapshots),
    ("fig_6_paths", planar_motion.paths_table, planar_motion.draw_paths),
)
SPATIAL = (  # the same of arms in space
    ("fig_8_arm", spatial_models.arm_table, spatial_models.draw_arm),
    ("fig_9_two_arms", spatial_models.two_arms_table, spatial_models.draw_two_arms),
    ("fig_11_snapshots", spatial_models.snapshots_table, spatial_models.draw_snapshots),
    *(
        (f"fig_12b_{space}_space", spatial_models.paths_table, draw)
        for space, draw in (
            ("configuration", spatial_models.draw_configuration_space),
            ("operational", spatial_models.draw_operational_space),
        )
    ),
)
PLAYED = ("fig_4_snapshots", "fig_11_snapshots")  # figures of the best replicate's motion
CLEARANCE, COST = kit.by_column("clearance"), kit.by_column("best_cost")
PRINTED = "as printed"  # label of the printed setting among the ablations
ARMS = {True: "two planar arms", False: "two PUMA-like arms"}
COMPARED = (  # with the controls: name, whether lower is better, values
    ("best cost", True, COST),
    ("path length over that of the straight line", True, kit.by_column("term_path_length_ratio")),
    ("colliding instants C5 of the best", True, kit.by_column("term_collisions")),
    ("clearance of the bodies over the whole motion", False, CLEARANCE),
)


class MeasuredMotions(NamedTuple):
    """A condition, the end of its files' names, and the distances along its motions."""

    condition: kit.ConditionResults
    suffix: str
    who: str  # begins a line about it: its label, or nothing if there is one condition only
    sampled: pd.DataFrame

    @property
    def planar(self) -> bool:
        """Return whether its arms move in a plane."""
        return bool(motions.problem(self.condition).assembly.table.planar)

    @property
    def margin(self) -> float:
        """The safety distance [length unit]."""
        return motions.problem(self.condition).security_margin


def drawings(one: MeasuredMotions) -> list[kit.Drawing]:
    """Return the paper's figures of one condition, without those of its fitness."""
    c = one.condition
    median = c.spread("term_path_length_ratio").median
    ratio = f"Median length over that of the straight line: {markdown.number(median)}."
    played = (kit.PlayedRun(c, c.best_replicate),)
    figures = [
        PAPER.drawing(
            name,
            (table, draw),
            (c,),
            c,
            plays=played if name in PLAYED else (),
            suffix=one.suffix,
            ratio=ratio,
        )
        for name, table, draw in (PLANAR if one.planar else SPATIAL)
    ]
    return [*figures, _distances(one)]


def order(drawing: kit.Drawing) -> tuple[int, str]:
    """Return the key that sorts drawings by the number of the paper's figure."""
    return int(re.findall(r"\d+", drawing.stem)[0]), drawing.stem


def fitness(results: kit.Results, drawn: Sequence[MeasuredMotions]) -> Iterator[kit.Drawing]:
    """Yield Figs. 5 and 12a: one figure per scene, of all conditions and controls in it."""
    scenes = list(dict.fromkeys(_scene(one.condition) for one in drawn))
    for scene in scenes:
        first = next(one for one in drawn if _scene(one.condition) == scene)
        within = results._replace(
            conditions=tuple(c for c in results.conditions if _scene(c) == scene)
        )
        stem, number = ("fig_5_fitness", "5") if first.planar else ("fig_12a_fitness", "12a")
        suffix = first.suffix if len(scenes) > 1 else ""
        drawing = PAPER.drawing(
            "fitness",
            convergence.FITNESS,
            within.with_data,
            within,
            stem=stem,
            number=number,
        )
        title = f"{drawing.title} ({first.condition.label})" if suffix else drawing.title
        yield drawing._replace(stem=stem + suffix, title=title)


def _scene(condition: kit.ConditionResults) -> tuple[Any, Any]:
    return condition.condition.robot, condition.condition.scenario


def _distances(one: MeasuredMotions) -> kit.Drawing:
    """Return the figure of distances between the arms, with the least of all replicates."""
    c = one.condition
    at, between, clearance = (
        markdown.number(float(c.column(name).min())) for name in (AT, BETWEEN, "clearance")
    )
    return PAPER.drawing(
        "arm_distances",
        planar_motion.DISTANCES,
        (c,),
        c,
        one.sampled,
        suffix=one.suffix,
        number="7" if one.planar else "13",
        at=at,
        between=between,
        clearance=clearance,
        unit=c.condition.length_unit,
    )


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the paper, or the generic page if its figures cannot draw a robot."""
    if not results.with_data or not all(_fits(condition) for condition in results.with_data):
        return generic.page(results, settings)
    comparisons = kit.compared_with_controls(results, settings, COMPARED)
    samples, several = settings.samples_per_segment, len(results.main) > 1
    drawn = [
        MeasuredMotions(
            c, suffix, f"{c.label}: " * several, planar_motion.sampled_distances(c, samples)
        )
        for c, suffix in results.suffixed
    ]
    figures = [*fitness(results, drawn), *(d for one in drawn for d in drawings(one))]
    planar = {one.planar for one in drawn}
    arms = " and ".join(ARMS[flat] for flat in sorted(planar, reverse=True))
    return PAPER.page(
        results,
        "arms",
        title=f"{PAPER.name}: {arms}",
        quantities=PAPER.quantities(results, "arms"),
        claims=tuple(claim for one in drawn for claim in _claims(results, settings, one)),
        checks=tuple(
            (f"{one.who}{what}", finding) for one in drawn for what, finding in _checks(one)
        ),
        comparisons=comparisons,
        drawings=tuple(sorted(figures, key=order)),
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
    c, unit, who = one.condition, one.condition.condition.length_unit, one.who
    judge = kit.Judge(not_judged(results, c), settings, RULES)
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
    # the two operators, and what evolution adds to every control
    found += _operator_claims(results, one, judge)
    controls = [k for k in results.evolved if k.is_control and kit.beside(c.condition, k.condition)]
    evolution = judge.on("evolution_adds", who=who)
    return [*found, evolution.better_than_all(*evolution_told(judge, c, controls))]


def _operator_claims(
    results: kit.Results, one: MeasuredMotions, judge: kit.Judge
) -> list[kit.Claim]:
    """Judge the claim about the two operators from the stored ablations of the same scene."""
    experiment = f"rana_{'planar' if one.planar else 'puma'}_ablations"
    stored = results.beside(experiment)
    reason = judge.reason or (judging.not_judged(stored) if stored.with_data else "")
    own = judge._replace(reason=reason)
    told = f"its ablations are not stored: `evoexp run experiment={experiment}`"
    alone = judge.on("operators_improve", who=one.who, without="each alone")
    return operators_page.operator_claims(stored, own, one.who, PRINTED) or [alone.elsewhere(told)]


def _checks(one: MeasuredMotions) -> tuple[tuple[str, str], ...]:
    """Return known defects and checks of the scene, as numbers."""
    c, number = one.condition, markdown.number
    line, total = c.evaluate(motions.straight_line(c)), motions.straight_length(c)
    straight = one.sampled[one.sampled["series"] == motions.STRAIGHT]
    longer = kit.spread(total * (c.column("term_path_length_ratio") - 1.0))
    return PAPER.checks(
        "arms",
        c=c,
        unit=c.condition.length_unit,
        margin=one.margin,
        hits=line["collisions"],
        fitness=number(line["fitness"]),
        least=number(float(straight["centres"].min())),
        worth=number(motions.worth(c)),
        straight=number(total),
        longer=markdown.spread(longer),
        dips=int(np.count_nonzero(c.column(BETWEEN) < one.margin)),
        closer=int(np.count_nonzero(c.column("clearance") < one.margin)),
        redistributed=motions.colliding_after(c, relaxed=False),
        both=motions.colliding_after(c, relaxed=True),
    )
