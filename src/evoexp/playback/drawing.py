"""Bodies as Foxglove's scene primitives, of exactly the sizes of coal's shapes."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pinocchio as pin
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from evoexp.playback.colours import OBJECT, OBSTACLE, arm_colour, rgb
from evoexp.playback.recording import Recording
from evoexp.playback.shapes import Outline, Shape
from evoexp.records import FloatArray

WORLD = "world"
LINE_WIDTH, WAY_WIDTH = 5.0, 2.0  # [px] of links that have no thickness, and of the tools' ways
SLAB = 0.01  # [-] of the view's radius: thickness of half-spaces, which have no end
FAR = 6.0  # [-] of the view's radius: their edges
OPACITY = {"arm": 1.0, "object": 0.9, "obstacle": 0.45, "start": 0.2, "end": 0.35}


def bodies(recording: Recording, roles: Iterable[str]) -> list[Any]:
    """Return one entity per body, in the frame that moves it."""
    chosen, names = set(roles), frame_names(recording)
    return [
        entity(
            shape,
            names[shape.frame],
            shape.pose,
            OPACITY[shape.role],
            recording.view.radius,
            shape.name,
        )
        for shape in recording.shapes
        if shape.role in chosen
    ]


def ghosts(recording: Recording) -> list[Any]:
    """Return translucent copies of all moving bodies at the start and at the end."""
    found = []
    for when, tick in (("start", 0), ("end", -1)):
        for shape in (shape for shape in recording.shapes if shape.frame >= 0):
            frame = pin.XYZQUATToSE3(recording.poses.world[tick, shape.frame])
            pose = pin.SE3ToXYZQUAT(frame * pin.XYZQUATToSE3(shape.pose))
            name = f"{when} of {shape.name}"
            found.append(entity(shape, WORLD, pose, OPACITY[when], recording.view.radius, name))
    return found


def marks(recording: Recording) -> list[Any]:
    """Return the paths of the tools, and the targets of the task."""
    found = []
    for arm, way in enumerate(recording.traces):
        line = LinePrimitive(
            type=LinePrimitive.LINE_STRIP,
            pose=_pose(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])),
            thickness=WAY_WIDTH,
            scale_invariant=True,
            points=[_point(point) for point in way],
            color=_colour(arm_colour(arm), 1.0),
        )
        found.append(
            SceneEntity(frame_id=WORLD, id=f"way of arm {arm + 1}", frame_locked=True, lines=[line])
        )
    size = 0.02 * recording.view.radius
    for target in recording.targets:
        pose = _pose(np.array([*target.point, 0.0, 0.0, 0.0, 1.0]))
        ball = SpherePrimitive(
            pose=pose, size=_vector(np.full(3, size)), color=_colour("#882255", 1.0)
        )
        text = TextPrimitive(
            pose=pose,
            billboard=True,
            font_size=14.0,
            scale_invariant=True,
            color=_colour("#882255", 1.0),
            text=f" {target.name}",
        )
        name = f"target {target.name}"
        found.append(
            SceneEntity(frame_id=WORLD, id=name, frame_locked=True, spheres=[ball], texts=[text])
        )
    return found


def frame_names(recording: Recording) -> list[str]:
    """Return the names of all frames; the world comes last, so index −1 is the world."""
    return [*(frame.name for frame in recording.frames), WORLD]


def entity(
    shape: Shape, frame: str, pose: FloatArray, opacity: float, radius: float, name: str
) -> Any:
    """Return a body as one entity.

    Args:
        frame: Name of the frame that moves it.
        pose: (7,) in that frame.
        opacity: From 0 to 1.
        radius: Radius of the view, for half-spaces [length unit].
        name: Name of the entity.
    """
    own = (
        arm_colour(shape.arm)
        if shape.role == "arm"
        else OBJECT
        if shape.role == "object"
        else OBSTACLE
    )
    primitives = _primitives(shape.outline, pin.XYZQUATToSE3(pose), _colour(own, opacity), radius)
    return SceneEntity(frame_id=frame, id=name, frame_locked=True, **primitives)


def _primitives(outline: Outline, place: Any, colour: Any, radius: float) -> dict[str, list[Any]]:
    kind, size = outline.kind, outline.size
    if outline.is_line:
        ends = [place * np.array([0.0, 0.0, z]) for z in (-0.5 * size[1], 0.5 * size[1])]
        line = LinePrimitive(
            type=LinePrimitive.LINE_STRIP,
            pose=_pose(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])),
            thickness=LINE_WIDTH,
            scale_invariant=True,
            points=[_point(end) for end in ends],
            color=colour,
        )
        return {"lines": [line]}
    if kind == "box":
        return {"cubes": [_solid(CubePrimitive, place, size, colour)]}
    if kind in ("sphere", "ellipsoid"):
        axes = size * 3 if kind == "sphere" else size
        return {
            "spheres": [_solid(SpherePrimitive, place, tuple(2.0 * axis for axis in axes), colour)]
        }
    if kind == "half_space":
        depth, edge = SLAB * radius, FAR * radius
        below = place * pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.5 * depth]))
        return {"cubes": [_solid(CubePrimitive, below, (edge, edge, depth), colour)]}
    if kind == "mesh":
        assert outline.points is not None
        assert outline.triangles is not None
        points = [_point(point) for point in outline.points]
        indices = outline.triangles.ravel().tolist()
        return {
            "triangles": [
                TriangleListPrimitive(
                    pose=_placed(place), points=points, color=colour, indices=indices
                )
            ]
        }
    across, length = 2.0 * size[0], size[1]
    scale = {"bottom_scale": 1.0, "top_scale": 0.0 if kind == "cone" else 1.0}
    found: dict[str, list[Any]] = {
        "cylinders": [_solid(CylinderPrimitive, place, (across, across, length), colour, **scale)]
    }
    if kind == "capsule":
        ends = [
            place * pin.SE3(np.eye(3), np.array([0.0, 0.0, z]))
            for z in (-0.5 * length, 0.5 * length)
        ]
        found["spheres"] = [_solid(SpherePrimitive, end, (across,) * 3, colour) for end in ends]
    return found


def _solid(kind: Any, place: Any, size: tuple[float, ...], colour: Any, **more: float) -> Any:
    return kind(pose=_placed(place), size=_vector(np.array(size)), color=colour, **more)


def _placed(place: Any) -> Any:
    return _pose(np.asarray(pin.SE3ToXYZQUAT(place)))


def _pose(row: FloatArray) -> Any:
    x, y, z, w = map(float, row[3:])
    return Pose(position=_vector(row[:3]), orientation=Quaternion(x=x, y=y, z=z, w=w))


def _vector(values: FloatArray) -> Any:
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def _point(values: FloatArray) -> Any:
    x, y, z = map(float, values)
    return Point3(x=x, y=y, z=z)


def _colour(colour: str, opacity: float) -> Any:
    red, green, blue = rgb(colour)
    return Color(r=red, g=green, b=blue, a=opacity)
