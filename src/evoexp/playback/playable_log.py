"""A motion as an MCAP that plays in Foxglove's own schemas, without URDF, layout or ROS.

The clock is that of the trajectory: 0 at the start, as fast as the joints' speed limits permit. The
progress of the search is counted in generations instead; it stands in one message at the start,
whose arrays Foxglove's Plot panel draws. Bodies are scene primitives of exactly the sizes of coal's
shapes.
"""

import io
import json
from collections import Counter
from collections.abc import Iterable
from importlib import resources
from typing import Any

import numpy as np
import pinocchio as pin
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from evoexp.playback.colours import OBJECT, OBSTACLE, arm_colour
from evoexp.playback.recording import Outline, Recording, Shape
from evoexp.records import FloatArray

LIBRARY = "evoexp"
MOTION = "evoexp.motion"  # name of the metadata record
LAYOUT = "foxglove_layout.json"
SECOND = 1_000_000_000  # [ns]
CHUNK_SIZE = 56 * 1024  # [B]
WORLD = "world"
LINE_WIDTH, WAY_WIDTH = 5.0, 2.0  # [px] of links that have no thickness, and of the tools' ways
TARGET = "#882255"
SLAB = 0.01  # [-] of the view's radius: thickness of half-spaces, which have no end
FAR = 6.0  # [-] of the view's radius: their edges
OPACITY = {"arm": 1.0, "object": 0.9, "obstacle": 0.45, "start": 0.2, "end": 0.35}
Fields = dict[str, Any]
"""Fields of a protobuf message, by their names."""
NUMBER, TEXT = {"type": "number"}, {"type": "string"}
CLEARANCE = dict.fromkeys(("instant", "clearance", "required", "contact"), NUMBER) | {"pair": TEXT}
IMPROVEMENTS = {key: {"type": "array", "items": NUMBER} for key in ("generation", "best_cost")}
SCHEMAS: dict[str, dict[str, Any]] = {  # topic → schema of our own
    "/clearance": {"title": "evoexp.Clearance", "type": "object", "properties": CLEARANCE},
    "/improvements": {"title": "evoexp.Improvements", "type": "object", "properties": IMPROVEMENTS},
}
ANSWERS = {
    True: "certified: no two bodies ever touch",
    False: "refuted: bodies touch",
    None: "undecided",
}


def playable_log(recording: Recording) -> bytes:
    """Return a motion as an MCAP; the same motion gives the same bytes."""
    out = _Playable()
    clearance = recording.clearance
    metadata = {
        "condition": recording.condition_id,
        "replicate": str(recording.heading.replicate),
        "title": recording.heading.title,
        "length_unit": recording.length_unit,
        "seconds_per_instant": repr(recording.seconds),
        "fixed_frame": WORLD,
    }
    out.writer.add_metadata(MOTION, metadata)
    for name, data in (("config.json", recording.config_json), (LAYOUT, layout())):
        out.writer.add_attachment(0, 0, name, "application/json", data)
    entities = {
        "robot": bodies(recording, ("arm", "object")),
        "obstacles": bodies(recording, ("obstacle",)),
        "ghosts": ghosts(recording),
        "ways": marks(recording),
    }
    for topic, drawn in entities.items():  # they stay as they are
        if drawn:
            out.message(f"/scene/{topic}", 0, SceneUpdate(entities=drawn))
    rows = [row for row in recording.heading.improvements if np.isfinite(row[1])]
    if rows:
        columns = dict(zip(("generation", "best_cost"), zip(*rows, strict=True), strict=True))
        out.message("/improvements", 0, columns)
    for moment, message in _log_messages(recording):
        out.message("/log", moment, message)
    for k, instant in enumerate(recording.times.tolist()):
        now = nanoseconds(recording, instant)
        out.message("/tf", now, _transforms(recording, k, now))
        rates = recording.q[k].tolist(), recording.dq[k].tolist()
        states: list[Any] = [
            {"name": joint.name, "position": q, "velocity": dq}
            for joint, q, dq in zip(recording.joints, *rates, strict=True)
        ]
        out.message("/joint_states", now, JointStates(timestamp=_stamp(now), joints=states))
        least = float(clearance.least[k])
        touching = any(contact.begin <= instant <= contact.end for contact in clearance.contacts)
        values = {
            "instant": instant,
            "required": recording.margin,
            "contact": float(touching),
            "pair": clearance.pairs[k],
        }
        values |= {"clearance": least} if np.isfinite(least) else {}
        out.message("/clearance", now, values)
    out.writer.finish()
    return out.buffer.getvalue()


def layout() -> bytes:
    """Return the layout file with which Foxglove shows these logs."""
    return (resources.files("evoexp") / "assets" / LAYOUT).read_bytes()


def nanoseconds(recording: Recording, instant: float) -> int:
    """Return the time of an instant on the clock of the log [ns]."""
    return round(float(instant) * recording.seconds * SECOND)


class _Playable:
    """Writes an MCAP in memory; a channel is registered with its first message."""

    def __init__(self) -> None:
        self.buffer = io.BytesIO()
        self.writer = Writer(self.buffer, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
        self.writer.start(profile="", library=LIBRARY)
        self._schemas: dict[Any, int] = {}
        self._channels: dict[str, int] = {}
        self._counts = Counter[int]()  # messages of each channel

    def message(self, topic: str, moment: int, message: Any) -> None:
        """Append a message of a protobuf schema, or values of our own schema for the topic."""
        kind, own = type(message), SCHEMAS.get(topic)
        if topic not in self._channels:
            if own:
                schema = json.dumps(own, separators=(",", ":")).encode()
                number = self.writer.register_schema(own["title"], "jsonschema", schema)
            else:
                number = self._schemas.get(kind) or register_schema(self.writer, kind)
                self._schemas[kind] = number
            form = "json" if own else "protobuf"
            self._channels[topic] = self.writer.register_channel(topic, form, number)
        if own:
            data = json.dumps(message, allow_nan=False).encode()
        else:
            data = message.SerializeToString(deterministic=True)
        channel = self._channels[topic]
        self.writer.add_message(channel, moment, data, moment, self._counts[channel])
        self._counts[channel] += 1


def _stamp(now: int) -> dict[str, int]:
    return {"seconds": now // SECOND, "nanos": now % SECOND}


def _transforms(recording: Recording, k: int, now: int) -> Any:
    """Return the pose of every frame in the frame of its parent, one transform per link."""
    names, rows = frame_names(recording), recording.poses.local[k].tolist()
    transforms: list[Any] = [
        {
            "timestamp": _stamp(now),
            "parent_frame_id": names[frame.parent],
            "child_frame_id": frame.name,
            "translation": dict(zip("xyz", row[:3], strict=True)),
            "rotation": dict(zip("xyzw", row[3:], strict=True)),
        }
        for frame, row in zip(recording.frames, rows, strict=True)
    ]
    return FrameTransforms(transforms=transforms)


def _log_messages(recording: Recording) -> list[tuple[int, Any]]:
    verdict, unit = recording.verdict, recording.length_unit
    rows = [(0.0, Log.INFO, f"{recording.heading.title}: {ANSWERS[verdict.certified]}")]
    if verdict.certified is not False and verdict.clearance_at is not None:
        is_kept = verdict.certified_margin is not False
        text = f"least clearance {verdict.clearance:.6g} {unit}: {verdict.clearance_pair}"
        text += "" if is_kept else f", less than the required {recording.margin:g} {unit}"
        rows.append((verdict.clearance_at, Log.INFO if is_kept else Log.WARNING, text))
    if verdict.allowed_contacts:
        depth = f"deepest overlap {verdict.penetration or 0.0:.6g} {unit}"
        rows.append((0.0, Log.INFO, f"may touch: {verdict.allowed_contacts}; {depth}"))
    for begin, end, pair in recording.clearance.contacts:
        rows.append((begin, Log.ERROR, f"refuted at instant {begin:.9g}: {pair} touch"))
        rows.append((end, Log.INFO, f"free again at instant {end:.6g}"))
    return [
        (now, Log(timestamp=_stamp(now), level=level, message=text, name="certifier"))
        for instant, level, text in sorted(rows, key=lambda row: row[0])
        for now in [nanoseconds(recording, instant)]
    ]


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
