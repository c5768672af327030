"""Meshes as convex pieces: they contain the mesh, travel with the condition, are read as data."""

import sys
from pathlib import Path

import coal
import numpy as np
import pytest

from evoexp.attachments import PREFIX, keep
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import SettingError
from evoexp.robots import mesh_pieces as module
from evoexp.robots.mesh_pieces import loaded_mesh, mesh_pieces, read_pieces

DATA = Path(__file__).parent / "data" / "ur5_like"
REACH = (
    "robot=urdf", "scenario=urdf_reach", "planner=posture_es", "ga=corsepius",
    "objective=corsepius_reach", "collision=corsepius_spheres",
)  # fmt: skip
ONE = np.ones(3)
# an L of two boxes, as triangles without a common frame of corners
L_PROFILE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]


def condition(*overrides: str) -> Condition:
    words = [*REACH, f"robot.path={DATA / 'ur5_like.urdf'}", *overrides]
    return compose.expand(words)[0].conditions[0].condition


def angle_iron() -> bytes:
    """A closed L of unit depth, as an OBJ file."""
    lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in L_PROFILE]
    caps = [(1, 2, 3), (1, 3, 4), (1, 4, 5), (1, 5, 6)]
    faces = [(a, c, b) for a, b, c in caps] + [(a + 6, b + 6, c + 6) for a, b, c in caps]
    for k in range(6):
        a, b = k + 1, (k + 1) % 6 + 1
        faces += [(a, b, b + 6), (a, b + 6, a + 6)]
    return "\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in faces)]).encode()


def surface_points(content: bytes, count: int) -> np.ndarray:
    corners, triangles = loaded_mesh(content, ".obj", "test")
    rng = np.random.default_rng(2)
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    area = np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1))
    chosen = rng.choice(len(triangles), size=count, p=area / area.sum())
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    return np.asarray(a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen])


def standing_out(pieces: list[coal.Convex], points: np.ndarray) -> float:
    """The greatest distance of points from the nearest of some pieces, by coal."""
    request, result, here = coal.DistanceRequest(), coal.DistanceResult(), coal.Transform3s()
    worst = 0.0
    for point in points:
        there, least = coal.Transform3s(np.eye(3), point), np.inf
        for piece in pieces:
            result.clear()
            found = coal.distance(coal.Sphere(1e-9), there, piece, here, request, result)
            least = min(least, found)
        worst = max(worst, least)
    return worst


def test_the_hull_of_a_mesh_contains_it() -> None:
    pieces = read_pieces(mesh_pieces(angle_iron(), ".obj", "hulls", "test"), ONE, "test")
    assert len(pieces) == 1 and pieces[0].num_points == 5 * 2
    assert standing_out(pieces, surface_points(angle_iron(), 300)) < 1e-6


def test_pieces_of_coacd_contain_the_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("coacd")
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path))
    content = mesh_pieces(angle_iron(), ".obj", "coacd", "test")
    pieces = read_pieces(content, ONE, "test")
    assert 2 <= len(pieces) <= 4
    assert standing_out(pieces, surface_points(angle_iron(), 1000)) < 1e-6
    # the notch of the L stays free
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    notch = coal.Transform3s(np.eye(3), np.array([2.0, 2.0, 0.5]))
    for piece in pieces:
        result.clear()
        free = coal.distance(coal.Sphere(0.8), notch, piece, coal.Transform3s(), request, result)
        assert free > 0.05
    # the second time they are read from the cache
    monkeypatch.setattr(module, "_grown", None)
    assert mesh_pieces(angle_iron(), ".obj", "coacd", "test") == content


def test_pieces_that_leave_parts_out_are_grown() -> None:
    """Two boxes that are smaller than the arms of the L, as CoACD's remeshed pieces may be."""
    corners, triangles = loaded_mesh(angle_iron(), ".obj", "test")
    box = np.array(np.meshgrid((0.02, 0.98), (0.02, 0.98), (0.02, 0.98))).reshape(3, -1).T
    small = [box * [3.0, 1.0, 1.0], box * [1.0, 3.0, 1.0]]
    grown = module._grown(small, corners, triangles)
    pieces = read_pieces(module._written(grown, "test"), ONE, "test")
    points = surface_points(angle_iron(), 500)
    assert standing_out(read_pieces(module._written(small, "test"), ONE, "test"), points) > 0.01
    assert standing_out(pieces, points) < 1e-6
    # no arm grows by more than triangles that are not cut any more: the notch stays free
    assert all(piece.num_points < 500 for piece in pieces)
    reach = [max(min(p[0], p[1]) for p in each) for each in grown]
    assert max(reach) <= 1.0 + 3.0 * module.SHORT


def test_without_the_library_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "coacd", None)
    with pytest.raises(
        SettingError,
        match=r"robot.decomposition: must be hulls, or coacd with it installed "
        r"\(pip install 'evoexp\[meshes\]'\), was 'coacd'",
    ):
        condition("robot.decomposition=coacd")


def test_a_misspelt_way_is_refused() -> None:
    with pytest.raises(SettingError, match=r"robot.decomposition: must be .*'hulls'.* was 'hull'"):
        condition("robot.decomposition=hull")


def test_pieces_travel_with_the_condition() -> None:
    plain, cut = condition(), condition("robot.decomposition=hulls")
    assert b"decomposition" not in plain.to_json() and b"pieces" not in plain.to_json()
    assert plain.id != cut.id
    (mesh,) = cut.robot.meshes  # type: ignore[attr-defined]
    pieces = mesh.pieces.content
    assert pieces.startswith(b"o piece_0\nv ")
    assert cut.files()[PREFIX + keep(pieces)] == pieces
    before, after = plain.robot.build(), cut.robot.build()  # type: ignore[attr-defined]
    names = [[item.name for item in each.geometry.geometryObjects] for each in (before, after)]
    assert names[0] == names[1]
    hand = [each.geometry.geometryObjects[6] for each in (before, after)]
    assert isinstance(hand[1].geometry, coal.Convex)
    assert hand[0].placement == hand[1].placement and hand[0].parentJoint == hand[1].parentJoint
    # the OBJ's scale in the URDF holds for its pieces
    hand[0].geometry.computeLocalAABB()
    hand[1].geometry.computeLocalAABB()
    assert hand[1].geometry.aabb_radius == pytest.approx(hand[0].geometry.aabb_radius, rel=1e-9)


@pytest.mark.parametrize(
    "content",
    [b"", b"v 0 0 0", b"o piece_0\nv 0 0\n", b"o a\nv 0 0 0\nf 1 2 3\n", b"\xff", b"o a\no b\n"],
)
def test_damaged_pieces_are_refused(content: bytes) -> None:
    with pytest.raises(SettingError, match="test: must be pieces of a mesh"):
        read_pieces(content, ONE, "test")
