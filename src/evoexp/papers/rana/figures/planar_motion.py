"""Motions of planar arms: snapshots, paths in configuration space, distances between the arms."""

import itertools
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.rana import motions
from evoexp.papers.rana.figures.planar_models import ANGLES, configuration_planes, path_table
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
    AT_VIA_POINTS: {
        **{"color": style.ARM_COLOURS[0], "ls": "none", "marker": "o", "mew": 0.6, "zorder": 4},
        **style.DOTS,
    },
    CLOSEST: {
        **{"color": style.NEUTRAL, "ls": "none", "marker": "D", "ms": 3.2},
        **{"clip_on": False, "zorder": 5},
    },
    REFUTED: {
        **{"color": style.FORBIDDEN, "ls": "none", "marker": "X", "ms": 8, "mec": "white"},
        **{"clip_on": False, "zorder": 5},
    },
}
# the first instant of a panel
FIRST: dict[str, Any] = {"linestyle": (0, (2, 1)), "linewidth": 1.4, "alpha": 0.8, "zorder": 2}
MANY = 200  # marks of a series, from which on they are drawn small, below the curves
CROWDED: dict[str, dict[str, Any]] = {
    CLOSEST: {"ms": 1.5, "mew": 0.0, "alpha": 0.35, "zorder": 2},
    REFUTED: {"ms": 4.0, "mew": 0.3},
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
    spans = (links["x_end"] - links["x"]).abs() + (links["y_end"] - links["y"]).abs()
    spans += (links["z_end"] - links["z"]).abs()
    obstacles = obstacle_table(condition.scenario.obstacles)
    outlines = motion_geometry.obstacle_outlines(obstacles, 2.0 * float(spans.max()))
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
    obstacles, table = table[table["stage"] < 0], table[table["stage"] >= 0]
    stages = sorted(table["stage"].unique())
    columns = min(3, len(stages))
    lines = -(-len(stages) // columns)
    drawn = pd.concat([table, obstacles])
    x, y = drawn[["x", "x_end"]].to_numpy(), drawn[["y", "y_end"]].to_numpy()
    left, right, low, high = x.min() - 0.5, x.max() + 0.5, y.min() - 0.5, y.max() + 0.5
    width = 6.2
    panel = (width - 0.7) / columns * (high - low) / (right - left)
    figure = style.figure(lines * (min(panel, 3.2) + 0.3) + 0.8, width)
    panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    unit = table["length_unit"].iloc[0]
    for axes in panels.ravel()[len(stages) :]:
        axes.set_axis_off()
    for axes, (stage, rows) in zip(panels.ravel(), groups(table, "stage"), strict=False):
        whole = stage == stages[-1]
        for _, outline in groups(obstacles, "link"):
            axes.fill(outline["x"], outline["y"], color=style.FAINT, linewidth=0)
        first, last = rows["instant"].min(), rows["instant"].max()
        for arm, own in groups(rows, "arm"):
            colour = style.arm_colour(arm)
            tips = own[own["link"] == own["link"].max()]
            axes.plot(tips["x_end"], tips["y_end"], ":", color=colour, linewidth=0.8, zorder=2)
            between, shades = [], []
            for instant, links in groups(own, "instant"):
                line = [np.append(links[n], links[f"{n}_end"].iloc[-1]) for n in "xy"]
                if instant == last:
                    style.draw_arm(axes, arm, links)
                elif instant == first:
                    axes.plot(*line, color=colour, **FIRST)
                else:
                    between.append(np.column_stack(line))
                    shade = 0.7 - 0.5 * (last - instant) / (last - first)
                    shades.append(0.25 if whole else shade)
            look: dict[str, Any] = {"colors": colour, "linewidths": 1.0, "zorder": 1}
            axes.add_collection(LineCollection(between, alpha=shades or None, **look))
            marks.base(axes, own["x"].iloc[0], own["y"].iloc[0], 6, zorder=2)
        style.operational_axes(axes, unit)
        axes.label_outer()
        axes.set_title(motions.stage_title(rows, whole))
    panels[0, 0].set(xlim=(left, right), ylim=(low, high))
    arms = sorted(table["arm"].unique())
    keys = [
        *style.arm_keys(arms, linewidth=3),
        style.key("first instant of a panel", color=style.FAINT, lw=1.4, linestyle=(0, (2, 1))),
        style.key("last instant of a panel", color=style.NEUTRAL, linewidth=3, marker="o", ms=4),
        style.key("trace of the tip", color=style.NEUTRAL, linewidth=0.8, linestyle=":"),
    ]
    style.keys_below(figure, keys, 3)
    return figure


def paths_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the paths of all replicates and the straight line, in configuration space."""
    return motions.paths_table(condition, path_table, "best")


def draw_paths(table: pd.DataFrame) -> Figure:
    """Draw the paths in the arms' configuration planes."""
    figure, planes = configuration_planes(table, 3.7)
    for axes, arm, rows in planes:
        motions.draw_paths(axes, rows, ANGLES, "best", style.arm_colour(arm))
        axes.margins(0.08)
    style.keys_below(figure, motions.path_keys(table))
    return figure


def sampled_distances(condition: ConditionResults, samples: int) -> pd.DataFrame:
    """Return least distances along the best motion and the straight line, their range over all."""
    prepared = condition.prepared
    measures = _measures(condition)

    def sampled(solution: FloatArray) -> FloatArray:
        return motion_geometry.dense(motion_geometry.configurations(prepared, solution), samples)[1]

    series = {
        STRAIGHT: sampled(motions.straight_line(condition)),
        BEST: sampled(condition.solutions[condition.best_replicate]),
    }
    parts = [
        {"series": name, "instant": np.arange(q.shape[1]) / samples}
        | {column: exactly(q) for column, (exactly, _) in measures.items()}
        for name, q in series.items()
    ]
    ranges = motion_geometry.extremes(
        list(condition.solutions),
        lambda replicate: sampled(condition.solutions[replicate]),
        [quickly for _, quickly in measures.values()],
    )
    for name, which in ((LOWEST, "lowest"), (HIGHEST, "highest")):
        values = {
            column: exactly(getattr(found, f"at_{which}"))
            for found, (column, (exactly, _)) in zip(ranges, measures.items(), strict=True)
        }
        instants = np.arange(len(ranges[0].lowest)) / samples
        parts.append({"series": name, "instant": instants} | values)
    return rounded(pd.concat(map(pd.DataFrame, parts), ignore_index=True))


def _measures(condition: ConditionResults) -> dict[str, tuple[Measure, Measure]]:
    """Return column → its exact measure, and one as good and quick, of q (nq, instants) [deg]."""
    problem, kinds = motions.problem(condition), motions.kinds_of_pairs(condition)
    scene, by_coal = problem.scene, {motions.ARMS: motion_geometry.link_distance(problem.assembly)}
    centres = {
        motions.ARMS: problem.centre_distances,
        motions.OBSTACLES: problem.obstacle_distances,
    }
    if motions.OBSTACLES in kinds:
        geometry = scene.geometry.copy()
        geometry.removeAllCollisionPairs()
        for one, two in scene.pairs[kinds[motions.OBSTACLES][0]]:
            geometry.addCollisionPair(pin.CollisionPair(int(one), int(two)))
        by_coal[motions.OBSTACLES] = motion_geometry.BodyDistance(scene.model, geometry)
    found = dict[str, tuple[Measure, Measure]]()
    for kind, bodies in by_coal.items():
        pairs = kinds[kind][0]
        quick = motion_geometry.distance_measure(scene.of_pairs(pairs), bodies)
        found[COLUMNS[kind][CENTRES]] = (centres[kind], centres[kind])
        found[COLUMNS[kind][LINKS]] = (_in_radians(bodies), _in_radians(quick))
    return found


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
                columns = {"measure": measure, "series": name, "instant": values.index}
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
                    crowded = CROWDED.get(name, {}) if len(series[name]) > MANY else {}
                    x, y = (series[name][column] for column in ("instant", "distance"))
                    axes.plot(x, y, **{"label": name} | look | crowded)
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
