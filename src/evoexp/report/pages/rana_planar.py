"""Rana & Zalzala 1995, section 3: two planar arms. Figures 1–7, claims, known defects."""

from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from evoexp.paths.redistribution import redistribute
from evoexp.paths.relaxation import relax
from evoexp.paths.workspace import prepare_redistribution
from evoexp.records import FloatArray
from evoexp.report import claims, markdown, motions
from evoexp.report.figures import convergence, planar_models, planar_motion
from evoexp.report.page import Drawing, Page, Quantity
from evoexp.report.pages import generic, planar_arms
from evoexp.report.parameters import overridden, parameters, planned_replicates
from evoexp.report.results import ConditionResults, Results
from evoexp.report.settings import ReportSettings
from evoexp.report.statistics import spread

AT, BETWEEN = "term_arm_distance_at_via_points", "term_arm_distance_between_sampled"
LANES = 8  # kernels take whole vectors
COMPARED = (  # with the controls: name, whether lower is better, values
    ("best cost", True, generic.by_column("best_cost")),
    ("path length over that of the straight line", True, generic.by_column("term_path_length_ratio")),
    ("colliding instants C5 of the best", True, generic.by_column("term_collisions")),
    ("least distance of circle centres between via-points", False, generic.by_column(BETWEEN)),
)
INTRODUCTION = (
    "Two planar arms of two links change sides; the paths of both are strings of via-points, evolved together. The "
    "paper maximises the fitness F = C_max − cost; everything else here is a cost, lower is better. Instant i is the "
    "i-th via-point of both arms."
)


class Measured(NamedTuple):
    """A condition and the distances along its motions."""

    condition: ConditionResults
    suffix: str
    sampled: pd.DataFrame

    @property
    def link_distances(self) -> FloatArray:
        """(done,) least exact distance between the links of two arms over the whole motion of each replicate."""
        replicates = self.sampled[self.sampled["replicate"] >= 0]
        return replicates.groupby("replicate", sort=True)["links"].min().to_numpy()

    @property
    def margin(self) -> float:
        """The safety distance."""
        return float(self.condition.condition.scenario.security_margin)  # type: ignore[attr-defined]


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; the generic one where a robot is not what these figures draw."""
    if not results.with_data or not all(_fits(condition) for condition in results.with_data):
        return generic.page(results, settings)
    suffixes = {c.label: suffix for c, suffix in planar_arms.suffixed(results)}
    measured = {
        c.label: Measured(
            c, suffixes.get(c.label, ""), planar_motion.sampled_distances(c, settings.samples_per_segment)
        )
        for c in results.with_data
    }
    comparisons = generic.comparisons(results, settings, COMPARED)
    drawn = [measured[condition.label] for condition in results.main]
    found = [claim for one in drawn for claim in _claims(results, settings, one, comparisons)]
    checks = [(f"{_who(results, one)}{what}", finding) for one in drawn for what, finding in _checks(one)]
    drawings = [_fitness(results)]
    for one in drawn:
        own = [*_models(one), *_motions(one)]
        drawings += [d._replace(title=f"{d.title} ({one.condition.label})") for d in own] if one.suffix else own
    return Page(
        "Rana & Zalzala 1995: two planar arms",
        INTRODUCTION,
        _quantities(results, measured),
        tuple(found),
        tuple(checks),
        comparisons,
        tuple(sorted(drawings, key=lambda drawing: drawing.stem)),
    )


def _fits(condition: ConditionResults) -> bool:
    several = planar_arms.drawable(condition) and condition.prepared.problem.assembly.num_arms > 1
    return several and hasattr(condition.planner, "objective")


def _quantities(results: Results, measured: dict[str, Measured]) -> tuple[Quantity, ...]:
    unit = results.with_data[0].condition.length_unit
    row = partial(generic.quantity, results)
    cost, first, *effort = generic.quantities(results)
    ratio = row("path length over that of the straight line", "–", generic.by_column("term_path_length_ratio"))
    exact = {c.label: spread(measured[c.label].link_distances) for c in results.with_data}
    return (
        cost,
        row("fitness F of the best", "–", generic.by_column("term_fitness")),
        first._replace(name="first generation with a collision-free individual (over the runs that have one)"),
        row("colliding instants C5 of the best", "–", generic.by_column("term_collisions")),
        ratio,
        row("least distance of circle centres at via-points", unit, generic.by_column(AT)),
        row("least distance of circle centres, between via-points too", unit, generic.by_column(BETWEEN)),
        Quantity("least distance of the links themselves, between via-points too", unit, exact),
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
    c, unit, reason = one.condition, one.condition.condition.length_unit, not_judged(results, one.condition)
    who = _who(results, one)
    every = partial(claims.judge_all, reason, done=c.done, planned=c.planned)
    at, between, links = c.column(AT), c.column(BETWEEN), one.link_distances
    found = [
        claims.Claim(
            f"{who}The motion is free of collision at the via-points, in every run",
            "section 3.5, Fig. 4",
            f"{markdown.share(c.solved, c.done)} finished runs of {c.planned} planned",
            every(c.solved),
        )
    ]
    for where, values in (("at via-points", at), ("between via-points", between)):
        safe = int(np.count_nonzero(values >= one.margin))
        evidence = (
            f"{markdown.share(safe, c.done)} runs never below {one.margin:g} {unit}; least "
            f"{markdown.number(float(np.min(values)))}, median {markdown.number(spread(values).median)} {unit}"
        )
        if where == "between via-points":
            evidence += f"; the links themselves come as close as {markdown.number(float(links.min()))} {unit}"
        text = f"{who}The minimum distance never goes below the safety distance: {where}"
        found.append(claims.Claim(text, "section 3.5, Fig. 7", evidence, every(safe)))
    against = [rows[0] for heading, rows in comparisons if heading.startswith(f"{c.label} against ")]
    best = against[0] if against else None
    found.append(
        claims.Claim(
            f"{who}Relaxation and redistribution improve the search",
            "section 5",
            "needs ablations (no relaxation, no redistribution), which this experiment does not have",
            claims.NOT_JUDGED,
        )
    )
    found.append(
        claims.Claim(
            f"{who}Evolution adds to that: better than random search that redistributes and relaxes, too (our reading)",
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
        f"at equal evaluations the best cost is lower in {100 * comparison.better.a12:.0f} % of pairs of runs (A12 "
        f"{comparison.better.a12:.3f} [{low:.3f}, {high:.3f}]), p = {markdown.p_value(comparison.p_adjusted)} on "
        f"{comparison.num_seeds} common seeds"
    )


def _checks(one: Measured) -> list[tuple[str, str]]:
    """Return known defects and checks of the scene, as numbers."""
    c, unit = one.condition, one.condition.condition.length_unit
    prepared = c.prepared
    collisions = prepared.planner.evaluate(prepared.problem, motions.straight_line(prepared))["collisions"]
    straight = one.sampled[one.sampled["replicate"] == -1]
    dips = int(np.count_nonzero(c.column(BETWEEN) < one.margin))
    touching = int(np.count_nonzero(one.link_distances < one.margin))
    contact = int(np.count_nonzero(one.link_distances <= 0.0))
    after = {name: colliding_after(c, relaxed) for name, relaxed in (("redistribution", False), ("both", True))}
    return [
        (
            "The scene is not trivial: colliding instants of the straight line in configuration space",
            f"C5 = {collisions:.0f} of {c.planner.num_via_points} instants; its least distance of circle centres is "
            f"{markdown.number(float(straight['centres'].min()))} {unit} (safety {one.margin:g} {unit})",
        ),
        (
            "Runs that dip below the safety distance between via-points, where the algorithm does not test",
            f"circle centres: {dips} of {c.done}; the links themselves: {touching} of {c.done}; links in contact: "
            f"{contact} of {c.done}",
        ),
        (
            "Redistribution and relaxation are blind to collisions: applied once more to final, collision-free strings",
            f"of {c.solved} strings {after['redistribution']} collide at a via-point after redistribution, "
            f"{after['both']} after redistribution and relaxation",
        ),
    ]


def colliding_after(condition: ConditionResults, relaxed: bool) -> int:
    """Count the collision-free final strings that collide once they are redistributed (and relaxed) again."""
    planner, problem = condition.planner, condition.prepared.problem
    solved = condition.summaries.index[condition.summaries["solved"].to_numpy(dtype=bool)]
    q = [motions.configurations(condition.prepared, condition.solutions[int(k)]) for k in solved]
    if not q:
        return 0
    lanes = -(-len(q) // LANES) * LANES
    strings = np.zeros((*q[0].shape, lanes))
    strings[:, :, : len(q)] = np.stack(q, axis=2)
    joints = int(np.max(problem.arm_slices[:, 1] - problem.arm_slices[:, 0]))
    spline = prepare_redistribution(planner.num_via_points, joints, planner.spline_end, planner.samples_per_segment)
    redistribute(strings, problem.arm_slices, len(q), spline)
    if relaxed:
        relax(strings, planner.relaxation_step, len(q))
    judged = planner.cost(problem, np.ascontiguousarray(strings[:, :, : len(q)]))
    return int(np.count_nonzero(~judged.feasible[: len(q)]))


def _models(one: Measured) -> list[Drawing]:
    c, suffix = one.condition, one.suffix
    return [
        Drawing(
            f"fig_1_arms{suffix}",
            "Fig. 1: the two arms in operational space",
            "The paper's Fig. 1 names the arms and their joint angles. Here: start (angles marked) and goal (faint) of "
            "Tab. 2; angles are relative to the link before, counter-clockwise; link lengths and bases are assumed.",
            partial(planar_models.arms_table, c),
            planar_models.draw_arms,
            (c,),
        ),
        Drawing(
            f"fig_2_via_points{suffix}",
            "Fig. 2: a path as a string of via-points in configuration space",
            "The paper's Fig. 2 shows one path in one plane. Here: both arms' strings of the best replicate, the best "
            "of its initial population (grey) and its last; equal numbers are the same instant.",
            partial(planar_models.via_points_table, c),
            planar_models.draw_via_points,
            (c,),
        ),
        Drawing(
            f"fig_3_circles{suffix}",
            "Fig. 3: links approximated by touching circles",
            "Two arms collide in the model when circle centres of both are closer than 2r. Here: the via-point of the "
            "best replicate at which they are closest; the links themselves may be nearer than the nearest centres.",
            partial(planar_models.circles_table, c),
            planar_models.draw_circles,
            (c,),
        ),
    ]


def _fitness(results: Results) -> Drawing:
    return Drawing(
        "fig_5_fitness",
        "Fig. 5: best and average fitness against generation",
        "The paper shows one run; its fitness is F = C_max − cost (Eq. 7 with the sign that punishes collisions). Here "
        "medians and quartiles over replicates; the average is over a generation's individuals, elites included.",
        partial(convergence.fitness_table, results),
        convergence.draw_fitness,
        results.with_data,
    )


def _motions(one: Measured) -> list[Drawing]:
    """Return Figs. 4, 6 and 7 of one condition."""
    c, unit = one.condition, one.condition.condition.length_unit
    snapshots, paths = planar_arms.motion_drawings(c, one.suffix)
    distances = planar_arms.distances_drawing(c, one.suffix, one.sampled)
    at, between = float(np.min(c.column(AT))), float(np.min(c.column(BETWEEN)))
    return [
        snapshots._replace(
            stem=f"fig_4_snapshots{one.suffix}",
            title="Fig. 4: snapshots of the motion in operational space",
            caption="The paper notes that where the arms seem to overlap they are there at different instants. "
            + planar_arms.SNAPSHOTS,
        ),
        paths._replace(
            stem=f"fig_6_paths{one.suffix}",
            title="Fig. 6: paths in configuration space",
            caption=f"{planar_arms.PATHS} Median length over that of the straight line: "
            f"{markdown.number(c.spread('term_path_length_ratio').median)}.",
        ),
        distances._replace(
            stem=f"fig_7_distances{one.suffix}",
            title="Fig. 7: minimum distance between the two arms",
            caption="The paper states that the distance never goes below the safety distance; it judges via-points "
            f"only. {planar_arms.DISTANCES} Least over all replicates: {markdown.number(at)} {unit} at via-points, "
            f"{markdown.number(between)} {unit} between them, {markdown.number(float(one.link_distances.min()))} "
            f"{unit} between the links themselves.",
        ),
    ]
