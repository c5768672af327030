"""Pictures of any motion: the scene with start and goal, joints, and bodies beside covers.

Every table of bodies has one row per body and place; the functions that draw need nothing else.
"""

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from evoexp.numeric.convex_hull import hull_of
from evoexp.playback.colours import OBJECT, OBSTACLE
from evoexp.playback.recording import Outline, Recording, Shape
from evoexp.records import FloatArray
from evoexp.report.figures import Parts, Rows, groups, records, rounded, style, table_of

VIEW = (22.0, -58.0)  # [deg] elevation and azimuth
OPACITY = {"start": 1.0, "goal": 0.35, "body": 1.0, "cover": 0.5, "obstacle": 0.3, "object": 0.9}
STANDING = {"obstacle": OBSTACLE, "object": OBJECT}  # colours of bodies that are no robot's
ALIKE = (
    1.25  # [-] room of all panels together over that of the widest one, up to which they share it
)
LINE = 0.012  # [-] of the picture's radius: half the width of links without thickness
FLOOR = 1.1  # [-] of the picture's radius: half the edge of the part of a half-space that is drawn
NO_LIMIT = 1e6  # [rad, length unit] from here on a joint has no limit
POSE = ["x", "y", "z", "qx", "qy", "qz", "qw"]
SIZE = ["size_1", "size_2", "size_3"]
COLUMNS = ["panel", "title", "element", "name", "arm", "kind", *SIZE, *POSE, "corners"]


@table_of()
def scenes_table(shown: Sequence[tuple[str, Recording]]) -> Parts:
    """Return bodies at start and goal, obstacles and ways of tools, a panel per (title, motion)."""
    for panel, (title, recording) in enumerate(shown):
        rows = [
            *_bodies(recording, 0, "start"),
            *_bodies(recording, -1, "goal"),
            *_still(recording),
        ]
        yield _part(rows, panel, title, recording)


@table_of()
def covers_table(shown: Sequence[tuple[str, Recording, Sequence[Any]]]) -> Parts:
    """Return the exact bodies of robots at their start, and the covers that the search tests.

    Those are rows (Pinocchio's joint, start, end, radius).
    """
    for k, (title, recording, covers) in enumerate(shown):
        bodies = [row for row in _bodies(recording, 0, "body") if row["element"] == "body"]
        frames = recording.poses.world[0]
        own = []
        for joint, start, end, radius in covers:  # spheres, or capsules between two points
            place = pin.XYZQUATToSE3(frames[joint - 1]) if joint > 0 else pin.SE3.Identity()
            pose, length = capsule(start, end)
            drawn = Outline("sphere", (float(radius),))
            if length:
                drawn = Outline("capsule", (float(radius), length))
            here = np.asarray(pin.SE3ToXYZQUAT(place * pose))
            own.append(_row("cover", Shape("", joint - 1, here, drawn, "arm", 1), here))
        names = f"{title}: {len(bodies)} exact bodies", f"{len(own)} covers that the search tests"
        yield _part(bodies, 2 * k, names[0], recording)
        yield _part(own, 2 * k + 1, names[1], recording)


@table_of("instant value joint unit low high", is_rounded=True)
def joints_table(recording: Recording) -> Rows:
    """Return all joints over a motion, with the robot's limits, infinite where there is none."""
    model = recording.parts[0].scene.model
    limits = np.array([model.lowerPositionLimit, model.upperPositionLimit], dtype=np.float64).T
    limits = np.where(np.abs(limits) < NO_LIMIT, limits, np.copysign(np.inf, limits))
    for k, joint in enumerate(recording.joints):
        scale = 1.0 if joint.prismatic else 180.0 / np.pi
        low, high = scale * limits[k]
        unit = recording.length_unit if joint.prismatic else "deg"
        yield recording.times, scale * recording.q[:, k], joint.name, unit, low, high


def _part(
    rows: Iterable[dict[str, Any]], panel: int, title: str, own: Recording
) -> Mapping[str, Any]:
    table = pd.DataFrame(list(rows)).assign(panel=panel, title=title)
    table = rounded(table.reindex(columns=COLUMNS))
    return dict(table.assign(planar=own.view.planar, length_unit=own.length_unit))


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
    corners = corners_of(shape.outline)
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
    """Draw one panel per motion, those of about one size in one scale; name the elements below."""
    own = dict(groups(table, "panel"))
    low, high = _room(table)
    widest = max(np.ptp(_room(rows), axis=0).max() for rows in own.values())
    is_shared = table["length_unit"].nunique() == 1 and (high - low).max() <= ALIKE * widest
    figure = _panels(table, 3.5, lambda panel: table if is_shared else own[panel])
    colour = style.arm_colour(0)
    keys: dict[str, Any] = {
        "start": Patch(color=colour, label="start"),
        "goal": Patch(color=colour, alpha=0.35, label="goal"),
        "obstacle": Patch(color=OBSTACLE, alpha=0.4, label="obstacle"),
        "object": Patch(color=OBJECT, label="carried"),
        "way": style.key("path of the tool", color=style.NEUTRAL, linewidth=1.0, linestyle=":"),
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
    figure, panels = style.panels(1.4, len(joints), 4, 0.2)
    for axes, (joint, own) in zip(panels, joints, strict=True):
        axes.plot(own["instant"], own["value"], color=style.arm_colour(0))
        for bound in own[["low", "high"]].iloc[0]:
            if np.isfinite(bound):
                axes.axhline(bound, color=style.FORBIDDEN, linestyle=(0, (3, 2)), linewidth=0.9)
        axes.set_title(str(joint), fontsize=7, fontweight="normal")
        axes.set_ylabel(f"[{own['unit'].iloc[0]}]", fontsize=7)
        axes.tick_params(labelsize=6.5)
        axes.yaxis.set_major_locator(style.few_ticks())
        axes.xaxis.set_major_locator(MaxNLocator(nbins=4, integer=True))
        if style.ends_column(axes, panels):
            axes.set_xlabel("instant", fontsize=7)
    return figure


def _surface(row: Any, radius: float, middle: FloatArray) -> FloatArray:
    pose = np.array([getattr(row, name) for name in POSE], dtype=np.float64)
    size = np.array([getattr(row, name) for name in SIZE], dtype=np.float64)
    if row.kind == "half_space":
        square = FLOOR * radius * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
        found = placed(square[[[0, 1, 2], [0, 2, 3]]], pose)
        normal = np.cross(found[0, 1] - found[0, 0], found[0, 2] - found[0, 0])
        normal /= np.sqrt((normal**2).sum())
        away = middle - pose[:3]
        return np.asarray(found + away - normal * float(normal @ away))
    if row.kind == "capsule" and size[0] == 0.0:  # a link that is a line
        size[0] = max(LINE * radius, 1e-4 * size[1])
    text = row.corners if isinstance(row.corners, str) else ""
    corners = np.array([c.split() for c in text.split(";")], dtype=np.float64) if text else None
    return placed(triangles_of(row.kind, size, corners), pose)


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
            seen = outline_from_above(triangles)
            axes.fill(*seen.T, facecolor=colour, edgecolor=colour, alpha=alpha, linewidth=0.8)
    else:  # all surfaces in one collection, which sorts them by depth
        pad = np.maximum(0.5 * (0.3 * spans.max() - spans), 0.0) + 0.03 * spans.max()
        view: dict[str, Any] = {"view": VIEW, "zoom": 0.88, "ticks": (3, 3)}
        axes = space(figure, place, low, high, pad, unit, **view)
        colours = np.concatenate([shaded(*body[1:]) for body in bodies])
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


AROUND, ALONG = 14, 4  # pieces of a round surface around its axis, and of each of its ends
MOST_CORNERS = 150  # of a mesh, which is drawn by the hull of the corners farthest out
LIGHT = np.array([-0.35, -0.55, 0.76])  # direction to the light, length 1
LABEL_PAD = -7.0  # [pt] from the numbers along an axis in space to its name
COLUMN_PAD = -3.5  # [pt] the same for z in a figure for a column
COLUMN_ZOOM = 0.85  # [-] in a figure for a column, where numbers are large beside their panel
NARROW = 0.6  # [-] of the longest side of a box, below which a side has few ticks
PALE = (0.97, 0.97, 0.97, 1.0)  # behind shaded bodies
DARKEST = 0.45  # [-] of a colour's brightness, where a surface is turned from the light


def corners_of(outline: Outline) -> FloatArray | None:
    """Return the corners (corners, 3) by which a mesh is drawn; None for another body.

    Of a mesh of more than `MOST_CORNERS` those are taken that lie farthest out in as many
    directions, evenly spread.
    """
    if outline.points is None:
        return None
    points = np.unique(outline.points, axis=0)
    if len(points) <= MOST_CORNERS:
        return points
    k = np.arange(MOST_CORNERS) + 0.5
    height, turn = 1.0 - 2.0 * k / MOST_CORNERS, np.pi * (1.0 + np.sqrt(5.0)) * k
    wide = np.sqrt(1.0 - height**2)
    directions = np.column_stack([wide * np.cos(turn), wide * np.sin(turn), height])
    return np.asarray(points[np.unique((points @ directions.T).argmax(axis=0))])


def triangles_of(kind: str, size: FloatArray, corners: FloatArray | None) -> FloatArray:
    """Return the triangles of a body of some size (3,) in its own frame, (triangles, 3, 3)."""
    if kind == "mesh" and corners is not None:
        return _hull(corners)
    if kind == "box":
        return _hull(0.5 * size * np.array(list(itertools.product((-1.0, 1.0), repeat=3))))
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    rise = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2 * ALONG + 1)[:, None]
    around = np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise) + 0.0 * turn
    ball = np.stack(around, axis=-1).reshape(-1, 3)
    if kind in ("sphere", "ellipsoid"):
        return _hull(ball * (size if kind == "ellipsoid" else size[0]))
    up = np.array([0.0, 0.0, 0.5 * float(size[1])])
    if kind == "capsule":
        return _hull(np.vstack([size[0] * ball - up, size[0] * ball + up]))
    circle = size[0] * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(AROUND)])
    return _hull(np.vstack([circle - up, circle * (kind == "cylinder") + up]))


def capsule(start: FloatArray, end: FloatArray) -> tuple[pin.SE3, float]:
    """Return pose and length of a capsule between two points (3,); of a sphere it is 0."""
    along = np.asarray(end) - np.asarray(start)
    length = float(np.sqrt((along**2).sum()))
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along) if length else None
    middle = 0.5 * (np.asarray(start) + end)
    return pin.SE3(np.eye(3) if turn is None else turn.matrix(), middle), length


def placed(triangles: FloatArray, pose: FloatArray) -> FloatArray:
    """Return triangles moved by a pose: position, quaternion x, y, z, w, (7,)."""
    turned = Rotation.from_quat(pose[3:]).apply(triangles.reshape(-1, 3))
    return np.asarray(turned + pose[:3]).reshape(triangles.shape)


def shaded(triangles: FloatArray, colour: Any, alpha: float) -> FloatArray:
    """Return the colours of triangles as the light falls on them, (triangles, 4)."""
    a, b, c = triangles.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    lengths = np.sqrt((normals**2).sum(axis=1))
    facing = (normals @ LIGHT) / np.where(lengths > 0.0, lengths, 1.0)
    brightness = DARKEST + (1.0 - DARKEST) * 0.5 * (1.0 + facing)
    rgb = np.array(to_rgb(colour))[None] * brightness[:, None]
    return np.column_stack([np.clip(rgb, 0.0, 1.0), np.full(len(rgb), alpha)])


def outline_from_above(triangles: FloatArray) -> FloatArray:
    """Return the closed outline (points, 2) of a convex body as seen along z."""
    points = triangles.reshape(-1, 3)[:, :2]
    try:
        around = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):  # it is seen as a line
        spread = np.ptp(points, axis=0)
        order = np.argsort(points[:, int(np.argmax(spread))], kind="stable")
        around = points[order[[0, -1]]]
    return np.vstack([around, around[:1]])


def _hull(points: FloatArray) -> FloatArray:
    """Return the hull's triangles, each counter-clockwise as seen from outside; none if flat."""
    hull = hull_of(points)
    if hull is None:
        return np.empty((0, 3, 3))
    corners, triangles = hull
    return np.asarray(corners[triangles])


def space(
    figure: Figure,
    place: tuple[Any, ...],
    low: FloatArray,
    high: FloatArray,
    pad: FloatArray,
    unit: str,
    *,
    view: tuple[float, float],
    zoom: float,
    ticks: tuple[int, int],
) -> Any:
    """Return axes in space with equal scales that hold a box (3,) and room beyond it (3,).

    The view is elevation and azimuth [deg]; ticks are those of a narrow side and of a wide one, at
    most.
    """
    axes: Any = figure.add_subplot(*place, projection="3d")
    sides, in_column = high - low + 2.0 * pad, figure.get_figwidth() < style.WIDTH
    for name, least, greatest in zip("xyz", low - pad, high + pad, strict=True):
        getattr(axes, f"set_{name}lim")(least, greatest)
        away = COLUMN_PAD if in_column and name == "z" else LABEL_PAD
        getattr(axes, f"set_{name}label")(f"{name} [{unit}]", labelpad=away, fontsize=7)
    axes.set_box_aspect(sides, zoom=COLUMN_ZOOM * zoom if in_column else zoom)
    axes.patch.set_visible(False)  # else it hides the labels of the panel beside it
    axes.tick_params(labelsize=6, pad=-2)
    have_few = in_column | (sides < NARROW * sides.max())
    for axis, has_few in zip((axes.xaxis, axes.yaxis, axes.zaxis), have_few, strict=True):
        axis.set_major_locator(MaxNLocator(nbins=ticks[0] if has_few else ticks[1]))
        axis.set_pane_color(PALE)
    axes.view_init(elev=view[0], azim=view[1])
    return axes
