import base64
import functools
import io
import json
import re
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

from evoexp.playback.playable_log import LAYOUT, SECOND, layout, playable_log
from evoexp.playback.player_page import page
from evoexp.playback.recording import Heading, Recording
from playback_samples import SAMPLES, half_extent, recording, refuted

LARGEST = 2_000_000  # [B]
ELSEWHERE = rb"https?://|//cdn|@import|url\(|<script[^>]+src=|fetch\(|XMLHttpRequest"


def motions(content: bytes) -> list[dict[str, Any]]:
    script = rb'<script type="application/json" id="motions">(.*?)</script>'
    (data,) = re.findall(script, content, re.DOTALL)
    return json.loads(data)


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f4")


@pytest.mark.examples(2)
@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_a_page_holds_its_motion_and_refers_to_nothing(name: str) -> None:
    shown = recording(name)
    content = page([shown])
    assert content == page([shown]) and len(content) < LARGEST
    assert not re.search(ELSEWHERE, content) and b"{{" not in content
    (motion,) = motions(content)
    assert np.array_equal(unpacked(motion["poses"]), shown.poses.world.astype("<f4").ravel())
    assert np.array_equal(unpacked(motion["times"]), shown.times.astype("<f4"))
    shapes = [(shape["name"], tuple(shape["size"])) for shape in motion["shapes"]]
    assert shapes == [(shape.name, shape.outline.size) for shape in shown.shapes]
    assert motion["planar"] == shown.view.planar


def test_two_motions_share_a_page_and_a_refuted_one_says_when() -> None:
    first, second = motions(page([recording("two arms"), refuted()]))
    assert (first["title"], second["title"]) == ("two arms", "refuted")
    assert second["status"] == "refuted" and "touch at instant" in second["verdict"]
    assert second["contacts"] == [list(contact) for contact in refuted().clearance.contacts]


@pytest.mark.parametrize(
    ("certified", "kept", "margin", "badge"),
    [
        (True, True, 0.5, "required margin kept"),
        (True, False, 0.5, "required margin not kept"),
        (True, None, 0.5, "required margin undecided"),
        (True, True, 0.0, None),  # none is required
        (False, False, 0.5, None),  # in contact: refuted says it all
    ],
)
def test_whether_the_required_margin_is_kept_is_a_badge_of_its_own(
    certified: bool, kept: bool | None, margin: float, badge: str | None
) -> None:
    shown = recording("two arms")
    verdict = shown.verdict._replace(certified=certified, certified_margin=kept)
    (motion,) = motions(page([shown._replace(verdict=verdict, margin=margin)]))
    assert motion["status"] == ("certified" if certified else "refuted")
    assert motion.get("margin_text") == badge
    assert motion["margin"] == margin, "the number stays for the line in the chart"
    assert (motion.get("margin_kind") in ("kept", "broken", "unsure")) == (badge is not None)


def test_a_title_cannot_end_the_script_or_the_head() -> None:
    title = "</script><b>{{motions}}&"
    content = page([recording("two arms")._replace(heading=Heading(title))])
    assert content.count(b"</script>") == 2
    assert b"<title>&lt;/script&gt;&lt;b&gt;" in content
    assert motions(content)[0]["title"] == title


PUBLISHED = {
    "/tf": "foxglove.FrameTransforms",
    "/joint_states": "foxglove.JointStates",
    "/log": "foxglove.Log",
    **{
        f"/scene/{each}": "foxglove.SceneUpdate"
        for each in ("robot", "obstacles", "ghosts", "ways")
    },
}
FIELDS = ("cubes", "spheres", "cylinders", "lines", "triangles")
COUNTS = {
    "box": [1, 0, 0, 0, 0],
    "half_space": [1, 0, 0, 0, 0],
    "sphere": [0, 1, 0, 0, 0],
    "ellipsoid": [0, 1, 0, 0, 0],
    "cylinder": [0, 0, 1, 0, 0],
    "capsule": [0, 2, 1, 0, 0],
}
JSON_TYPES = {"number": (int, float), "string": str, "array": list}
Topics = dict[str, list[tuple[int, Any]]]


@functools.cache
def message_class(data: bytes, name: str) -> Any:
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(data).file:  # each after its imports
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))


def decoded(shown: Recording) -> Topics:
    """Return topic → (log time, message), decoded by the schemas that the file itself carries."""
    found: Topics = {}
    for schema, channel, message in make_reader(io.BytesIO(playable_log(shown))).iter_messages():
        assert schema is not None
        if schema.encoding == "protobuf":
            value = message_class(schema.data, schema.name).FromString(message.data)
            known = value.SerializeToString(deterministic=True)
            assert known == message.data, "nothing that the schema does not know"
            assert schema.name == PUBLISHED[channel.topic]
        else:
            assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
            value, properties = json.loads(message.data), json.loads(schema.data)["properties"]
            for key, item in value.items():
                assert isinstance(item, JSON_TYPES[properties[key]["type"]])
        found.setdefault(channel.topic, []).append((message.log_time, value))
    return found


def numbers(message: Any, axes: str = "xyz") -> list[float]:
    return [getattr(message, axis) for axis in axes]


@pytest.mark.examples(3)
@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_it_holds_the_recording_and_is_the_same_each_time(name: str) -> None:
    shown = recording(name)
    assert playable_log(shown) == playable_log(shown)
    topics = decoded(shown)
    for topic in ("/tf", "/joint_states", "/clearance"):
        times = [time for time, _ in topics[topic]]
        assert len(times) == len(shown.times) and times == sorted(times)
    for topic in (topic for topic in topics if topic.startswith("/scene/")):
        ((moment, update),) = topics[topic]
        assert moment == 0
        assert all(entity.frame_locked and not entity.lifetime.nanos for entity in update.entities)
    assert topics["/tf"][-1][0] == round(shown.motion.num_segments * shown.seconds * SECOND)
    parents = [*(frame.name for frame in shown.frames), "world"]
    for k in range(0, len(shown.times), 23):
        transforms, joints = topics["/tf"][k][1].transforms, topics["/joint_states"][k][1].joints
        frames = [(row.child_frame_id, row.parent_frame_id) for row in transforms]
        assert frames == [(frame.name, parents[frame.parent]) for frame in shown.frames]
        rows = [numbers(row.translation) + numbers(row.rotation, "xyzw") for row in transforms]
        assert np.array_equal(rows, shown.poses.local[k])
        assert [joint.name for joint in joints] == [joint.name for joint in shown.joints]
        assert np.array_equal([joint.position for joint in joints], shown.q[k])
        assert np.array_equal([joint.velocity for joint in joints], shown.dq[k])


@pytest.mark.examples(2)
@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_every_body_is_drawn_once_in_the_frame_that_moves_it_and_of_its_size(name: str) -> None:
    shown, topics = recording(name), decoded(recording(name))
    frames = [*(frame.name for frame in shown.frames), "world"]
    updates = [*topics.get("/scene/robot", []), *topics.get("/scene/obstacles", [])]
    drawn = [entity for _, update in updates for entity in update.entities]
    assert sorted(entity.id for entity in drawn) == sorted(shape.name for shape in shown.shapes)
    entities = {entity.id: entity for entity in drawn}
    for shape in shown.shapes:
        entity, kind = entities[shape.name], shape.outline.kind
        assert entity.frame_id == frames[shape.frame]
        counts = [len(getattr(entity, field)) for field in FIELDS]
        if shape.outline.is_line:
            assert counts == [0, 0, 0, 1, 0]
            a, b = (np.array(numbers(point)) for point in entity.lines[0].points)
            assert np.linalg.norm(b - a) == pytest.approx(shape.outline.size[1], abs=1e-12)
            assert 0.5 * (a + b) == pytest.approx(shape.pose[:3], abs=1e-12)
            continue
        assert counts == COUNTS[kind], shape.name
        if kind == "half_space":
            continue
        solid = [*entity.cylinders, *entity.cubes, *entity.spheres][0]
        half = 0.5 * np.array(numbers(solid.size))
        if kind == "capsule":
            half[2] += 0.5 * entity.spheres[0].size.x
            assert {ball.size.x for ball in entity.spheres} == {solid.size.x}
        assert half == pytest.approx(half_extent(shape.outline), abs=1e-12)
        assert numbers(solid.pose.position) == pytest.approx(shape.pose[:3], abs=1e-12)


def test_refutations_are_said_at_their_moment() -> None:
    shown, topics = refuted(), decoded(refuted())
    said = [(time, row) for time, row in topics["/log"] if row.level == 4]
    for (time, row), contact in zip(said, shown.clearance.contacts, strict=True):
        assert time == round(contact.begin * shown.seconds * SECOND)
        assert row.timestamp.seconds * SECOND + row.timestamp.nanos == time
        assert contact.pair in row.message and "refuted" in row.message
    assert "/improvements" not in topics


def test_the_log_carries_its_improvements_its_condition_and_a_layout() -> None:
    shown = recording("redundant arm")
    topics = decoded(shown)
    ((moment, rows),) = topics["/improvements"]
    finite = [row for row in shown.heading.improvements if np.isfinite(row[1])]
    assert moment == 0 and list(zip(rows["generation"], rows["best_cost"], strict=True)) == finite
    reader = make_reader(io.BytesIO(playable_log(shown)))
    files = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
    assert files == {"config.json": shown.config_json, LAYOUT: layout()}
    (metadata,) = reader.iter_metadata()
    assert metadata.metadata["condition"] == shown.condition_id
    wanted = json.loads(layout())["configById"]["3D!motion"]["topics"]
    assert set(wanted) <= topics.keys() | {"/scene/obstacles"}
