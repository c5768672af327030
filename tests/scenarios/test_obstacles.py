"""Obstacles as settings and as a table."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter

from evoexp.collision.scene import obstacle_shapes
from evoexp.errors import SettingError
from evoexp.scenarios import obstacles
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
