"""The page of planar arms with two joints each: convergence, snapshots, paths, distances."""

from functools import partial

import pandas as pd

from evoexp.papers.rana.figures import planar_motion
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.report.kit import ConditionResults, Drawing, Page, ReportSettings, Results, generic

SNAPSHOTS = (
    "Motion of the best replicate (lowest cost), stage by stage; links that cross on paper in "
    "one panel do so at different instants unless both are drawn in the same shade."
)
PATHS = "Paths of all replicates in the planes of the joint angles; angles are not wrapped."
DISTANCES = (
    "Least distance between two arms against the instant: a) of the centres of circles or "
    "spheres, b) of the bodies themselves; at via-points (dots) and sampled between them (line); "
    "diamonds and crosses: the exact verdict."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of planar arms, or the generic page if no robot is drawable."""
    shown = [(c, suffix) for c, suffix in results.suffixed if drawable(c)]
    if not shown:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    drawings = list(base.drawings)
    for condition, suffix in shown:
        drawings += motion_drawings(condition, suffix)
        if condition.problem(Problem).assembly.num_arms > 1:
            sampled = planar_motion.sampled_distances(condition, settings.samples_per_segment)
            drawings.append(distances_drawing(condition, suffix, sampled))
    return base._replace(drawings=tuple(drawings))


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
        _title("Least distance between the arms", condition, suffix),
        DISTANCES,
        partial(planar_motion.distances_table, condition, sampled),
        planar_motion.draw_distances,
        (condition,),
    )


def _title(text: str, condition: ConditionResults, suffix: str) -> str:
    return f"{text} ({condition.label})" if suffix else text
