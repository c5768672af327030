"""Obstacles as settings and as a table; occupancy grids; postures of planar arms of two links.

Grids come out of text, out of pictures, out of blocks; postures are given by angles or by the place
of the end-effector.
"""

import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from pydantic import TypeAdapter

from evoexp.attachments import File, keep
from evoexp.collision.scene import obstacle_shapes
from evoexp.errors import SettingError
from evoexp.scenarios import obstacles
from evoexp.scenarios.grid_motion import GridMotion, blocks, read_map
from evoexp.scenarios.motion_tasks import Posture
from evoexp.scenarios.obstacles import obstacle_hulls, obstacle_table, rotation_matrix
from obstacle_samples import box, capsule, cylinder, ellipse, half_space, sphere

ONE_OF_EACH = (
    sphere((1.0, 2.0), 0.5),
    box((1.0, 2.0, 3.0), (0.2, 0.4, 0.6), (10.0, 20.0, 30.0)),
    capsule((0.0, 0.0), (0.0, 3.0), 0.1),
    cylinder((0.0, 0.0, 1.0), (2.0, 0.0, 1.0), 0.3),
    half_space((0.0, -1.0), (0.0, 2.0)),
    ellipse((3.0, 4.0), (2.0, 0.5), 90.0),
)


def test_the_table_of_every_kind() -> None:
    table = obstacle_table(ONE_OF_EACH)
    kinds = ("SPHERE", "BOX", "CAPSULE", "CYLINDER", "HALF_SPACE", "ELLIPSE")
    assert table.kind.tolist() == [getattr(obstacles, kind) for kind in kinds]
    centers = [[1, 2, 0], [1, 2, 3], [0, 1.5, 0], [1, 0, 1], [0, -1, 0], [3, 4, 0]]
    assert table.center.tolist() == centers
    sizes = [[0.5, 0, 0], [0.1, 0.2, 0.3], [0.1, 1.5, 0], [0.3, 1.0, 0], [0, 0, 0], [2.0, 0.5, 0.5]]
    assert table.size.tolist() == sizes
    turns = table.rotation.reshape(-1, 3, 3)
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), [np.eye(3)] * 6, atol=1e-15)
    np.testing.assert_array_equal(turns[1], rotation_matrix((10.0, 20.0, 30.0)))
    np.testing.assert_allclose(turns[2:5, :, 2], [[0, 1, 0], [1, 0, 0], [0, 1, 0]], atol=1e-15)


def test_collision_models_without_ellipses_refuse_them() -> None:
    assert obstacle_table(ONE_OF_EACH[:5]).without_ellipses().kind.tolist() == [0, 1, 2, 3, 4]
    with pytest.raises(SettingError, match=r"obstacles\[5\]\.shape: must be any but an ellipse"):
        obstacle_table(ONE_OF_EACH).without_ellipses()


@given(*[st.floats(-10.0, 10.0)] * 3)
def test_the_axis_of_a_half_space_is_its_normal(x: float, y: float, z: float) -> None:
    normal = np.array([x, y, z])
    length = np.sqrt((normal * normal).sum())
    if length < 1e-100:
        return
    turn = obstacle_table((half_space((0.0, 0.0), (x, y, z)),)).rotation[0].reshape(3, 3)
    np.testing.assert_allclose(turn[:, 2], normal / length, atol=1e-14)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_settings_are_read_from_plain_data() -> None:
    adapter = TypeAdapter(obstacles.Obstacle)
    data = {"shape": "half_space", "point": (0.0, 0.0, 0.1), "normal": (0.0, 0.0, 1.0)}
    assert adapter.validate_python(data) == half_space(data["point"], data["normal"])
    data = {"shape": "cylinder", "start": (0.0, 0.0), "end": (0.0, 0.1), "radius": 1.0}
    found = adapter.validate_python(data)
    assert found == cylinder(data["start"], data["end"], 1.0)
    assert found.canonical() == data | {"start": [0.0, 0.0], "end": [0.0, 0.1]}


def test_a_hull_without_a_volume_is_refused_where_it_slants() -> None:
    points = ((0.0, 0.0, 0.0), (1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 1.0, 1.0))
    slanted = (obstacles.HullObstacle(shape="hull", points=points),)
    with pytest.raises(SettingError, match=r"scenario\.obstacles\[0\]\.points: .* no plane"):
        obstacle_shapes(obstacle_table(slanted), obstacle_hulls(slanted))


BASE: dict[str, Any] = {"size": (4, 3), "start": (0, 0), "goal": (3, 2), "obstacle_height": 0.5}
BASE |= {"security_margin": 0.0, "length_unit": "unit"}
TEXT = b"; a comment\n..*.  ; upper row\n+ + + +\n.#.."
SEEN = {(2, 2), (1, 0)}


def png(rows: list[list[int]]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(np.array(rows, dtype=np.uint8)).save(buffer, "PNG")
    return buffer.getvalue()


PICTURE = png([[255, 255, 0, 255], [255, 255, 255, 255], [255, 0, 255, 255]])


def nodes_of(grid: np.ndarray) -> set[tuple[int, ...]]:
    return {tuple(node) for node in np.argwhere(grid).tolist()}


@pytest.mark.parametrize("content", [TEXT, PICTURE, TEXT.replace(b"\n", b"\r\n")])
def test_a_map_has_its_greatest_y_first(content: bytes) -> None:
    assert nodes_of(read_map(content, (4, 3), "scenario.map")) == SEEN


def test_a_map_in_space_has_one_block_per_z() -> None:
    grid = read_map(b"*.\n..\n\n..\n.*\n\n..\n..\n", (2, 2, 3), "scenario.map")
    assert nodes_of(grid) == {(0, 1, 0), (1, 0, 1)}


SHAPE = r"scenario\.map: must be a map of 4 × 3 nodes, as scenario\.size says, was '4 × 2'"
SIGNS = r"must be a map of \* or # \(blocked\) and \+ or \. \(free\), was 'x in row 2'"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"....\n....\n", SHAPE),
        (b"....\n..x.\n....", SIGNS),
        (b"....\n..\n....", "equally long"),
        (b"", "equally long, was 'empty'"),
        (b"\xff\xfe", "a text or a PNG"),
        (b"\x89PNG\r\n\x1a\nnothing", "a PNG that can be read"),
        (png([[255, 128, 0, 255]] * 3), r"\(blocked\) and white \(free\) pixels, was 'grey 128'"),
    ],
)
def test_what_is_no_map_is_refused(content: bytes, said: str) -> None:
    with pytest.raises(SettingError, match=said):
        read_map(content, (4, 3), "scenario.map")


def test_blocks_and_map_add_up() -> None:
    scenario = GridMotion(**BASE, obstacles=((1, 1, 2, 1),), map=File(sha256=keep(TEXT)))
    assert nodes_of(scenario.blocked()) == SEEN | {(1, 1), (2, 1)}
    assert scenario.bodies()[0].size == (1.0, 0.02, 0.5)
    assert scenario.bodies()[0].center == (1.5, 1.0, 0.25)


@given(st.sampled_from([(5, 6), (3, 3, 4)]), st.floats(0.0, 1.0), st.integers(0, 2**32))
def test_blocks_cover_a_set_and_nothing_else(
    shape: tuple[int, ...], share: float, seed: int
) -> None:
    nodes = np.random.default_rng(seed).random(shape) < share
    covered = np.zeros(shape, dtype=bool)
    for low, high in blocks(nodes):
        part = tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))
        assert nodes[part].all()
        covered[part] = True
    assert np.array_equal(covered, nodes)


def reached(x: float, y: float, elbow: Any, base: float = 0.0) -> np.ndarray:
    posture = Posture(tip=(float(x), float(y)), elbow=elbow)
    return posture.link_angles("q_start[0]", np.array([base, 0.0]), np.array([0.25, 0.25]))


@pytest.mark.parametrize(
    "tip", [(0.3, 0.4), (0.5, 0.0), (-0.5, 0.0), (0.14, 0.48), (-0.4, 0.3), (-0.3, 0.4)]
)
@pytest.mark.parametrize("elbow", ["left", "right"])
def test_a_tip_at_full_reach_stretches_the_arm(tip: tuple[float, float], elbow: str) -> None:
    """0.3² + 0.4² is above 0.5² by the last place, or below: no elbow bends by 1e-8 rad."""
    first, second = reached(*tip, elbow)
    assert first == second == pytest.approx(np.degrees(np.arctan2(tip[1], tip[0])), abs=1e-12)


def test_a_tip_out_of_reach_is_refused() -> None:
    with pytest.raises(SettingError, match=r"tip: must be 0 to 0.5 away from the robot's base"):
        reached(0.3, 0.4 + 1e-12, "left")


@pytest.mark.parametrize("base", [0.0, 0.1, 0.3, 0.7])
@pytest.mark.parametrize("angles", [(0.0, 90.0), (180.0, 90.0), (90.0, 180.0), (45.0, 0.0)])
def test_rounding_puts_no_link_outside_of_the_half_turn(
    angles: tuple[float, float], base: float
) -> None:
    x, y = np.cos(np.radians(angles)).sum(), np.sin(np.radians(angles)).sum()
    elbow = "left" if angles[1] < angles[0] else "right"
    found = reached(base + 0.25 * x, 0.25 * y, elbow, base)
    assert found == pytest.approx(np.array(angles), abs=1e-12)
