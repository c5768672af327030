"""Pictures of any motion: the scene with start and goal, joints, and bodies beside covers.

Every table of bodies has one row per body and place; the functions that draw need nothing else.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from evoexp.playback.colours import OBJECT, OBSTACLE
from evoexp.playback.recording import Outline, Recording, Shape
from evoexp.records import FloatArray
from evoexp.report.figures import groups, records, rounded, style, surfaces

VIEW = (22.0, -58.0)  # [deg] elevation and azimuth
OPACITY = {"start": 1.0, "goal": 0.35, "body": 1.0, "cover": 0.5, "obstacle": 0.3, "object": 0.9}
STANDING = {"obstacle": OBSTACLE, "object": OBJECT}  # colours of bodies that are no robot's
LINE = 0.012  # [-] of the picture's radius: half the width of links without thickness
FLOOR = 1.1  # [-] of the picture's radius: half the edge of the part of a half-space that is drawn
NO_LIMIT = 1e6  # [rad, length unit] from here on a joint has no limit
POSE = ["x", "y", "z", "qx", "qy", "qz", "qw"]
SIZE = ["size_1", "size_2", "size_3"]
COLUMNS = ["panel", "title", "element", "name", "arm", "kind", *SIZE, *POSE, "corners"]


def scenes_table(shown: Sequence[tuple[str, Recording]]) -> pd.DataFrame:
    """Return bodies at start and goal, obstacles and ways of tools, a panel per (title, motion)."""
    tables = []
    for panel, (title, recording) in enumerate(shown):
        rows = [
            *_bodies(recording, 0, "start"),
            *_bodies(recording, -1, "goal"),
            *_still(recording),
        ]
        tables.append(_table(rows, panel, title, recording))
    return pd.concat(tables, ignore_index=True)


def covers_table(shown: Sequence[tuple[str, Recording, Sequence[Any]]]) -> pd.DataFrame:
    """Return the exact bodies of robots at their start, and the covers that the search tests.

    Those are rows (Pinocchio's joint, start, end, radius).
    """
    tables = []
    for k, (title, recording, covers) in enumerate(shown):
        bodies = [row for row in _bodies(recording, 0, "body") if row["element"] == "body"]
        frames = recording.poses.world[0]
        own = []
        for joint, start, end, radius in covers:  # spheres, or capsules between two points
            place = pin.XYZQUATToSE3(frames[joint - 1]) if joint > 0 else pin.SE3.Identity()
            pose, length = surfaces.capsule(start, end)
            drawn = Outline("sphere", (float(radius),))
            if length:
                drawn = Outline("capsule", (float(radius), length))
            here = np.asarray(pin.SE3ToXYZQUAT(place * pose))
            own.append(_row("cover", Shape("", joint - 1, here, drawn, "arm", 1), here))
        names = f"{title}: {len(bodies)} exact bodies", f"{len(own)} covers that the search tests"
        tables.append(_table(bodies, 2 * k, names[0], recording))
        tables.append(_table(own, 2 * k + 1, names[1], recording))
    return pd.concat(tables, ignore_index=True)


def joints_table(recording: Recording) -> pd.DataFrame:
    """Return all joints over a motion, with the robot's limits, infinite where there is none."""
    model, tables = recording.parts[0].scene.model, []
    limits = np.array([model.lowerPositionLimit, model.upperPositionLimit], dtype=np.float64).T
    limits = np.where(np.abs(limits) < NO_LIMIT, limits, np.copysign(np.inf, limits))
    for k, joint in enumerate(recording.joints):
        scale = 1.0 if joint.prismatic else 180.0 / np.pi
        columns = {"instant": recording.times, "value": scale * recording.q[:, k]}
        low, high = scale * limits[k]
        unit = recording.length_unit if joint.prismatic else "deg"
        tables.append(pd.DataFrame(columns).assign(joint=joint.name, unit=unit, low=low, high=high))
    return rounded(pd.concat(tables, ignore_index=True))


def _table(rows: Iterable[dict[str, Any]], panel: int, title: str, own: Recording) -> pd.DataFrame:
    table = pd.DataFrame(list(rows)).assign(panel=panel, title=title)
    table = table.reindex(columns=COLUMNS)
    return rounded(table).assign(planar=own.view.planar, length_unit=own.length_unit)


def _bodies(recording: Recording, tick: int, element: str) -> Iterable[dict[str, Any]]:
    """Yield the rows of the bodies that move, and of the robot's that stand, at a tick."""
    for shape in recording.shapes:
        is_object = shape.role == "object"
        if shape.role != "obstacle" and (element != "goal" or (shape.frame >= 0 and not is_object)):
            yield _row("object" if is_object else element, shape, recording.world_pose(shape, tick))


def _still(recording: Recording) -> Iterable[dict[str, Any]]:
    for shape in recording.shapes:
        if shape.role == "obstacle":
            yield _row("obstacle", shape, recording.world_pose(shape, 0))
    for name, point in recording.targets:
        yield {"element": "target", "name": name, "arm": -1, **dict(zip("xyz", point, strict=True))}
    for arm, way in enumerate(recording.traces):
        for x, y, z in way:
            yield {"element": "way", "name": "tool", "arm": arm, "x": x, "y": y, "z": z}


def _row(element: str, shape: Shape, pose: FloatArray) -> dict[str, Any]:
    corners = surfaces.corners_of(shape.outline)
    size = (*shape.outline.size, 0.0, 0.0, 0.0)[:3]
    text = "" if corners is None else ";".join(" ".join(f"{v:.5g}" for v in c) for c in corners)
    return {
        "element": element,
        "name": shape.name,
        "arm": shape.arm,
        "kind": shape.outline.kind,
        **dict(zip(SIZE, size, strict=True)),
        **dict(zip(POSE, pose, strict=True)),
        "corners": text,
    }


def draw_scenes(table: pd.DataFrame) -> Figure:
    """Draw one panel per motion, and name the elements below."""
    figure = _panels(table, 3.5, lambda panel: table[table["panel"] == panel])
    colour = style.arm_colour(0)
    keys: dict[str, Any] = {
        "start": Patch(color=colour, label="start"),
        "goal": Patch(color=colour, alpha=0.35, label="goal"),
        "obstacle": Patch(color=OBSTACLE, alpha=0.4, label="obstacle"),
        "object": Patch(color=OBJECT, label="carried"),
        "way": style.key("way of the tool", color=style.NEUTRAL, linewidth=1.0, linestyle=":"),
        "target": style.key("target", color=style.FORBIDDEN, marker="*", linestyle="none"),
    }
    there = set(table["element"])
    style.keys_below(figure, [key for element, key in keys.items() if element in there])
    return figure


def draw_covers(table: pd.DataFrame) -> Figure:
    """Draw the exact bodies of each robot beside their covers, in the same scale."""
    return _panels(table, 3.2, lambda panel: table[table["panel"] // 2 == panel // 2])


def _panels(table: pd.DataFrame, height: float, room: Callable[[int], pd.DataFrame]) -> Figure:
    """Draw panels [inch], two side by side, each as large as the bodies of the rows in its room."""
    panels = list(groups(table, ["panel", "title"]))
    lines, planar = -(-len(panels) // 2), bool(table["planar"].all())
    figure = style.figure(height * lines + 0.3)
    for k, ((panel, title), rows) in enumerate(panels):
        place = lines, min(len(panels), 2), k + 1
        _panel(figure, place, rows, planar, room(panel)).set_title(title, fontsize=8)
    return figure


def draw_joints(table: pd.DataFrame) -> Figure:
    """Draw every joint in a panel of its own, four side by side, with its limits."""
    joints = list(table.groupby("joint", sort=False))
    lines = -(-len(joints) // 4)
    figure = style.figure(1.4 * lines + 0.2)
    for k, (joint, own) in enumerate(joints):
        axes = figure.add_subplot(lines, 4, k + 1)
        axes.plot(own["instant"], own["value"], color=style.arm_colour(0))
        for bound in own[["low", "high"]].iloc[0]:
            if np.isfinite(bound):
                axes.axhline(bound, color=style.FORBIDDEN, linestyle=(0, (3, 2)), linewidth=0.9)
        axes.set_title(str(joint), fontsize=7, fontweight="normal")
        axes.set_ylabel(f"[{own['unit'].iloc[0]}]", fontsize=7)
        axes.tick_params(labelsize=6.5)
        axes.yaxis.set_major_locator(style.few_ticks())
        axes.xaxis.set_major_locator(MaxNLocator(nbins=4, integer=True))
        if k >= len(joints) - 4:
            axes.set_xlabel("instant", fontsize=7)
    return figure


def _surface(row: Any, radius: float, middle: FloatArray) -> FloatArray:
    pose = np.array([getattr(row, name) for name in POSE], dtype=np.float64)
    size = np.array([getattr(row, name) for name in SIZE], dtype=np.float64)
    if row.kind == "half_space":
        square = FLOOR * radius * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
        found = surfaces.placed(square[[[0, 1, 2], [0, 2, 3]]], pose)
        normal = np.cross(found[0, 1] - found[0, 0], found[0, 2] - found[0, 0])
        normal /= np.sqrt((normal**2).sum())
        away = middle - pose[:3]
        return np.asarray(found + away - normal * float(normal @ away))
    if row.kind == "capsule" and size[0] == 0.0:  # a link that is a line
        size[0] = max(LINE * radius, 1e-4 * size[1])
    text = row.corners if isinstance(row.corners, str) else ""
    corners = np.array([c.split() for c in text.split(";")], dtype=np.float64) if text else None
    return surfaces.placed(surfaces.triangles_of(row.kind, size, corners), pose)


def _room(table: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest corner of a picture: of bodies, and of obstacles near them."""
    solid = table[table["kind"].notna() & (table["kind"] != "half_space")]
    points = {name: [np.empty((0, 3))] for name in ("robot", "obstacle")}
    for row in records(solid):
        kind = "obstacle" if row.element == "obstacle" else "robot"
        points[kind].append(_surface(row, 0.0, np.zeros(3)).reshape(-1, 3))
    ways = table[table["element"].isin(["way", "target"])][["x", "y", "z"]].to_numpy(np.float64)
    own = np.vstack([*points["robot"], ways])
    low, high = own.min(axis=0), own.max(axis=0)
    wide = float((high - low).max())
    for body in points["obstacle"][1:]:
        if float(np.ptp(body, axis=0).max()) < 2.5 * wide:
            low, high = np.minimum(low, body.min(axis=0)), np.maximum(high, body.max(axis=0))
    return low, high


def _panel(
    figure: Figure,
    place: tuple[int, int, int],
    rows: pd.DataFrame,
    planar: bool,
    room: pd.DataFrame,
) -> Any:
    """Draw a scene as seen along z, or in space, as large as the bodies of some rows."""
    low, high = _room(room)
    spans, unit = high - low, rows["length_unit"].iloc[0]
    middle, radius = 0.5 * (low + high), float(np.sqrt((spans**2).sum())) / 2.0
    bodies = [
        (row, _surface(row, radius, middle), colour, OPACITY[row.element])
        for row in records(rows[rows["kind"].notna()])
        for colour in (STANDING.get(row.element) or style.arm_colour(int(row.arm)),)
    ]
    axes: Any
    if planar:
        axes, wide = figure.add_subplot(*place), 0.05 * float(spans[:2].max())
        style.operational_axes(axes, unit)
        axes.set_xlim(low[0] - wide, high[0] + wide)
        axes.set_ylim(low[1] - wide, high[1] + wide)
        for row, triangles, colour, alpha in bodies:
            if row.kind == "half_space" and abs(row.qx) + abs(row.qy) < 1e-6:
                continue  # a floor seen from above
            seen = surfaces.outline_from_above(triangles)
            axes.fill(*seen.T, facecolor=colour, edgecolor=colour, alpha=alpha, linewidth=0.8)
    else:  # all surfaces in one collection, which sorts them by depth
        pad = np.maximum(0.5 * (0.3 * spans.max() - spans), 0.0) + 0.03 * spans.max()
        view: dict[str, Any] = {"view": VIEW, "zoom": 1.05, "label_pads": (-7, -7, -7)}
        axes = surfaces.space(figure, place, low, high, pad, unit, ticks=(3, 3), **view)
        colours = np.concatenate([surfaces.shaded(*body[1:]) for body in bodies])
        triangles = np.concatenate([body[1] for body in bodies])
        surface = Poly3DCollection(triangles, facecolors=colours, linewidth=0)
        surface.set_rasterized(True)  # tens of thousands of triangles
        axes.add_collection3d(surface)
    # ways of tools, and targets
    columns = ["x", "y"] if planar else ["x", "y", "z"]
    for arm, way in groups(rows[rows["element"] == "way"], "arm"):
        look: dict[str, Any] = {"color": style.arm_colour(int(arm)), "linewidth": 1.0}
        axes.plot(*(way[name] for name in columns), linestyle=":", zorder=9, **look)
    targets = rows[rows["element"] == "target"]
    if len(targets):
        stars: dict[str, Any] = {"color": style.FORBIDDEN, "markersize": 7, "zorder": 10}
        axes.plot(*(targets[name] for name in columns), "*", linestyle="none", **stars)
    return axes
