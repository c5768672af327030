"""Tables of any motion: bodies at some instants, ways of tools, joints, covers beside bodies.

Every table of bodies has one row per body and place, from which `motion_scenes` draws it.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin

from evoexp.playback.recording import Recording
from evoexp.playback.shapes import Outline, Shape
from evoexp.records import FloatArray
from evoexp.report.figures import rounded, surfaces

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
            *_ways(recording),
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
            own.append(_row("cover", "", 1, drawn, np.asarray(pin.SE3ToXYZQUAT(place * pose))))
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
        if shape.role == "obstacle" or (shape.frame < 0 and element == "goal"):
            continue
        pose = _pose(recording, shape, tick)
        name = "object" if shape.role == "object" else element
        if not (shape.role == "object" and element == "goal"):
            yield _row(name, shape.name, shape.arm, shape.outline, pose)


def _still(recording: Recording) -> Iterable[dict[str, Any]]:
    """Yield the rows of obstacles and targets."""
    for shape in recording.shapes:
        if shape.role == "obstacle":
            yield _row("obstacle", shape.name, -1, shape.outline, _pose(recording, shape, 0))
    for target in recording.targets:
        yield {
            "element": "target",
            "name": target.name,
            "arm": -1,
            **dict(zip("xyz", target.point, strict=True)),
        }


def _ways(recording: Recording) -> Iterable[dict[str, Any]]:
    for arm, way in enumerate(recording.traces):
        for x, y, z in way:
            yield {"element": "way", "name": "tool", "arm": arm, "x": x, "y": y, "z": z}


def _row(element: str, name: str, arm: int, drawn: Outline, pose: FloatArray) -> dict[str, Any]:
    corners = surfaces.corners_of(drawn)
    size = (*drawn.size, 0.0, 0.0, 0.0)[:3]
    text = "" if corners is None else ";".join(" ".join(f"{v:.5g}" for v in c) for c in corners)
    return {
        "element": element,
        "name": name,
        "arm": arm,
        "kind": drawn.kind,
        **dict(zip(SIZE, size, strict=True)),
        **dict(zip(POSE, pose, strict=True)),
        "corners": text,
    }


def _pose(recording: Recording, shape: Shape, tick: int) -> FloatArray:
    """Return the pose of a body in the world at a tick, (7,)."""
    if shape.frame < 0:
        return shape.pose
    frame = pin.XYZQUATToSE3(recording.poses.world[tick, shape.frame])
    return np.asarray(pin.SE3ToXYZQUAT(frame * pin.XYZQUATToSE3(shape.pose)))
