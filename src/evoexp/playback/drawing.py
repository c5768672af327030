"""Bodies as Foxglove's scene primitives, of exactly the sizes of coal's shapes."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pinocchio as pin
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity

from evoexp.playback.colours import OBJECT, OBSTACLE, arm_colour
from evoexp.playback.recording import Recording
from evoexp.playback.shapes import Outline, Shape
from evoexp.records import FloatArray

WORLD = "world"
LINE_WIDTH, WAY_WIDTH = 5.0, 2.0  # [px] of links that have no thickness, and of the tools' ways
TARGET = "#882255"
SLAB = 0.01  # [-] of the view's radius: thickness of half-spaces, which have no end
FAR = 6.0  # [-] of the view's radius: their edges
OPACITY = {"arm": 1.0, "object": 0.9, "obstacle": 0.45, "start": 0.2, "end": 0.35}

Fields = dict[str, Any]
"""Fields of a protobuf message, by their names."""


def bodies(recording: Recording, roles: Iterable[str]) -> list[Any]:
    """Return one entity per body of some roles, in the frame that moves it."""
    names, radius = frame_names(recording), recording.view.radius
    return [
        _body(shape, names[shape.frame], OPACITY[shape.role], radius)
        for shape in recording.shapes
        if shape.role in roles
    ]


def ghosts(recording: Recording) -> list[Any]:
    """Return translucent copies of all moving bodies at the start and at the end."""
    entities = []
    for when, tick in (("start", 0), ("end", -1)):
        for shape in recording.shapes:
            if shape.frame >= 0:
                pose = recording.world_pose(shape, tick)
                ghost = shape._replace(name=f"{when} of {shape.name}", pose=pose)
                entities.append(_body(ghost, WORLD, OPACITY[when], recording.view.radius))
    return entities


def marks(recording: Recording) -> list[Any]:
    """Return the paths of the tools, and the targets of the task."""
    entities = []
    for arm, way in enumerate(recording.traces):
        line = _line(way, WAY_WIDTH, _colour(arm_colour(arm), 1.0))
        entities.append(_entity(f"way of arm {arm + 1}", WORLD, lines=[line]))
    colour, across = _colour(TARGET, 1.0), 0.02 * recording.view.radius
    for target in recording.targets:
        place = pin.SE3(np.eye(3), target.point)
        text: Fields = {"pose": _pose(place), "color": colour, "text": f" {target.name}"}
        text |= {"billboard": True, "font_size": 14.0, "scale_invariant": True}
        ball = _solid(place, (across,) * 3, colour)
        entities.append(_entity(f"target {target.name}", WORLD, spheres=[ball], texts=[text]))
    return entities


def frame_names(recording: Recording) -> list[str]:
    """Return the names of all frames; the world comes last, so index −1 is the world."""
    return [*(frame.name for frame in recording.frames), WORLD]


def _body(shape: Shape, frame: str, opacity: float, radius: float) -> Any:
    """Return a body in a frame as one entity, in a view of a radius."""
    colours = {"arm": arm_colour(shape.arm), "object": OBJECT, "obstacle": OBSTACLE}
    colour, place = _colour(colours[shape.role], opacity), pin.XYZQUATToSE3(shape.pose)
    return _entity(shape.name, frame, **_primitives(shape.outline, place, colour, radius))


def _entity(name: str, frame: str, **primitives: Any) -> Any:
    return SceneEntity(frame_id=frame, id=name, frame_locked=True, **primitives)


def _primitives(
    outline: Outline, place: Any, colour: Fields, radius: float
) -> dict[str, list[Fields]]:
    kind, size = outline.kind, outline.size
    if outline.is_line:
        ends = [place * np.array([0.0, 0.0, z]) for z in (-0.5 * size[1], 0.5 * size[1])]
        return {"lines": [_line(ends, LINE_WIDTH, colour)]}
    if kind == "box":
        return {"cubes": [_solid(place, size, colour)]}
    if kind in ("sphere", "ellipsoid"):
        axes = size * 3 if kind == "sphere" else size
        return {"spheres": [_solid(place, [2.0 * axis for axis in axes], colour)]}
    if kind == "half_space":
        depth, edge = SLAB * radius, FAR * radius
        return {"cubes": [_solid(_along_z(place, -0.5 * depth), (edge, edge, depth), colour)]}
    if outline.points is not None and outline.triangles is not None:
        points, indices = map(_vector, outline.points), outline.triangles.ravel().tolist()
        mesh = {"pose": _pose(place), "points": [*points], "color": colour, "indices": indices}
        return {"triangles": [mesh]}
    across, length = 2.0 * size[0], size[1]
    cylinder = _solid(place, (across, across, length), colour)
    cylinder |= {"bottom_scale": 1.0, "top_scale": 0.0 if kind == "cone" else 1.0}
    if kind != "capsule":
        return {"cylinders": [cylinder]}
    ends = [_along_z(place, z) for z in (-0.5 * length, 0.5 * length)]
    balls = [_solid(end, (across,) * 3, colour) for end in ends]
    return {"cylinders": [cylinder], "spheres": balls}


def _line(points: Iterable[FloatArray], width: float, colour: Fields) -> Fields:
    """Return a strip of lines of a width [px]."""
    return {
        "type": "LINE_STRIP",
        "pose": _pose(pin.SE3.Identity()),
        "thickness": width,
        "scale_invariant": True,
        "points": [_vector(point) for point in points],
        "color": colour,
    }


def _solid(place: Any, size: Iterable[float], colour: Fields) -> Fields:
    return {"pose": _pose(place), "size": _vector(size), "color": colour}


def _along_z(place: Any, z: float) -> Any:
    return place * pin.SE3(np.eye(3), np.array([0.0, 0.0, z]))


def _pose(place: Any) -> Fields:
    row = pin.SE3ToXYZQUAT(place).tolist()
    return {"position": _vector(row[:3]), "orientation": dict(zip("xyzw", row[3:], strict=True))}


def _vector(values: Iterable[float]) -> dict[str, float]:
    return dict(zip("xyz", map(float, values), strict=True))


def _colour(colour: str, opacity: float) -> Fields:
    parts = (value / 255.0 for value in bytes.fromhex(colour[1:]))
    return dict(zip("rgba", (*parts, opacity), strict=True))
