from typing import Any

import coal
import numpy as np
import pytest
import scipy

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import (
    ANGLE,
    AXIAL,
    COLUMNS,
    DISTANCE,
    EDGED,
    HEADING,
    PARALLEL,
    POINT,
    ROD,
    ROUND,
    TERMS,
    UPRIGHT,
    Aim,
    AngleTerm,
    FreeSpace,
    LengthTerm,
    LimitedAngle,
    PostureCost,
    RatioTerm,
    rate_limits,
    rate_poses,
)

COUNT = 300
LENGTH = LengthTerm(weight=1.0)


def drawn(seed: int) -> tuple[np.ndarray, list[Any], np.ndarray]:
    """Return poses (12, COUNT), their rotations, their positions."""
    rng = np.random.default_rng(seed)
    rotations = [
        scipy.spatial.transform.Rotation.random(random_state=int(k))
        for k in rng.integers(0, 2**31, COUNT)
    ]
    positions = rng.uniform(-1.0, 1.0, (COUNT, 3))
    pose = np.vstack([np.array([r.as_matrix().ravel() for r in rotations]).T, positions.T])
    return np.ascontiguousarray(pose), rotations, positions


def rated(pose: np.ndarray, aim: Aim) -> np.ndarray:
    rows = np.full((len(TERMS), COUNT), np.nan)
    rate_poses(COUNT, pose, aim, rows)
    return rows


def aim_at(rotation: Any, point: np.ndarray) -> Aim:
    matrix = np.ascontiguousarray(rotation.as_matrix())
    up, across = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    axis = matrix[:, 2].copy()
    return Aim(matrix.ravel(), point, axis, POINT, 0.0, 0.0, np.zeros(3), up, across)


def test_poses_against_scipy() -> None:
    pose, rotations, positions = drawn(0)
    goal, point = (
        scipy.spatial.transform.Rotation.from_euler("xyz", [30, 40, 50], degrees=True),
        np.array([0.1, 0.2, 0.3]),
    )
    rows = rated(pose, aim_at(goal, point))
    assert rows[DISTANCE] == pytest.approx(np.linalg.norm(positions - point, axis=1), abs=1e-12)
    assert rows[ANGLE] == pytest.approx([(r.inv() * goal).magnitude() for r in rotations], abs=1e-7)
    y, z = (np.array([r.as_matrix()[:, k] for r in rotations]) for k in (1, 2))
    assert rows[UPRIGHT] == pytest.approx(np.arccos(y[:, 2]), abs=1e-7)
    assert rows[PARALLEL] == pytest.approx(np.abs(np.arcsin(z[:, 2])), abs=1e-7)


SHAPES = {
    "sphere": (coal.Sphere(0.3), (ROD, 0.0, 0.3)),
    "capsule": (coal.Capsule(0.2, 0.8), (ROD, 0.4, 0.2)),
    "cylinder": (coal.Cylinder(0.2, 0.8), (ROUND, 0.4, 0.2)),
    "box": (coal.Box(0.4, 0.6, 0.8), (EDGED, 0.0, 0.0)),
}


@pytest.mark.parametrize("name", SHAPES)
def test_distances_from_surfaces_against_coal(name: str) -> None:
    shape, (kind, half, radius) = SHAPES[name]
    pose, _, positions = drawn(1)
    place = scipy.spatial.transform.Rotation.from_euler("xyz", [10, 70, -20], degrees=True)
    aim = aim_at(place, np.array([0.1, -0.2, 0.3]))._replace(
        surface=kind, half_length=half, radius=radius, half_edges=np.array([0.2, 0.3, 0.4])
    )
    rows = rated(pose, aim)
    body = coal.Transform3s(place.as_matrix(), aim.point)
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    inside = 0
    for n, position in enumerate(positions):
        result.clear()
        point = coal.Transform3s(np.eye(3), position)
        expected = coal.distance(coal.Sphere(1e-9), point, shape, body, request, result)
        if expected >= 0.0:
            assert rows[DISTANCE, n] == pytest.approx(expected, abs=1e-5)
        # coal finds the way out by iterations, near round bodies a longer one than the shortest
        else:
            inside += 1
            assert expected - 1e-5 <= rows[DISTANCE, n] <= 0.0
            assert rows[DISTANCE, n] == pytest.approx(
                depth(name, place.inv().apply(position - aim.point)), abs=1e-12
            )
    assert inside > 3


def depth(name: str, point: np.ndarray) -> float:
    """Return minus how far a point inside of a body, in its own frame.

    Is from getting out of it.
    """
    x, y, z = np.abs(point)
    away = np.hypot(x, y)
    return float(
        {
            "sphere": np.hypot(away, z) - 0.3,
            "capsule": np.hypot(away, max(z - 0.4, 0.0)) - 0.2,
            "cylinder": max(away - 0.2, z - 0.4),
            "box": max(x - 0.2, y - 0.3, z - 0.4),
        }[name]
    )


def test_axial_and_heading_against_their_definitions() -> None:
    pose, rotations, positions = drawn(2)
    place, middle = (
        scipy.spatial.transform.Rotation.from_euler("xyz", [10, 70, -20], degrees=True),
        np.array([0.1, -0.2, 0.3]),
    )
    aim = aim_at(place, middle)._replace(surface=ROUND, half_length=0.4, radius=0.2)
    rows = rated(pose, aim)
    axis = place.as_matrix()[:, 2]
    for n, (rotation, position) in enumerate(zip(rotations, positions, strict=True)):
        _, y, z = rotation.as_matrix().T
        assert rows[AXIAL, n] == pytest.approx(np.arccos(abs(y @ axis)), abs=1e-7)
        nearest = middle + np.clip((position - middle) @ axis, -0.4, 0.4) * axis
        way = (nearest - position) / np.linalg.norm(nearest - position)
        assert rows[HEADING, n] == pytest.approx(np.arccos(np.clip(z @ way, -1, 1)), abs=1e-7)


def test_the_margin_is_that_of_the_joint_nearest_to_a_limit() -> None:
    limits = np.array([[-1.0, 1.0], [0.0, 4.0]])
    q = np.array([[0.0, 0.5, 1.0, 0.0], [2.0, 2.0, 2.0, 3.0]])
    row = np.empty(4)
    rate_limits(4, q, limits, row)
    assert row == pytest.approx([0.0, 0.5, 1.0, 0.5])


def test_weights_of_chosen_terms() -> None:
    cost = PostureCost(
        goal_distance=LengthTerm(weight=2.0),
        goal_angle=AngleTerm(weight=0.01, unit="deg"),
        collision=RatioTerm(weight=1000.0),
    )
    assert cost.chosen == ("goal_distance", "goal_angle", "collision")
    weights = cost.weights((), "terms")
    assert weights[DISTANCE] == 2.0
    assert weights[ANGLE] == pytest.approx(0.01 / DEGREE)
    assert np.count_nonzero(weights) == 3
    assert np.count_nonzero(cost.weights(("goal_distance", "collision"), "terms")) == 2
    assert cost.tilt_limits == (np.inf, np.inf)
    assert len(COLUMNS) == len(TERMS)


def test_terms_that_a_phase_cannot_have() -> None:
    cost = PostureCost(goal_distance=LENGTH)
    with pytest.raises(
        SettingError, match=r"terms\[0\]: must be a cost term .*, was 'goal_distanc'; did you mean"
    ):
        cost.weights(("goal_distanc",), "terms")
    with pytest.raises(
        SettingError,
        match=r"terms\[1\]: must be a term that the objective gives a weight \(goal_dist",
    ):
        cost.weights(("goal_distance", "upright"), "terms")


UP = LimitedAngle(weight=0.3, limit=10.0)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ({"goal_distance": None}, "goal_distance: must be given: every goal is a place"),
        (
            {"upright": UP, "keep_parallel": UP},
            "keep_parallel: must be left out with upright, which holds another",
        ),
        (
            {"free_space": FreeSpace(weight=1.0, reach=0.1)},
            "free_space: must be given with collision",
        ),
    ],
)
def test_terms_that_contradict_each_other(terms: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        PostureCost(**{"goal_distance": LENGTH} | terms)  # type: ignore[arg-type]
