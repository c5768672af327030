"""A motion as an MCAP that plays in Foxglove's own schemas, without URDF, layout or ROS.

The clock is that of the trajectory: 0 at the start, as fast as the joints' speed limits permit. The
progress of the search is counted in generations instead; it stands in one message at the start,
whose arrays Foxglove's Plot panel draws.
"""

import io
import json
from collections import Counter
from importlib import resources
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from evoexp.playback.drawing import WORLD, bodies, frame_names, ghosts, marks
from evoexp.playback.recording import Recording

LIBRARY = "evoexp"
MOTION = "evoexp.motion"  # name of the metadata record
LAYOUT = "foxglove_layout.json"
SECOND = 1_000_000_000  # [ns]
CHUNK_SIZE = 56 * 1024  # [B]
NUMBER, TEXT = {"type": "number"}, {"type": "string"}
NUMBERS = {"type": "array", "items": NUMBER}
CLEARANCE = {
    "title": "evoexp.Clearance",
    "type": "object",
    "properties": dict.fromkeys(("instant", "clearance", "required", "contact"), NUMBER)
    | {"pair": TEXT},
}
ANSWERS = {
    True: "certified: no two bodies ever touch",
    False: "refuted: bodies touch",
    None: "undecided",
}
IMPROVEMENTS = {
    "title": "evoexp.Improvements",
    "type": "object",
    "properties": {"generation": NUMBERS, "best_cost": NUMBERS},
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
        out.json("/improvements", IMPROVEMENTS, 0, columns)
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
        out.json("/clearance", CLEARANCE, now, values)
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
        """Append a message of a protobuf schema."""
        kind = type(message)
        if topic not in self._channels:
            if kind not in self._schemas:
                self._schemas[kind] = register_schema(self.writer, kind)
            channel = self.writer.register_channel(topic, "protobuf", self._schemas[kind])
            self._channels[topic] = channel
        self._add(topic, moment, message.SerializeToString(deterministic=True))

    def json(self, topic: str, schema: dict[str, Any], moment: int, values: dict[str, Any]) -> None:
        """Append a message of one of our own schemas, which one topic has alone."""
        if topic not in self._channels:
            data = json.dumps(schema, separators=(",", ":")).encode()
            number = self.writer.register_schema(schema["title"], "jsonschema", data)
            self._channels[topic] = self.writer.register_channel(topic, "json", number)
        self._add(topic, moment, json.dumps(values, allow_nan=False).encode())

    def _add(self, topic: str, moment: int, data: bytes) -> None:
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
    """Return verdict, least clearance and contacts as messages, in the order of time."""
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
