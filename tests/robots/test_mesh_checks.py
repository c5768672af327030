"""Meshes are what their files say: against a reader of OBJ that is a page of Python."""

import struct
import sys
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pytest

from coal_shapes import distance, distance_of_point, placed
from evoexp.attachments import PREFIX, File, keep
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots import meshes
from evoexp.robots import meshes as module
from evoexp.robots.urdf import Urdf
from robots.robot_samples import task, urdf_of

# two triangles far from one another, of two materials in one object
MATERIALS = b"""mtllib none.mtl
o both
v 0 0 0
v 1 0 0
v 0 1 0
v 5 0 0
v 6 0 0
v 5 1 0
vn 0 0 1
usemtl one
f 1//1 2//1 3//1
usemtl two
f 4//1 5//1 6//1
l 1 2
"""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def obj_triangles(content: bytes) -> set[tuple[tuple[float, ...], ...]]:
    """Read the triangles of an OBJ file line by line: as sets of corners, turned to the least."""
    corners, found = [], set()
    for line in content.decode().splitlines():
        kind, *words = line.lower().split() or [""]
        if kind == "v":
            corners.append(tuple(float(np.float32(word)) for word in words[:3]))
        elif kind == "f":
            face = [int(word.split("/")[0]) for word in words]
            face = [k - 1 if k > 0 else len(corners) + k for k in face]
            for b, c in zip(face[1:-1], face[2:], strict=True):
                found.add(turned([corners[k] for k in (face[0], b, c)]))
    return found


def turned(corners: list[tuple[float, ...]]) -> tuple[tuple[float, ...], ...]:
    first = corners.index(min(corners))
    return tuple(corners[first:] + corners[:first])


def built_triangles(mesh: Any) -> set[tuple[tuple[float, ...], ...]]:
    vertices = np.asarray(mesh.vertices())
    return {
        turned([tuple(vertices[k].tolist()) for k in face]) for face in meshes.triangles_of(mesh)
    }


def test_triangles_of_several_materials_end_where_the_file_says() -> None:
    """coal's loader, and with it Pinocchio's, joins those of the second to the first's vertices."""
    read_by_coal = meshes.load(MATERIALS, "a.obj", "")
    assert meshes.unused_vertices(read_by_coal) == 3
    assert built_triangles(read_by_coal) != obj_triangles(MATERIALS)
    mended = meshes.load(meshes.whole_mesh(MATERIALS, "a.obj", "robot.path"), "a.obj", "")
    assert meshes.unused_vertices(mended) == 0
    assert built_triangles(mended) == obj_triangles(MATERIALS)


LAST_FACE = b"f 4//1 5//1 6//1"
VARIANTS = {
    "one material": MATERIALS.replace(b"usemtl two\n", b""),
    "objects": MATERIALS.replace(b"usemtl two", b"o second"),
    "numbers from the end": MATERIALS.replace(LAST_FACE, b"f -3 -2 -1"),
    "a quadrangle": MATERIALS.replace(LAST_FACE, b"f 4 5 6 2"),
    "a line continued": MATERIALS.replace(LAST_FACE, b"f 4 5 \\\n6"),
    "an indented face": MATERIALS.replace(b"usemtl two\nf 4", b"  f 4"),
    "a capital": MATERIALS.replace(b"usemtl two\nf 4", b"F 4"),
    "indented vertices": MATERIALS.replace(b"v 5", b" v 5").replace(b"\n", b"\r\n"),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_files_of_objects_are_read_like_by_the_slow_reader(name: str) -> None:
    mesh = meshes.load(meshes.whole_mesh(VARIANTS[name], "a.obj", "robot.path"), "a.obj", "")
    expected = obj_triangles(VARIANTS[name].replace(b"\\\n", b""))
    areas = [
        sum(np.linalg.norm(np.cross(np.subtract(b, a), np.subtract(c, a))) for a, b, c in triangles)
        for triangles in (built_triangles(mesh), expected)
    ]
    assert meshes.unused_vertices(mesh) == 0 and areas[0] == pytest.approx(areas[1])


DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"
 version="1.4.1"><asset><unit name="u" meter="{unit}"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g" name="g"><mesh><source id="p"><float_array id="pa" count="18">
0 0 0 1 0 0 0 1 0 5 0 0 6 0 0 5 1 0</float_array><technique_common><accessor source="#pa" count="6"
 stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z"
 type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION"
 source="#p"/></vertices>{lists}</mesh></geometry></library_geometries><library_visual_scenes>
<visual_scene id="s" name="s"><node id="n" name="n" type="NODE"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def triangles(*lists: str) -> str:
    return "".join(
        f'<triangles count="{len(words.split()) // 3}"><input semantic="VERTEX" source="#v" '
        f'offset="0"/><p>{words}</p></triangles>'
        for words in lists
    )


def binary_stl(told: int, numbers: FloatArray) -> bytes:
    rows = [struct.pack("<12fH", 0.0, 0.0, 1.0, *map(float, row), 0) for row in numbers]
    return b"x" * 80 + struct.pack("<I", told) + b"".join(rows)


ROW = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]])
TEXT_STL = (
    b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    b"endloop\nendfacet\nendsolid a\n"
)
PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n"
NO_NUMBER = "a vertex that is no finite number"


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        *((f"m.{ending}", LFS, "a Git-LFS pointer") for ending in ("stl", "obj", "dae", "ply")),
        ("m.stl", b"\n <!DOCTYPE html><html>", "an HTML page in the file's place"),
        ("m.dae", b"<html><body/></html>", "an HTML page in the file's place"),
        ("m.ply", b"", "an empty file"),
        ("m.stl", binary_stl(3, np.repeat(ROW, 2, 0)), "its header tells 3 triangles, 2 follow"),
        ("m.stl", binary_stl(1, np.repeat(ROW, 2, 0)), "its header tells 1 triangles, 2 follow"),
        ("m.stl", binary_stl(0, ROW[:0]), "its header tells 0 triangles, 0 follow"),
        ("m.stl", binary_stl(1, np.where(ROW == 1.0, np.nan, ROW)), NO_NUMBER),
        ("m.stl", b"abc", "no STL"),
        ("m.stl", b"solid a\nendsolid a\n", "no triangles"),
        ("m.stl", TEXT_STL.replace(b"vertex 1 0", b"vertex 1 -NaN"), NO_NUMBER),
        ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangles"),
        ("m.obj", TETRAHEDRON.replace("v 1 0", "v nan 0").encode(), NO_NUMBER),
        ("m.obj", TETRAHEDRON.replace("v 1 0", "v 1 inf").encode(), NO_NUMBER),
        ("m.ply", PLY.replace(b"1 0 0", b"1 nan 0"), NO_NUMBER),
        ("m.dae", DAE.format(unit=1, lists="").replace("5 0 0 6", "5 NaN 0 6").encode(), NO_NUMBER),
        ("m.dae", DAE.format(unit=1, lists=triangles("0 1 2", "3 4 5")).encode(),
         "parts whose triangles coal joins to other vertices (save it as one mesh, an STL)"),
    ],
)  # fmt: skip
def test_a_mesh_that_is_none_is_refused_with_the_reason(
    tmp_path: Path, name: str, content: bytes, reason: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SettingError) as refusal:
        robot(tmp_path, name)
    assert f"'{name}': {reason}" in str(refusal.value)
    assert f"in link 'b' of {tmp_path / 'r.urdf'}" in str(refusal.value)
    assert "\n" not in str(refusal.value) and not capfd.readouterr().err


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("m.stl", binary_stl(2, np.repeat(ROW, 2, 0))),
        ("m.stl", b"solid" + binary_stl(1, ROW)[5:]),
        ("m.STL", TEXT_STL),
        ("m.stl", TEXT_STL + TEXT_STL.replace(b"vertex 1", b"vertex 9")),
        ("m.ply", PLY),
        ("m.obj", b"o info\ng nanna\n" + TETRAHEDRON.encode()),
        ("m.dae", DAE.format(unit=1, lists=triangles("0 1 2 3 4 5")).encode()),
    ],
)
def test_a_mesh_travels_as_it_is(name: str, content: bytes) -> None:
    assert meshes.whole_mesh(content, name, "robot.path") is content
    assert meshes.unused_vertices(meshes.load(content, name, "")) == 0


def robot(folder: Path, name: str, scale: str = "", **settings: Any) -> Urdf:
    body = f'<collision><geometry><mesh {scale} filename="{name}"/></geometry></collision>'
    joint = '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>'
    text = f'<robot name="r"><link name="a"/><link name="b">{body}</link>{joint}</robot>'
    return urdf_of(folder, text, **settings)


def test_a_mesh_that_only_coal_refuses_is_named(tmp_path: Path) -> None:
    """The first of two is whole; coal's own words about its source are left out."""
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    with pytest.raises(SettingError) as refusal:
        robot(tmp_path, "m.obj").build()
    assert "'m.obj': OBJ: vertex index out of range" in str(refusal.value)


def test_meshes_of_a_stored_condition_are_compared_with_the_file(tmp_path: Path) -> None:
    """An earlier version kept the file as it was."""
    (tmp_path / "m.obj").write_bytes(MATERIALS)
    whole = robot(tmp_path, "m.obj")
    assert whole.meshes[0].file.content != MATERIALS
    stored = whole.meshes[0].model_copy(update={"file": File(sha256=keep(MATERIALS))})
    with pytest.raises(SettingError, match=r"'m\.obj': 3 of 6 vertices end in"):
        whole.model_copy(update={"meshes": (stored,)}).build()


def test_a_mirrored_mesh_is_mirrored_as_pieces_too(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(TETRAHEDRON)
    plain, hull = (
        robot(tmp_path, "m.obj", 'scale="1 -2 1"', **settings).build().geometry.geometryObjects[0]
        for settings in ({}, {"decomposition": "hulls"})
    )
    for center in np.random.default_rng(1).uniform([-1, -3, -1], [2, 1, 2], (50, 3)):
        ball = placed(coal.Sphere(0.1), center)
        away = [distance(placed(body.geometry), ball) for body in (plain, hull)]
        assert away[1] <= 0.0 or away[0] == pytest.approx(away[1], abs=1e-6)  # a mesh has no inside


def test_the_unit_of_a_dae_is_a_note(tmp_path: Path) -> None:
    (tmp_path / "cm.dae").write_text(DAE.format(unit=0.01, lists=triangles("0 1 2 3 4 5")))
    (tmp_path / "m.dae").write_text(DAE.format(unit=1, lists=triangles("0 1 2 3 4 5")))
    (note,) = robot(tmp_path, "cm.dae").notes()
    assert "mesh 'cm.dae': its unit is 0.01 m" in note and 'scale="0.01 0.01 0.01"' in note
    assert robot(tmp_path, "m.dae").notes() == []
    (item,) = robot(tmp_path, "cm.dae").build().geometry.geometryObjects
    assert item.geometry.vertices().max() == 6.0


L_PROFILE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]


def angle_iron() -> bytes:
    """A closed L of unit depth, as an OBJ file."""
    lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in L_PROFILE]
    caps = [(1, 2, 3), (1, 3, 4), (1, 4, 5), (1, 5, 6)]
    faces = [(a, c, b) for a, b, c in caps] + [(a + 6, b + 6, c + 6) for a, b, c in caps]
    for a, b in ((k + 1, (k + 1) % 6 + 1) for k in range(6)):
        faces += [(a, b, b + 6), (a, b + 6, a + 6)]
    return "\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in faces)]).encode()


def pieces_of(content: bytes) -> list[coal.Convex]:
    return meshes.read_pieces(content, np.ones(3), "test")


def standing_out(pieces: list[coal.Convex], count: int) -> float:
    """The greatest distance of points of the L from the nearest of some pieces, by coal."""
    bodies = [placed(piece) for piece in pieces]
    corners, triangles = meshes.loaded_mesh(angle_iron(), ".obj", "test")
    rng = np.random.default_rng(2)
    a, b, c = corners[triangles].transpose(1, 0, 2)
    area = np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1))
    chosen = rng.choice(len(triangles), size=count, p=area / area.sum())
    shares = rng.dirichlet(np.ones(3), count)
    points = np.einsum("pc,pcx->px", shares, corners[triangles][chosen])
    return max(min(distance_of_point(point, body) for body in bodies) for point in points)


def test_the_hull_of_a_mesh_contains_it() -> None:
    pieces = pieces_of(meshes.mesh_pieces(angle_iron(), ".obj", "hulls", "test"))
    assert len(pieces) == 1 and pieces[0].num_points == 5 * 2
    assert standing_out(pieces, 300) < 1e-6


def test_pieces_of_coacd_contain_the_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("coacd")
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path))
    content = meshes.mesh_pieces(angle_iron(), ".obj", "coacd", "test")
    pieces = pieces_of(content)
    assert 2 <= len(pieces) <= 4
    assert standing_out(pieces, 1000) < 1e-6
    # the notch of the L stays free
    notch = placed(coal.Sphere(0.8), [2.0, 2.0, 0.5])
    assert all(distance(notch, placed(piece)) > 0.05 for piece in pieces)
    # the second time they are read from the cache
    monkeypatch.setattr(module, "_grown", None)
    assert meshes.mesh_pieces(angle_iron(), ".obj", "coacd", "test") == content


def test_pieces_that_leave_parts_out_are_grown() -> None:
    """Two boxes that are smaller than the arms of the L, as CoACD's remeshed pieces may be."""
    corners, triangles = meshes.loaded_mesh(angle_iron(), ".obj", "test")
    box = np.array(np.meshgrid((0.02, 0.98), (0.02, 0.98), (0.02, 0.98))).reshape(3, -1).T
    small = [box * [3.0, 1.0, 1.0], box * [1.0, 3.0, 1.0]]
    grown = module._grown(small, corners, triangles)
    before, after = (pieces_of(module._written(points, "test")) for points in (small, grown))
    assert standing_out(before, 500) > 0.01
    assert standing_out(after, 500) < 1e-6
    # no arm grows by more than triangles that are not cut any more: the notch stays free
    assert all(piece.num_points < 500 for piece in after)
    assert max(min(p[0], p[1]) for each in grown for p in each) <= 1.0 + 3.0 * module.SHORT


def test_without_the_library_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "coacd", None)
    must = r"hulls, or coacd with it installed \(pip install 'evoexp\[meshes\]'\), was 'coacd'"
    with pytest.raises(SettingError, match=f"robot.decomposition: must be {must}"):
        task("robot.decomposition=coacd")


def test_pieces_travel_with_the_condition() -> None:
    plain, cut = task(), task("robot.decomposition=hulls")
    assert b"decomposition" not in plain.to_json() and b"pieces" not in plain.to_json()
    assert plain.id != cut.id
    (mesh,) = cut.robot.meshes
    pieces = mesh.pieces.content
    assert pieces.startswith(b"o piece_0\nv ")
    assert cut.files()[PREFIX + keep(pieces)] == pieces
    bodies: list[Any] = [each.robot.build().geometry.geometryObjects for each in (plain, cut)]
    names = [[item.name for item in items] for items in bodies]
    assert names[0] == names[1]
    before, after = (items[6] for items in bodies)
    assert before.geometry.num_vertices == 8 and isinstance(after.geometry, coal.Convex)
    assert before.placement == after.placement and before.parentJoint == after.parentJoint
    # the OBJ's scale in the URDF holds for its pieces
    for item in (before, after):
        item.geometry.computeLocalAABB()
    assert after.geometry.aabb_radius == pytest.approx(before.geometry.aabb_radius, rel=1e-9)


@pytest.mark.parametrize(
    "content",
    [b"", b"v 0 0 0", b"o piece_0\nv 0 0\n", b"o a\nv 0 0 0\nf 1 2 3\n", b"\xff", b"o a\no b\n"],
)
def test_damaged_pieces_are_refused(content: bytes) -> None:
    with pytest.raises(SettingError, match="test: must be pieces of a mesh"):
        pieces_of(content)
