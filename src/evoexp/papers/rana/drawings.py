"""The figures of Rana & Zalzala 1995: 1–7 of arms in the plane, 8–13 of arms in space."""

import re
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evoexp.papers.rana import motions, planar_page
from evoexp.papers.rana.figures import planar_models, planar_motion, spatial_models, spatial_paths
from evoexp.report.kit import (
    ConditionResults,
    Drawing,
    PlayedRun,
    ReportSettings,
    Results,
    convergence,
    markdown,
)

AT, BETWEEN = "term_arm_distance_at_via_points", "term_arm_distance_between_sampled"


class MeasuredMotions(NamedTuple):
    """A condition, the end of its files' names, and the distances along its motions."""

    condition: ConditionResults
    suffix: str
    sampled: pd.DataFrame

    @property
    def planar(self) -> bool:
        """Return whether its arms move in a plane."""
        return bool(motions.problem(self.condition).assembly.table.planar)

    @property
    def margin(self) -> float:
        """The safety distance [length unit]."""
        return motions.problem(self.condition).security_margin


def measure(condition: ConditionResults, suffix: str, settings: ReportSettings) -> MeasuredMotions:
    """Return a condition with the distances along its motions."""
    return MeasuredMotions(
        condition, suffix, planar_motion.sampled_distances(condition, settings.samples_per_segment)
    )


def drawings(one: MeasuredMotions) -> list[Drawing]:
    """Return the paper's figures of one condition, without those of its fitness."""
    own = [*(_planar(one) if one.planar else _spatial(one)), _distances(one)]
    return (
        [drawing._replace(title=f"{drawing.title}{_of(one)}") for drawing in own]
        if one.suffix
        else own
    )


def order(drawing: Drawing) -> tuple[int, str]:
    """Return the key that sorts drawings by the number of the paper's figure."""
    return int(re.findall(r"\d+", drawing.stem)[0]), drawing.stem


def _planar(one: MeasuredMotions) -> list[Drawing]:
    c, suffix = one.condition, one.suffix
    snapshots, paths = planar_page.motion_drawings(c, suffix)
    return [
        Drawing(
            f"fig_1_arms{suffix}",
            "Fig. 1: the two arms in operational space",
            "The paper's Fig. 1 names the arms and their joint angles. Here: start (angles "
            "marked) and goal (faint) of Tab. 2; angles are relative to the link before, "
            "counter-clockwise; link lengths and bases are assumed.",
            partial(planar_models.arms_table, c),
            planar_models.draw_arms,
            (c,),
        ),
        Drawing(
            f"fig_2_via_points{suffix}",
            "Fig. 2: a path as a string of via-points in configuration space",
            "The paper's Fig. 2 shows one path in one plane. Here: both arms' strings of the "
            "best replicate, the best of its initial population (grey) and its last; equal "
            "numbers are the same instant.",
            partial(planar_models.via_points_table, c),
            planar_models.draw_via_points,
            (c,),
        ),
        Drawing(
            f"fig_3_circles{suffix}",
            "Fig. 3: links approximated by touching circles",
            "Two arms collide in the model when circle centres of both are closer than 2r. Here: "
            "the via-point of the best replicate at which they are closest; the links themselves "
            "may be nearer than the nearest centres.",
            partial(planar_models.circles_table, c),
            planar_models.draw_circles,
            (c,),
        ),
        snapshots._replace(
            stem=f"fig_4_snapshots{suffix}",
            title="Fig. 4: snapshots of the motion in operational space",
            caption="The paper notes that where the arms seem to overlap they are there at "
            "different "
            "instants. " + planar_page.SNAPSHOTS,
        ),
        paths._replace(
            stem=f"fig_6_paths{suffix}",
            title="Fig. 6: paths in configuration space",
            caption=f"{planar_page.PATHS} {_ratio(c)}",
        ),
    ]


def _spatial(one: MeasuredMotions) -> list[Drawing]:
    c, suffix = one.condition, one.suffix
    paths = partial(spatial_paths.paths_table, c)
    return [
        Drawing(
            f"fig_8_arm{suffix}",
            "Fig. 8: a PUMA-like arm and its approximation",
            "The paper shows the PUMA 560 and its approximation by line segments. Here: the "
            "first arm at its start, a) as the planner sees it (spheres on the second and third "
            "links, none on the column), b) as line segments, which are the bodies that the "
            "exact verdict judges, the column included.",
            partial(spatial_models.arm_table, c),
            spatial_models.draw_arm,
            (c,),
        ),
        Drawing(
            f"fig_9_two_arms{suffix}",
            "Fig. 9: two PUMA-like arms that share a part of their workspace",
            "Start and goal of Tab. 4 with the paper's point names; link lengths and the "
            "distance of the bases are assumed. b) Discs: how far each arm reaches around its "
            "shoulder.",
            partial(spatial_models.two_arms_table, c),
            spatial_models.draw_two_arms,
            (c,),
        ),
        Drawing(
            f"fig_11_snapshots{suffix}",
            "Fig. 11: motion of the two arms in operational space",
            "Motion of the best replicate (lowest cost), stage by stage; the newest instant of a "
            "panel is thick.",
            partial(spatial_models.snapshots_table, c),
            spatial_models.draw_snapshots,
            (c,),
            (PlayedRun(c, c.best_replicate),),
        ),
        Drawing(
            f"fig_12b_configuration_space{suffix}",
            "Fig. 12b: paths in configuration space",
            "The paper's caption says configuration space, its text operational space: both are "
            "drawn. Paths of all replicates (200 at most) through the joint angles; angles are not "
            "wrapped. "
            f"{_ratio(c)}",
            paths,
            spatial_paths.draw_configuration_space,
            (c,),
        ),
        Drawing(
            f"fig_12b_operational_space{suffix}",
            "Fig. 12b: paths in operational space",
            "The same motions as paths of the arms' tips; the straight line is the one in "
            "configuration space.",
            paths,
            spatial_paths.draw_operational_space,
            (c,),
        ),
    ]


def _ratio(condition: ConditionResults) -> str:
    median = condition.spread("term_path_length_ratio").median
    return f"Median length over that of the straight line: {markdown.number(median)}."


def fitness(results: Results, drawn: Sequence[MeasuredMotions]) -> Iterator[Drawing]:
    """Yield Figs. 5 and 12a: one figure per scene, of all conditions and controls in it."""
    scenes = list(dict.fromkeys(_scene(one.condition) for one in drawn))
    for scene in scenes:
        first = next(one for one in drawn if _scene(one.condition) == scene)
        within = results._replace(
            conditions=tuple(c for c in results.conditions if _scene(c) == scene)
        )
        stem, number = ("fig_5_fitness", "5") if first.planar else ("fig_12a_fitness", "12a")
        several = len(scenes) > 1
        yield Drawing(
            f"{stem}{first.suffix}" if several else stem,
            f"Fig. {number}: best and average fitness against "
            f"generation{_of(first) if several else ''}",
            "The paper shows one run; its fitness is F = C_max − cost (Eq. 7 with the sign that "
            "punishes collisions). Here medians and quartiles over replicates; the average is "
            "over a generation's individuals, elites included.",
            partial(convergence.fitness_table, within),
            convergence.draw_fitness,
            within.with_data,
        )


def _scene(condition: ConditionResults) -> tuple[Any, Any]:
    return condition.condition.robot, condition.condition.scenario


def _of(one: MeasuredMotions) -> str:
    return f" ({one.condition.label})"


def _distances(one: MeasuredMotions) -> Drawing:
    c, unit = one.condition, one.condition.condition.length_unit
    at, between = float(np.min(c.column(AT))), float(np.min(c.column(BETWEEN)))
    drawing = planar_page.distances_drawing(c, one.suffix, one.sampled)
    number = "7" if one.planar else "13"
    return drawing._replace(
        stem=f"fig_{number}_distances{one.suffix}",
        title=f"Fig. {number}: minimum distance between the two arms",
        caption="The paper states that the distance never goes below the safety distance; it "
        "judges "
        f"via-points only. {planar_page.DISTANCES} Least over all replicates: "
        f"{markdown.number(at)} {unit} at via-points, {markdown.number(between)} {unit} "
        "between them; least clearance of the bodies over the whole motion (exact): "
        f"{markdown.number(float(np.min(c.column('clearance'))))} {unit}.",
    )
