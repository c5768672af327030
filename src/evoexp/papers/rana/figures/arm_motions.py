"""Motions of arms: snapshots, paths in configuration and operational space, distances."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from evoexp.numeric.elementary import DEGREE
from evoexp.papers import trails
from evoexp.papers.rana import measures
from evoexp.papers.rana.figures.arm_models import links_table, path_table
from evoexp.papers.rana.measures import STRAIGHT, TO_OBSTACLES
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import Parts, Rows, groups, marks, rounded, style, table_of
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults

OTHERS = "replicate"
MOST_PATHS = 200  # replicates whose paths are drawn, beside the best one; more hide each other
WHITE: dict[str, Any] = {"color": "white", "markeredgecolor": style.NEUTRAL, "zorder": 5}
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
Measure = motion_geometry.Measure
TITLES = {CENTRES: "circle centres", LINKS: "bodies (exact)"}
LOWEST, HIGHEST = "lowest of all replicates", "highest of all replicates"


def snapshots_table(condition: ConditionResults) -> pd.DataFrame:
    """Return all links at every instant of the best replicate's motion."""
    problem = condition.problem(Problem)
    links = motion_geometry.links_table(problem.assembly, measures.best_motion(condition))
    table = motion_geometry.in_stages(links.sort_values("instant", kind="stable"), STAGES)
    spans = sum((links[f"{name}_end"] - links[name]).abs() for name in "xyz")
    edges = trails.obstacle_edges(condition, 2.0 * float(np.max(spans)))
    last = int(links["instant"].max())
    rows = [(-1, 0, last, 0, -1, *edge) for edge in edges]
    names = ["stage", "first", "last", "instant", "arm", "link", "x", "y", "x_end", "y_end"]
    found = pd.concat([table[names], pd.DataFrame(rows, columns=names)]) if rows else table[names]
    return rounded(found.reset_index(drop=True)).assign(length_unit=condition.length_unit)


def spatial_snapshots_table(condition: ConditionResults) -> pd.DataFrame:
    """Return all links at every instant of the best replicate's motion, stage by stage."""
    links = links_table(condition, measures.best_motion(condition))
    return motion_geometry.in_stages(links, STAGES)


def draw_snapshots(table: pd.DataFrame) -> Figure:
    """Draw the motion stage by stage, older instants fainter, and all of it in the last panel."""
    obstacles, moving = table[table["stage"] < 0], table[table["stage"] >= 0]
    stages = list(groups(moving, "stage"))
    names = "xyz" if "z" in table else "xy"
    if names == "xy":
        figure, panels = trails.planes(table, len(stages), 3)
    else:
        figure, lines, columns = style.grid(2.1, len(stages), 3, 0.4)
        places = ((lines, columns, k + 1) for k in range(len(stages)))
        panels = [trails.space_of_links(figure, place, moving) for place in places]
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
    return tables_of_paths(condition, path_table, "best")


def spatial_paths_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the paths of all replicates and the straight line in both spaces."""
    table = rounded(tables_of_paths(condition, _path, "best replicate"))
    return table.assign(length_unit=condition.length_unit)


@table_of()
def _path(condition: ConditionResults, solution: FloatArray) -> Parts:
    problem = condition.problem(Problem)
    q = motion_geometry.configurations(condition.prepared, solution)
    places = motion_geometry.joint_positions(problem.assembly, q)
    tips = {arm: end for arm, _, _, end in places}  # the last link's end stays
    for arm, (first, stop) in enumerate(problem.arm_slices):
        columns: dict[str, Any] = {"arm": arm, "instant": np.arange(q.shape[1])}
        columns |= dict(zip("xyz", tips[arm].T, strict=True))
        yield columns | {f"joint_{j + 1}_deg": q[first + j] for j in range(stop - first)}


@table_of()
def tables_of_paths(
    condition: ConditionResults,
    table: Callable[[ConditionResults, FloatArray], pd.DataFrame],
    best: str,
) -> Parts:
    """Return one table of the replicates' solutions and of the straight line."""
    solutions, best_replicate = condition.solutions, condition.best_replicate
    shown = [k for n, k in enumerate(solutions) if n < MOST_PATHS or k == best_replicate]
    others = OTHERS if len(shown) == len(solutions) else f"{OTHERS} of {len(solutions)}"
    for k in shown:
        series = best if k == best_replicate else others
        yield {**table(condition, solutions[k]), "series": series, "replicate": k}
    straight = table(condition, measures.straight_line(condition))
    yield {**straight, "series": STRAIGHT, "replicate": -1}


def draw_paths(table: pd.DataFrame, columns: list[str], *, together: bool = False) -> Figure:
    """Draw the paths of arms in the plane, or in space, of some columns; each arm in a panel.

    Together they stand in one panel, which is that of the operational space.
    """
    arms, is_solid = list(groups(table, "arm")), len(columns) == 3
    figure = style.figure(4.0, 5.6 if together else style.WIDTH)
    for k, (arm, rows) in enumerate(arms):
        colour = style.arm_colour(arm)
        if k == 0 or not together:
            place = (1, 1 if together else len(arms), k + 1)
            axes: Any = figure.add_subplot(*place, projection="3d" if is_solid else None)
        for (series, _), path in groups(rows, ["series", "replicate"]):
            points = [path[name].to_numpy() for name in columns]
            if series.startswith("best"):
                axes.plot(*points, color=colour, linewidth=1.8, marker="o", ms=2.6, zorder=4)
                axes.plot(*(p[:1] for p in points), "s", markersize=6.5, **WHITE)
                axes.plot(*(p[-1:] for p in points), "*", markersize=10.5, **WHITE)
            elif series == STRAIGHT:
                axes.plot(*points, ":", color=style.NEUTRAL, linewidth=1.1, zorder=3)
            else:
                axes.plot(*points, color=colour, linewidth=0.8, alpha=0.3)
        labels = [f"{style.joint_symbol(arm, joint)} [deg]" for joint in range(len(columns))]
        if together:
            labels = [f"{name} [{table['length_unit'].iloc[0]}]" for name in columns]
        for name, label in zip("xyz", labels, strict=False):
            getattr(axes, f"set_{name}label")(label, labelpad=-2 if is_solid else None)
            getattr(axes, f"{name}axis").set_major_locator(style.few_ticks())
        axes.set_title("" if together else f"arm {arm + 1}")
        if is_solid:
            axes.tick_params(labelsize=6, pad=-1)
            axes.view_init(elev=24.0, azim=-50.0)
            axes.set_box_aspect(None, zoom=0.85)
        else:
            axes.set_aspect("equal", adjustable="datalim")  # lengths are Euclidean in degrees
    count, grey = table.loc[table["replicate"] >= 0, "replicate"].nunique(), style.NEUTRAL
    some = [name for name in table["series"].unique() if name.startswith(f"{OTHERS} of ")]
    shown = f"{count} of {some[0].split()[-1]} replicates" if some else ""
    keys = [
        *(trails.arm_keys(set(table["arm"])) if together else ()),
        style.key("best replicate, its via-points", color=grey, linewidth=1.8, marker="o", ms=3),
        style.key(shown or f"all replicates (n = {count})", color=grey, linewidth=0.8, alpha=0.4),
        style.key(STRAIGHT, color=grey, linewidth=1.1, linestyle=":"),
        style.key("start", marker="s", ms=6.5, color="none", mec=grey, mfc="white"),
        style.key("goal", marker="*", ms=10.5, color="none", mec=grey, mfc="white"),
    ]
    style.keys_below(figure, keys, 4)
    return figure


@table_of("measure series instant distance kind safety_distance length_unit", is_rounded=True)
def distances_table(condition: ConditionResults, samples: int) -> Rows:
    """Return least distances along the best motion and the straight line, their range over all."""
    solutions, exact = condition.solutions, measures.approaches(condition)
    sampled = partial(measures.sampled, condition, samples=samples)
    for kind, (pairs, margin) in measures.kinds_of_pairs(condition).items():
        own = exact[exact["kind"] == kind]
        for measure, (exactly, quickly) in _measures(condition, kind, pairs).items():
            lowest, highest = motion_geometry.extremes(
                list(solutions), lambda replicate: sampled(solutions[replicate]), quickly
            )
            places = {
                BEST: sampled(solutions[condition.best_replicate]),
                LOWEST: lowest,
                HIGHEST: highest,
                STRAIGHT: sampled(measures.straight_line(condition)),
            }
            # series → its instants, and the distance at each
            series = {
                name: (np.arange(q.shape[1]) / samples, exactly(q)) for name, q in places.items()
            }
            instants, distances = series[BEST]
            at_via_points = instants[::samples], distances[::samples]
            series = {BEST: series[BEST], AT_VIA_POINTS: at_via_points, **series}
            if measure == LINKS:
                for name, at_name in ((CLOSEST, "clearance_at"), (REFUTED, "refuted_at")):
                    rows = own[own["refuted_at"].notna() == (name == REFUTED)]
                    series[name] = rows[at_name].to_numpy(), rows["clearance"].to_numpy()
            for name, values in series.items():
                yield measure, name, *values, kind, margin, condition.length_unit


def _measures(
    condition: ConditionResults, kind: str, pairs: np.ndarray
) -> dict[str, tuple[Measure, Measure]]:
    """Return measure → the exact one, and one as good and quick, of q (nq, instants) [deg]."""
    problem = condition.problem(Problem)
    to_obstacles, scene = kind == TO_OBSTACLES, problem.scene.of_pairs(pairs)
    centres = problem.obstacle_distances if to_obstacles else problem.centre_distances
    bodies = motion_geometry.BodyDistance(scene), motion_geometry.distance_measure(scene)
    exactly, quickly = (partial(_in_radians, measure) for measure in bodies)
    return {CENTRES: (centres, centres), LINKS: (exactly, quickly)}


def _in_radians(measure: Measure, q: FloatArray) -> FloatArray:
    return measure(DEGREE * q)


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
