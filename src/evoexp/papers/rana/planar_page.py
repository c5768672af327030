"""The page of planar arms with two joints each: convergence, snapshots, paths, distances."""

from collections.abc import Iterator
from functools import partial

import pandas as pd

from evoexp.papers.rana import measures, motions
from evoexp.papers.rana.figures import planar_motion
from evoexp.papers.rana.rules import RULES
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.report.kit import (
    Claim,
    ConditionResults,
    Drawing,
    Judge,
    Page,
    PlayedRun,
    ReportSettings,
    Results,
    generic,
    judging,
    markdown,
    run_measures,
)

INTRODUCTION = (
    "Strings of via-points for planar arms, evolved together. A string has one path per arm; two "
    "arms collide at an instant if circles of both overlap, an arm and an obstacle if a circle of "
    "the arm reaches it. The planner keeps circles apart: links keep the sum of two radii from "
    "each other and one radius from obstacles, as far as circles stand for links."
)
SNAPSHOTS = (
    "Motion of the best replicate (lowest cost), stage by stage; links that cross on paper in "
    "one panel do so at different instants unless both are drawn in the same shade."
)
PATHS = (
    "Paths of all replicates, or of 200 if there are more, in the planes of the joint angles; "
    "angles are not wrapped."
)
DISTANCES = (
    "Least distance against the instant: of the centres of circles or spheres, and of the bodies "
    "themselves; at via-points (dots) and sampled between them (line); diamonds and crosses: the "
    "exact verdict on every replicate. Obstacles have panels and a required distance of their own."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of planar arms, or the generic page if no robot is drawable."""
    shown = [(c, suffix) for c, suffix in results.suffixed if drawable(c)]
    if not shown:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    judge = judging.judge(results, settings, RULES)
    drawings, claims = list(base.drawings), list[Claim]()
    for condition, suffix in shown:
        drawings += motion_drawings(condition, suffix)
        if condition.problem(Problem).assembly.num_arms > 1:
            sampled = planar_motion.sampled_distances(condition, settings.samples_per_segment)
            drawings.append(distances_drawing(condition, suffix, sampled))
        claims += _claims(judge, condition)
    cost, _, *effort = base.quantities
    first = generic.quantity(
        results, measures.FIRST_FREE, "generation", run_measures.first_feasible
    )
    return base._replace(
        title=f"Rana & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=(cost, first, *effort),
        claims=tuple(claims),
        drawings=tuple(drawings),
    )


def _claims(judge: Judge, condition: ConditionResults) -> Iterator[Claim]:
    """Judge section 5's claims of extension: static obstacles, more than two arms."""
    problem, unit = condition.problem(Problem), condition.condition.length_unit
    arms, kinds = problem.assembly.num_arms, motions.kinds_of_pairs(condition)
    extensions = []
    if motions.OBSTACLES in kinds:
        extensions.append("The algorithm can easily be extended to static obstacles")
    if arms > 2:
        extensions.append(f"The algorithm plans for any multi-arm system, here for {arms} arms")
    exact, verdicts = motions.approaches(condition), condition.verdicts
    told = [
        f"{kind} {markdown.number(float(own['clearance'].min()))} {unit} at least (required "
        f"{margin:g}, kept in {markdown.share(int(own['kept'].sum()), len(own))})"
        for kind, (_, margin) in kinds.items()
        for own in (exact[exact["kind"] == kind],)
    ]
    for name in extensions:
        for rule, evidence, holds in (
            ("extends_at_via_points", "finished runs", condition.solved),
            ("extends_whole_motion", "motions certified", verdicts.certified),
            (
                "extends_with_margin",
                f"motions keep them; {', '.join(told)}",
                verdicts.with_margin,
            ),
        ):
            text = f"{markdown.share(holds, condition.done)} {evidence}"
            hearing = judge.on(rule, extension=name)
            yield hearing.every(text, holds, condition.done, condition.planned)


def drawable(condition: ConditionResults) -> bool:
    """Return whether a condition's arms move in a plane and have two joints each."""
    problem = condition.prepared.problem
    if not isinstance(problem, Problem) or not problem.assembly.table.planar:
        return False
    return all(stop - first == 2 for first, stop in problem.arm_slices)


def motion_drawings(condition: ConditionResults, suffix: str) -> list[Drawing]:
    """Return snapshots and paths of one condition."""
    return [
        Drawing(
            f"snapshots{suffix}",
            _title("Snapshots of the motion", condition, suffix),
            SNAPSHOTS,
            partial(planar_motion.snapshots_table, condition),
            planar_motion.draw_snapshots,
            (condition,),
            (PlayedRun(condition, condition.best_replicate),),
        ),
        Drawing(
            f"paths{suffix}",
            _title("Paths in configuration space", condition, suffix),
            PATHS,
            partial(planar_motion.paths_table, condition),
            planar_motion.draw_paths,
            (condition,),
        ),
    ]


def distances_drawing(condition: ConditionResults, suffix: str, sampled: pd.DataFrame) -> Drawing:
    """Return the figure of distances between the arms of one condition."""
    return Drawing(
        f"distances{suffix}",
        _title("Least distances", condition, suffix),
        DISTANCES,
        partial(planar_motion.distances_table, condition, sampled),
        planar_motion.draw_distances,
        (condition,),
    )


def _title(text: str, condition: ConditionResults, suffix: str) -> str:
    return f"{text} ({condition.label})" if suffix else text
