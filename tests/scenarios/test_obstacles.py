"""Obstacles as settings and as a table."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from evoexp.errors import SettingError
from evoexp.scenarios.obstacles import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSE,
    HALF_SPACE,
    SPHERE,
    BoxObstacle,
    CapsuleObstacle,
    CylinderObstacle,
    EllipseObstacle,
    HalfSpaceObstacle,
    Obstacle,
    SphereObstacle,
    obstacle_table,
    rotation_matrix,
)

ONE_OF_EACH = (
    SphereObstacle(shape="sphere", center=(1.0, 2.0), radius=0.5),
    BoxObstacle(
        shape="box", center=(1.0, 2.0, 3.0), size=(0.2, 0.4, 0.6), rotation=(10.0, 20.0, 30.0)
    ),
    CapsuleObstacle(shape="capsule", start=(0.0, 0.0), end=(0.0, 3.0), radius=0.1),
    CylinderObstacle(shape="cylinder", start=(0.0, 0.0, 1.0), end=(2.0, 0.0, 1.0), radius=0.3),
    HalfSpaceObstacle(shape="half_space", point=(0.0, -1.0), normal=(0.0, 2.0)),
    EllipseObstacle(shape="ellipse", center=(3.0, 4.0), semi_axes=(2.0, 0.5), angle=90.0),
)


def test_the_table_of_every_kind() -> None:
    table = obstacle_table(ONE_OF_EACH)
    assert table.kind.tolist() == [SPHERE, BOX, CAPSULE, CYLINDER, HALF_SPACE, ELLIPSE]
    assert table.center.tolist() == [
        [1, 2, 0],
        [1, 2, 3],
        [0, 1.5, 0],
        [1, 0, 1],
        [0, -1, 0],
        [3, 4, 0],
    ]
    sizes = [[0.5, 0, 0], [0.1, 0.2, 0.3], [0.1, 1.5, 0], [0.3, 1.0, 0], [0, 0, 0], [2.0, 0.5, 0.5]]
    assert table.size.tolist() == sizes
    rotations = table.rotation.reshape(-1, 3, 3)
    np.testing.assert_allclose(
        rotations @ rotations.transpose(0, 2, 1), np.tile(np.eye(3), (6, 1, 1)), atol=1e-15
    )
    np.testing.assert_array_equal(rotations[1], rotation_matrix((10.0, 20.0, 30.0)))
    np.testing.assert_allclose(rotations[2:5, :, 2], [[0, 1, 0], [1, 0, 0], [0, 1, 0]], atol=1e-15)


def test_collision_models_without_ellipses_refuse_them() -> None:
    assert obstacle_table(ONE_OF_EACH[:5]).without_ellipses().kind.tolist() == [0, 1, 2, 3, 4]
    with pytest.raises(
        SettingError, match=r"scenario\.obstacles\[5\]\.shape: must be any but an ellipse"
    ):
        obstacle_table(ONE_OF_EACH).without_ellipses()


@given(*[st.floats(-10.0, 10.0)] * 3)
def test_the_axis_of_a_half_space_is_its_normal(x: float, y: float, z: float) -> None:
    normal = np.array([x, y, z])
    length = np.sqrt((normal * normal).sum())
    if length < 1e-100:
        return
    table = obstacle_table(
        (HalfSpaceObstacle(shape="half_space", point=(0.0, 0.0), normal=(x, y, z)),)
    )
    turn = table.rotation[0].reshape(3, 3)
    np.testing.assert_allclose(turn[:, 2], normal / length, atol=1e-14)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_settings_are_read_from_plain_data() -> None:
    adapter = TypeAdapter(Obstacle)
    data = {"shape": "half_space", "point": (0.0, 0.0, 0.1), "normal": (0.0, 0.0, 1.0)}
    assert adapter.validate_python(data) == HalfSpaceObstacle(**data)
    data = {"shape": "cylinder", "start": (0.0, 0.0), "end": (0.0, 0.1), "radius": 1.0}
    found = adapter.validate_python(data)
    assert found == CylinderObstacle(**data)
    assert found.canonical() == data | {"start": [0.0, 0.0], "end": [0.0, 0.1]}


@pytest.mark.parametrize(
    "data",
    [
        {"shape": "cylinder", "start": (0.0, 0.0), "end": (0.0, 0.1), "radius": 0.0},
        {"shape": "half_space", "point": (0.0, 0.0), "normal": (1.0,)},
        {"shape": "half_space", "point": (0.0, 0.0), "normal": (float("inf"), 0.0)},
        {"shape": "cone", "point": (0.0, 0.0)},
    ],
)
def test_settings_out_of_range_are_refused(data: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        TypeAdapter(Obstacle).validate_python(data)


@pytest.mark.parametrize(
    ("obstacle", "field"),
    [
        (
            CylinderObstacle(shape="cylinder", start=(1.0, 0.0), end=(1.0, 0.0, 0.0), radius=1.0),
            "end",
        ),
        (
            CapsuleObstacle(shape="capsule", start=(1.0, 0.0), end=(1.0, 0.0, 0.0), radius=1.0),
            "end",
        ),
        (HalfSpaceObstacle(shape="half_space", point=(1.0, 0.0), normal=(0.0, 0.0)), "normal"),
    ],
)
def test_obstacles_without_a_direction_are_refused(obstacle: object, field: str) -> None:
    with pytest.raises(SettingError, match=rf"scenario\.obstacles\[1\]\.{field}"):
        obstacle_table((ONE_OF_EACH[0], obstacle))
