"""Motions of planar arms: snapshots, paths in configuration space, distances between the arms."""

import itertools
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from evoexp.numeric.elementary import DEGREE
from evoexp.papers import trails
from evoexp.papers.rana import motions
from evoexp.papers.rana.figures.planar_models import ANGLES, path_table
from evoexp.papers.rana.motions import STRAIGHT
from evoexp.records import FloatArray
from evoexp.report.figures import groups, marks, rounded, style
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults
from evoexp.scenarios.obstacles import obstacle_table

STAGES = 5  # panels that a motion is cut into; the sixth holds all of it
CENTRES, LINKS = "circle centres", "links"
BEST, AT_VIA_POINTS = "best replicate", "best replicate, at via-points"
CLOSEST = "closest over the whole motion, every replicate that is free (exact)"
REFUTED = "refuted: first contact of bodies"
LOOKS: dict[str, dict[str, Any]] = {  # of the series of distances that are drawn as they are
    STRAIGHT: {"linestyle": ":", "color": style.FAINT, "lw": 1.2},
    BEST: {"color": style.ARM_COLOURS[0], "lw": 1.3, "label": f"{BEST}, between via-points too"},
    AT_VIA_POINTS: {"color": style.ARM_COLOURS[0], "ls": "none", "marker": "o", **style.DOTS},
    CLOSEST: {"color": style.NEUTRAL, "ls": "none", "marker": "D", "ms": 2.2, "alpha": 0.6},
    REFUTED: {"color": style.FORBIDDEN, "ls": "none", "marker": "X", "ms": 5, "mec": "white"},
}
COLUMNS = {  # of `sampled_distances`, by kind of pairs and measure
    motions.ARMS: {CENTRES: "centres", LINKS: "links"},
    motions.OBSTACLES: {CENTRES: "centres_to_obstacles", LINKS: "links_to_obstacles"},
}
Measure = motion_geometry.Measure
TITLES = {CENTRES: "circle centres", LINKS: "bodies (exact)"}
LOWEST, HIGHEST = "lowest of all replicates", "highest of all replicates"


def snapshots_table(condition: ConditionResults) -> pd.DataFrame:
    """Return all links at every instant of the best replicate's motion."""
    problem = motions.problem(condition)
    links = motion_geometry.links_table(problem.assembly, motions.best_motion(condition))
    table = motion_geometry.in_stages(links.sort_values("instant", kind="stable"), STAGES)
    spans = sum((links[f"{name}_end"] - links[name]).abs() for name in "xyz")
    obstacles = obstacle_table(condition.scenario.obstacles)
    outlines = motion_geometry.obstacle_outlines(obstacles, 2.0 * float(np.max(spans)))
    last = int(links["instant"].max())
    rows = [
        (-1, 0, last, 0, -1, k, *a, *b)
        for k, outline in enumerate(outlines)
        for a, b in itertools.pairwise(outline)
    ]
    names = ["stage", "first", "last", "instant", "arm", "link", "x", "y", "x_end", "y_end"]
    found = pd.concat([table[names], pd.DataFrame(rows, columns=names)]) if rows else table[names]
    return rounded(found.reset_index(drop=True)).assign(length_unit=condition.length_unit)


def draw_snapshots(table: pd.DataFrame) -> Figure:
    """Draw the motion stage by stage, older instants fainter, and all of it in the last panel."""
    obstacles, moving = table[table["stage"] < 0], table[table["stage"] >= 0]
    stages, unit = list(groups(moving, "stage")), table["length_unit"].iloc[0]
    names = "xyz" if "z" in table else "xy"
    if names == "xy":
        figure, panels = trails.planes(table, len(stages), 3)
    else:
        lines = -(-len(stages) // 3)
        figure = style.figure(2.1 * lines + 0.4)
        ends = moving[[f"{name}{end}" for end in ("", "_end") for name in names]].to_numpy()
        points, places = ends.reshape(-1, 3), range(1, len(stages) + 1)
        panels = [trails.space(figure, (lines, 3, k), points, unit) for k in places]
    for axes, (stage, rows) in zip(panels, stages, strict=True):
        for _, outline in groups(obstacles, "link"):
            axes.fill(outline["x"], outline["y"], color=style.FAINT, linewidth=0)
        for arm, links in groups(rows, "arm"):
            trails.draw_trail(axes, links, style.arm_colour(arm), names)
            trails.draw_base(axes, links, names)
        instants = f"instants {rows['first'].iloc[0]}–{rows['last'].iloc[0]}"
        axes.set_title(f"all {instants}" if stage == stages[-1][0] else instants)
    style.keys_below(figure, trails.trail_keys(set(moving["arm"])), 3)
    return figure


def paths_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the paths of all replicates and the straight line, in configuration space."""
    return motions.paths_table(condition, path_table, "best")


def draw_paths(table: pd.DataFrame) -> Figure:
    """Draw the paths in the arms' configuration planes."""
    return motions.draw_paths(table, ANGLES)


def sampled_distances(condition: ConditionResults, samples: int) -> pd.DataFrame:
    """Return least distances along the best motion and the straight line, their range over all."""
    measures = _measures(condition)

    def sampled(solution: FloatArray) -> FloatArray:
        q = motion_geometry.configurations(condition.prepared, solution)
        return motion_geometry.dense(q, samples)[1]

    # series → the configurations (nq, instants) [deg] at which each quantity is measured
    series = {
        STRAIGHT: [sampled(motions.straight_line(condition))] * len(measures),
        BEST: [sampled(condition.solutions[condition.best_replicate])] * len(measures),
    }
    ranges = motion_geometry.extremes(
        list(condition.solutions),
        lambda replicate: sampled(condition.solutions[replicate]),
        [quickly for _, quickly in measures.values()],
    )
    series[LOWEST] = [found.at_lowest for found in ranges]
    series[HIGHEST] = [found.at_highest for found in ranges]
    parts = []
    for name, places in series.items():
        columns: dict[str, Any] = {
            "series": name,
            "instant": np.arange(places[0].shape[1]) / samples,
        }
        for q, (column, (exactly, _)) in zip(places, measures.items(), strict=True):
            columns[column] = exactly(q)
        parts.append(pd.DataFrame(columns))
    return rounded(pd.concat(parts, ignore_index=True))


def _measures(condition: ConditionResults) -> dict[str, tuple[Measure, Measure]]:
    """Return column → its exact measure, and one as good and quick, of q (nq, instants) [deg]."""
    problem, kinds = motions.problem(condition), motions.kinds_of_pairs(condition)
    scene, by_coal = problem.scene, {motions.ARMS: motion_geometry.link_distance(problem.assembly)}
    if motions.OBSTACLES in kinds:
        geometry = scene.geometry.copy()
        geometry.removeAllCollisionPairs()
        for one, two in scene.pairs[kinds[motions.OBSTACLES][0]]:
            geometry.addCollisionPair(pin.CollisionPair(int(one), int(two)))
        by_coal[motions.OBSTACLES] = motion_geometry.BodyDistance(scene.model, geometry)
    measures = dict[str, tuple[Measure, Measure]]()
    for kind, bodies in by_coal.items():
        own = problem.centre_distances if kind == motions.ARMS else problem.obstacle_distances
        quick = motion_geometry.distance_measure(scene.of_pairs(kinds[kind][0]), bodies)
        measures[COLUMNS[kind][CENTRES]] = (own, own)
        measures[COLUMNS[kind][LINKS]] = (_in_radians(bodies), _in_radians(quick))
    return measures


def _in_radians(measure: Measure) -> Measure:
    return lambda q: measure(DEGREE * q)


def distances_table(condition: ConditionResults, sampled: pd.DataFrame) -> pd.DataFrame:
    """Return the distances that Fig. 7 shows."""
    found = {name: rows.set_index("instant") for name, rows in groups(sampled, "series")}
    best = found[BEST]
    found[AT_VIA_POINTS] = best[best.index == best.index.to_numpy().round()]
    drawn = (BEST, AT_VIA_POINTS, LOWEST, HIGHEST, STRAIGHT)
    exact, parts = motions.approaches(condition), []
    for kind, (_, margin) in motions.kinds_of_pairs(condition).items():
        own = exact[exact["kind"] == kind]
        for measure, column in COLUMNS[kind].items():
            series = {name: found[name][column] for name in drawn}
            if measure == LINKS:
                free = own[own["refuted_at"].isna()].set_index("clearance_at")["clearance"]
                touching = own[own["refuted_at"].notna()].set_index("refuted_at")["clearance"]
                series |= {CLOSEST: free, REFUTED: touching}
            for name, values in series.items():
                columns: dict[str, Any] = {
                    "measure": measure,
                    "series": name,
                    "instant": values.index,
                }
                rows = pd.DataFrame(columns | {"distance": values.to_numpy()})
                parts.append(rows.assign(kind=kind, safety_distance=margin))
    table = rounded(pd.concat(parts, ignore_index=True))
    return table.assign(length_unit=condition.length_unit)


def draw_distances(table: pd.DataFrame) -> Figure:
    """Draw the least distances at each instant, those to obstacles beside those between arms."""
    figure = style.figure(5.4)
    kinds = list(dict.fromkeys(table["kind"]))
    panels = figure.subplots(2, len(kinds), sharex=True, squeeze=False)
    unit, letters = table["length_unit"].iloc[0], iter("abcd")
    required = {kind: rows["safety_distance"].iloc[0] for kind, rows in groups(table, "kind")}
    below = ", ".join(f"{required[kind]:g} {unit} {kind}" for kind in kinds)
    for axes_of_kind, kind in zip(panels.T, kinds, strict=True):
        own = table[table["kind"] == kind]
        for axes, measure in zip(axes_of_kind, (CENTRES, LINKS), strict=True):
            series = dict(groups(own[own["measure"] == measure], "series"))
            low, high, red = series[LOWEST], series[HIGHEST], style.FORBIDDEN
            ends = low["distance"], high["distance"], style.ARM_COLOURS[0]
            marks.band(axes, low["instant"], *ends, label="range over replicates")
            for name, look in LOOKS.items():
                if name in series and len(series[name]):
                    x, y = (series[name][column] for column in ("instant", "distance"))
                    axes.plot(x, y, **{"label": name} | look)
            label, safety = f"below the required distance: {below}", required[kind]
            axes.axhspan(0.0, safety, color=red, alpha=0.08, linewidth=0, label=label)
            axes.axhline(safety, color=red, linewidth=1.0, linestyle=(0, (5, 2)))
            axes.set(
                title=f"{next(letters)}  {kind}: {TITLES[measure]}",
                ylabel=f"least distance [{unit}]",
                xlim=(0, table["instant"].max()),
                ylim=(0, None),
            )
        axes_of_kind[-1].xaxis.set_major_locator(MaxNLocator(integer=True, nbins=12))
        axes_of_kind[-1].set_xlabel("instant (whole numbers: via-points)")
    style.legend_below(figure, [panels[1, 0]], 2)
    return figure
