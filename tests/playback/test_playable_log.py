"""The playable log: read back by other people's readers.

And held against its schemas and Pinocchio.
"""

import io
import json

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

from evoexp.playback.playable_log import LAYOUT, SECOND, layout, playable_log
from playback_samples import SAMPLES, half_extent, recording, refuted

PUBLISHED = {
    "/tf": "foxglove.FrameTransforms",
    "/joint_states": "foxglove.JointStates",
    "/log": "foxglove.Log",
    "/scene/robot": "foxglove.SceneUpdate",
    "/scene/obstacles": "foxglove.SceneUpdate",
    "/scene/ghosts": "foxglove.SceneUpdate",
    "/scene/ways": "foxglove.SceneUpdate",
}
NAMES = sorted(SAMPLES)
COUNTS = {  # of cubes, spheres, cylinders, lines, triangles
    "box": [1, 0, 0, 0, 0],
    "half_space": [1, 0, 0, 0, 0],
    "sphere": [0, 1, 0, 0, 0],
    "ellipsoid": [0, 1, 0, 0, 0],
    "cylinder": [0, 0, 1, 0, 0],
    "capsule": [0, 2, 1, 0, 0],
}


def decoded(content: bytes) -> dict[str, list[tuple[int, object]]]:
    """Return topic → (log time, message), decoded by the schemas that the file itself carries."""
    found: dict[str, list[tuple[int, object]]] = {}
    kinds: dict[int, object] = {}
    for schema, channel, message in make_reader(io.BytesIO(content)).iter_messages():
        assert schema is not None
        if schema.encoding == "protobuf":
            if schema.id not in kinds:
                kinds[schema.id] = _message_class(schema.data, schema.name)
            value = kinds[schema.id].FromString(message.data)  # type: ignore[attr-defined]
            assert value.SerializeToString(deterministic=True) == message.data, (
                "nothing that the schema does not know"
            )
            assert schema.name == PUBLISHED[channel.topic]
        else:
            assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
            value = json.loads(message.data)
            properties = json.loads(schema.data)["properties"]
            assert set(value) <= set(properties)
            kinds_of = {"number": (int, float), "string": str, "array": list}
            assert all(
                isinstance(item, kinds_of[properties[key]["type"]]) for key, item in value.items()
            )
        found.setdefault(channel.topic, []).append((message.log_time, value))
    return found


def _message_class(data: bytes, name: str) -> object:
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(
        data
    ).file:  # each behind what it depends on
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))


@pytest.fixture(params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.mark.examples(2)
def test_it_reads_back_by_its_own_schemas_and_is_the_same_each_time(name: str) -> None:
    shown = recording(name)
    content = playable_log(shown)
    assert content == playable_log(shown)
    topics = decoded(content)
    for topic in ("/tf", "/joint_states", "/clearance"):
        assert len(topics[topic]) == len(shown.times)
        assert [time for time, _ in topics[topic]] == sorted(time for time, _ in topics[topic])
    for topic in (topic for topic in topics if topic.startswith("/scene/")):
        ((moment, update),) = topics[topic]
        assert moment == 0
        assert all(entity.frame_locked and not entity.lifetime.nanos for entity in update.entities)
    last = topics["/tf"][-1][0]
    assert last == round(shown.motion.num_segments * shown.seconds * SECOND)


@pytest.mark.examples(2)
def test_transforms_are_the_poses_of_the_recording(name: str) -> None:
    """`test_recording` holds these against Pinocchio."""
    shown, topics = recording(name), decoded(playable_log(recording(name)))
    names = [*(frame.name for frame in shown.frames), "world"]
    for k in range(0, len(shown.times), 23):
        transforms = topics["/tf"][k][1].transforms  # type: ignore[attr-defined]
        frames = [(row.child_frame_id, row.parent_frame_id) for row in transforms]
        assert frames == [(frame.name, names[frame.parent]) for frame in shown.frames]
        parts = [(row.translation, row.rotation) for row in transforms]
        rows = [[t.x, t.y, t.z, r.x, r.y, r.z, r.w] for t, r in parts]
        assert np.array_equal(rows, shown.poses.local[k])


@pytest.mark.examples(2)
def test_every_body_is_drawn_once_in_the_frame_that_moves_it_and_of_its_size(name: str) -> None:
    shown, topics = recording(name), decoded(playable_log(recording(name)))
    frames = [*(frame.name for frame in shown.frames), "world"]
    updates = (topics.get(topic, []) for topic in ("/scene/robot", "/scene/obstacles"))
    drawn = [entity for rows in updates for _, row in rows for entity in row.entities]  # type: ignore[attr-defined]
    assert sorted(entity.id for entity in drawn) == sorted(shape.name for shape in shown.shapes)
    entities = {entity.id: entity for entity in drawn}
    for shape in shown.shapes:
        entity, kind = entities[shape.name], shape.outline.kind
        assert entity.frame_id == frames[shape.frame]
        fields = ("cubes", "spheres", "cylinders", "lines", "triangles")
        counts = [len(getattr(entity, field)) for field in fields]
        if shape.outline.is_line:
            assert counts == [0, 0, 0, 1, 0]
            a, b = (np.array([p.x, p.y, p.z]) for p in entity.lines[0].points)
            assert np.linalg.norm(b - a) == pytest.approx(shape.outline.size[1], abs=1e-12)
            assert 0.5 * (a + b) == pytest.approx(shape.pose[:3], abs=1e-12)
            continue
        assert counts == COUNTS[kind], shape.name
        if kind == "half_space":
            continue
        solid = (list(entity.cylinders) + list(entity.cubes) + list(entity.spheres))[0]
        half = 0.5 * np.array([solid.size.x, solid.size.y, solid.size.z])
        if kind == "capsule":
            half[2] += 0.5 * entity.spheres[0].size.x
            assert {ball.size.x for ball in entity.spheres} == {solid.size.x}
        assert half == pytest.approx(half_extent(shape.outline), abs=1e-12)
        p = solid.pose.position
        assert np.array([p.x, p.y, p.z]) == pytest.approx(shape.pose[:3], abs=1e-12)


@pytest.mark.examples(3)
def test_joint_states_are_positions_and_their_speeds(name: str) -> None:
    shown, topics = recording(name), decoded(playable_log(recording(name)))
    for k in range(0, len(shown.times), 50):
        joints = topics["/joint_states"][k][1].joints  # type: ignore[attr-defined]
        assert [joint.name for joint in joints] == [joint.name for joint in shown.joints]
        assert np.array_equal([joint.position for joint in joints], shown.q[k])
        assert np.array_equal([joint.velocity for joint in joints], shown.dq[k])


def test_refutations_are_said_at_their_moment() -> None:
    shown, topics = refuted(), decoded(playable_log(refuted()))
    said = [(time, row) for time, row in topics["/log"] if row.level == 4]  # type: ignore[attr-defined]
    assert len(said) == len(shown.clearance.contacts)
    for (time, row), contact in zip(said, shown.clearance.contacts, strict=True):
        assert time == round(contact.begin * shown.seconds * SECOND)
        assert row.timestamp.seconds * SECOND + row.timestamp.nanos == time  # type: ignore[attr-defined]
        assert contact.pair in row.message and "refuted" in row.message  # type: ignore[attr-defined]
    assert "/improvements" not in topics


def test_improvements_have_their_own_axis() -> None:
    shown, topics = recording("redundant arm"), decoded(playable_log(recording("redundant arm")))
    ((moment, rows),) = topics["/improvements"]
    finite = [row for row in shown.heading.improvements if np.isfinite(row[1])]
    assert moment == 0
    assert list(zip(rows["generation"], rows["best_cost"], strict=True)) == finite  # type: ignore[index]


def test_the_log_carries_its_condition_and_a_layout() -> None:
    shown = recording("two arms")
    reader = make_reader(io.BytesIO(playable_log(shown)))
    files = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
    assert files == {"config.json": shown.config_json, LAYOUT: layout()}
    (metadata,) = reader.iter_metadata()
    assert metadata.metadata["condition"] == shown.condition_id
    wanted = json.loads(layout())
    topics = set(decoded(playable_log(recording("redundant arm"))))
    assert set(wanted["configById"]["3D!motion"]["topics"]) <= topics | {"/scene/obstacles"}
