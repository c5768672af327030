"""Terms of a posture's cost against scipy, coal and their definitions."""

from typing import Any

import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives import posture_cost as terms
from evoexp.objectives.posture_cost import LengthTerm, LimitedAngle, PostureCost

COUNT = 300
LENGTH, UP = LengthTerm(weight=1.0), LimitedAngle(weight=0.3, limit=10.0)
PLACE, MIDDLE = Rotation.from_euler("xyz", [10, 70, -20], degrees=True), np.array([0.1, -0.2, 0.3])
Drawn = tuple[np.ndarray, np.ndarray, np.ndarray]


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    """Return poses (12, COUNT), their rotations (COUNT, 3, 3), their positions (COUNT, 3)."""
    rng = np.random.default_rng(0)
    rotations = Rotation.random(COUNT, random_state=0).as_matrix()
    positions = rng.uniform(-1.0, 1.0, (COUNT, 3))
    pose = np.vstack([rotations.reshape(COUNT, 9).T, positions.T])
    return np.ascontiguousarray(pose), rotations, positions


def rated(pose: np.ndarray, **surface: Any) -> np.ndarray:
    """Return the terms of poses toward a goal at MIDDLE, turned as PLACE."""
    matrix = np.ascontiguousarray(PLACE.as_matrix())
    up, across, axis = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), matrix[:, 2].copy()
    kind = terms.POINT, 0.0, 0.0, np.zeros(3)
    aim = terms.Aim(matrix.ravel(), MIDDLE, axis, *kind, up, across)._replace(**surface)
    rows = np.full((len(terms.TERMS), COUNT), np.nan)
    terms.rate_poses(COUNT, pose, aim, rows)
    return rows


def test_poses_against_scipy(drawn: Drawn) -> None:
    pose, rotations, positions = drawn
    rows = rated(pose)
    away = np.linalg.norm(positions - MIDDLE, axis=1)
    turned = (Rotation.from_matrix(rotations).inv() * PLACE).magnitude()
    y, z = rotations[:, :, 1], rotations[:, :, 2]
    assert rows[terms.DISTANCE] == pytest.approx(away, abs=1e-12)
    assert rows[terms.ANGLE] == pytest.approx(turned, abs=1e-7)
    assert rows[terms.UPRIGHT] == pytest.approx(np.arccos(y[:, 2]), abs=1e-7)
    assert rows[terms.PARALLEL] == pytest.approx(np.abs(np.arcsin(z[:, 2])), abs=1e-7)


def depth(name: str, point: np.ndarray) -> float:
    """Return minus how far a point inside of a body, in its own frame, is from outside."""
    x, y, z = np.abs(point)
    away = np.hypot(x, y)
    depths = {
        "sphere": np.hypot(away, z) - 0.3,
        "capsule": np.hypot(away, max(z - 0.4, 0.0)) - 0.2,
        "cylinder": max(away - 0.2, z - 0.4),
        "box": max(x - 0.2, y - 0.3, z - 0.4),
    }
    return float(depths[name])


@pytest.mark.parametrize(
    ("name", "shape", "surface"),
    [
        ("sphere", coal.Sphere(0.3), (terms.ROD, 0.0, 0.3)),
        ("capsule", coal.Capsule(0.2, 0.8), (terms.ROD, 0.4, 0.2)),
        ("cylinder", coal.Cylinder(0.2, 0.8), (terms.ROUND, 0.4, 0.2)),
        ("box", coal.Box(0.4, 0.6, 0.8), (terms.EDGED, 0.0, 0.0)),
    ],
)
def test_distances_from_surfaces_against_coal(
    name: str, shape: Any, surface: tuple[int, float, float], drawn: Drawn
) -> None:
    pose, _, positions = drawn
    names = dict(zip(("surface", "half_length", "radius"), surface, strict=True))
    found = rated(pose, **names, half_edges=np.array([0.2, 0.3, 0.4]))[terms.DISTANCE]
    body, request = coal.Transform3s(PLACE.as_matrix(), MIDDLE), coal.DistanceRequest()
    inside = 0
    for distance, position in zip(found, positions, strict=True):
        point, result = coal.Transform3s(np.eye(3), position), coal.DistanceResult()
        expected = coal.distance(coal.Sphere(1e-9), point, shape, body, request, result)
        if expected >= 0.0:
            assert distance == pytest.approx(expected, abs=1e-5)
        else:  # coal finds the way out by iterations, near round bodies a longer one
            inside += 1
            assert expected - 1e-5 <= distance <= 0.0
            own = PLACE.inv().apply(position - MIDDLE)
            assert distance == pytest.approx(depth(name, own), abs=1e-12)
    assert inside > 3


def test_axial_and_heading_against_their_definitions(drawn: Drawn) -> None:
    pose, rotations, positions = drawn
    rows = rated(pose, surface=terms.ROUND, half_length=0.4, radius=0.2)
    axis = PLACE.as_matrix()[:, 2]
    y, z = rotations[:, :, 1], rotations[:, :, 2]
    assert rows[terms.AXIAL] == pytest.approx(np.arccos(np.abs(y @ axis)), abs=1e-7)
    nearest = MIDDLE + np.clip((positions - MIDDLE) @ axis, -0.4, 0.4)[:, None] * axis
    way = (nearest - positions) / np.linalg.norm(nearest - positions, axis=1)[:, None]
    heading = np.arccos(np.clip((z * way).sum(axis=1), -1.0, 1.0))
    assert rows[terms.HEADING] == pytest.approx(heading, abs=1e-7)


def test_the_margin_is_that_of_the_joint_nearest_to_a_limit() -> None:
    limits = np.array([[-1.0, 1.0], [0.0, 4.0]])
    q, row = np.array([[0.0, 0.5, 1.0, 0.0], [2.0, 2.0, 2.0, 3.0]]), np.empty(4)
    terms.rate_limits(4, q, limits, row)
    assert row == pytest.approx([0.0, 0.5, 1.0, 0.5])


def test_weights_of_chosen_terms() -> None:
    cost = PostureCost(
        goal_distance=LengthTerm(weight=2.0),
        goal_angle=terms.AngleTerm(weight=0.01, unit="deg"),
        collision=terms.RatioTerm(weight=1000.0),
    )
    assert cost.chosen == ("goal_distance", "goal_angle", "collision")
    weights = cost.weights((), "terms")
    assert weights[terms.DISTANCE] == 2.0
    assert weights[terms.ANGLE] == pytest.approx(0.01 / DEGREE)
    assert np.count_nonzero(weights) == 3
    assert np.count_nonzero(cost.weights(("goal_distance", "collision"), "terms")) == 2
    assert cost.tilt_limits == (np.inf, np.inf)
    assert len(terms.COLUMNS) == len(terms.TERMS)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"goal_distance": None}, "goal_distance: must be given: every goal is a place"),
        ({"upright": UP, "keep_parallel": UP}, "keep_parallel: must be left out with upright"),
        ({"free_space": terms.FreeSpace(weight=1.0, reach=0.1)}, "must be given with collision"),
    ],
)
def test_terms_that_contradict_each_other(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        PostureCost(**{"goal_distance": LENGTH} | changes)
