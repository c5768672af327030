"""The figures of Rana & Zalzala 1995: 1–7 of arms in the plane, 8–13 of arms in space."""

import re
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import pandas as pd

from evoexp.papers.rana import motions
from evoexp.papers.rana.figures import planar_models, planar_motion, spatial_models, spatial_paths
from evoexp.papers.rana.rules import PAPER
from evoexp.report import kit
from evoexp.report.kit import convergence, markdown

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
        (f"fig_12b_{space}_space", spatial_paths.paths_table, draw)
        for space, draw in (
            ("configuration", spatial_paths.draw_configuration_space),
            ("operational", spatial_paths.draw_operational_space),
        )
    ),
)
PLAYED = ("fig_4_snapshots", "fig_11_snapshots")  # figures of the best replicate's motion


class MeasuredMotions(NamedTuple):
    """A condition, the end of its files' names, and the distances along its motions."""

    condition: kit.ConditionResults
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


def measure(
    condition: kit.ConditionResults, suffix: str, settings: kit.ReportSettings
) -> MeasuredMotions:
    """Return a condition with the distances along its motions."""
    return MeasuredMotions(
        condition, suffix, planar_motion.sampled_distances(condition, settings.samples_per_segment)
    )


def drawings(one: MeasuredMotions) -> list[kit.Drawing]:
    """Return the paper's figures of one condition, without those of its fitness."""
    c = one.condition
    median = c.spread("term_path_length_ratio").median
    ratio = f"Median length over that of the straight line: {markdown.number(median)}."
    played = (kit.PlayedRun(c, c.best_replicate),)
    figures = [
        PAPER.drawing(
            name,
            partial(table, c),
            draw,
            (c,),
            played if name in PLAYED else (),
            one.suffix,
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
            partial(convergence.fitness_table, within),
            convergence.draw_fitness,
            within.with_data,
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
        partial(planar_motion.distances_table, c, one.sampled),
        planar_motion.draw_distances,
        (c,),
        suffix=one.suffix,
        number="7" if one.planar else "13",
        at=at,
        between=between,
        clearance=clearance,
        unit=c.condition.length_unit,
    )
