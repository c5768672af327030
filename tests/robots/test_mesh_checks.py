"""Meshes are what their files say: against a reader of OBJ that is a page of Python."""

import struct
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pytest

from evoexp.attachments import File
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots.mesh_checks import load, triangles_of, unused_vertices, whole_mesh
from evoexp.robots.urdf import Urdf

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
PANDA = Path(__file__).parents[2] / "src/evoexp/assets/motionbenchmaker/panda/meshes/collision"


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
    return {turned([tuple(vertices[k].tolist()) for k in face]) for face in triangles_of(mesh)}


def test_triangles_of_several_materials_end_where_the_file_says() -> None:
    """coal's loader, and with it Pinocchio's, joins those of the second to the first's vertices."""
    read_by_coal = load(MATERIALS, "a.obj", "")
    assert unused_vertices(read_by_coal) == 3
    assert built_triangles(read_by_coal) != obj_triangles(MATERIALS)
    mended = load(whole_mesh(MATERIALS, "a.obj", "robot.path"), "a.obj", "")
    assert unused_vertices(mended) == 0
    assert built_triangles(mended) == obj_triangles(MATERIALS)


def test_the_shipped_mesh_is_read_whole_and_with_materials_too() -> None:
    """MotionBenchMaker's own `link6.obj` gives its faces seventeen materials; here, two."""
    plain = (PANDA / "link6.obj").read_bytes()
    assert whole_mesh(plain, "link6.obj", "robot.path") is plain
    expected = obj_triangles(plain)
    assert len(expected) == 1308 and built_triangles(load(plain, "a.obj", "")) == expected
    lines = plain.splitlines()
    faces = [k for k, line in enumerate(lines) if line.startswith(b"f ")]
    for k in (faces[900], faces[0]):
        lines.insert(k, b"usemtl shell_%d" % k)
    painted = b"\n".join(lines)
    assert unused_vertices(load(painted, "a.obj", "")) > 100
    assert built_triangles(load(whole_mesh(painted, "a.obj", ""), "a.obj", "")) == expected


@pytest.mark.parametrize(
    "content",
    [
        MATERIALS.replace(b"usemtl two\n", b""),
        MATERIALS.replace(b"usemtl two", b"o second"),
        MATERIALS.replace(b"f 4//1 5//1 6//1", b"f -3 -2 -1"),
        MATERIALS.replace(b"f 4//1 5//1 6//1", b"f 4 5 6 2"),
        MATERIALS.replace(b"f 4//1 5//1 6//1", b"f 4 5 \\\n6"),
        MATERIALS.replace(b"usemtl two\nf 4", b"  f 4"),
        MATERIALS.replace(b"usemtl two\nf 4", b"F 4"),
        MATERIALS.replace(b"v 5", b" v 5").replace(b"\n", b"\r\n"),
    ],
    ids=[
        *("one material", "objects", "numbers from the end", "a quadrangle", "a line continued"),
        *("an indented face", "a capital", "indented vertices"),
    ],
)
def test_files_of_objects_are_read_like_by_the_slow_reader(content: bytes) -> None:
    mesh = load(whole_mesh(content, "a.obj", "robot.path"), "a.obj", "")
    expected = obj_triangles(content.replace(b"\\\n", b""))
    area = [
        sum(np.linalg.norm(np.cross(np.subtract(b, a), np.subtract(c, a))) for a, b, c in triangles)
        for triangles in (built_triangles(mesh), expected)
    ]
    assert unused_vertices(mesh) == 0 and area[0] == pytest.approx(area[1])


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
    normal = [0.0, 0.0, 1.0]
    rows = [struct.pack("<12fH", *normal, *map(float, row), 0) for row in numbers]
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
        (
            "m.dae",
            DAE.format(unit=1, lists=triangles("0 1 2", "3 4 5")).encode(),
            "parts whose triangles coal joins to other vertices (save it as one mesh, an STL)",
        ),
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
    assert whole_mesh(content, name, "robot.path") is content
    assert unused_vertices(load(content, name, "")) == 0


def robot(folder: Path, name: str, scale: str = "", **settings: Any) -> Urdf:
    (folder / "r.urdf").write_text(
        f'<robot name="r"><link name="a"/><link name="b"><collision><geometry><mesh {scale} '
        f'filename="{name}"/></geometry></collision></link><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/></joint></robot>'
    )
    found = Urdf.read_files({"path": str(folder / "r.urdf"), **settings}, "robot")
    return Urdf.model_validate(found, strict=False)


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
    from evoexp.attachments import keep

    stored = whole.meshes[0].model_copy(update={"file": File(sha256=keep(MATERIALS))})
    with pytest.raises(SettingError, match=r"'m\.obj': 3 of 6 vertices end in"):
        whole.model_copy(update={"meshes": (stored,)}).build()


def test_a_mirrored_mesh_is_mirrored_as_pieces_too(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(TETRAHEDRON)
    rng = np.random.default_rng(1)
    plain, hull = (
        robot(tmp_path, "m.obj", 'scale="1 -2 1"', **settings).build().geometry.geometryObjects[0]
        for settings in ({}, {"decomposition": "hulls"})
    )
    ball = coal.Sphere(0.1)
    for _ in range(50):
        place = coal.Transform3s(np.eye(3), rng.uniform([-1, -3, -1], [2, 1, 2]))
        away = []
        for body in (plain, hull):
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            still = coal.Transform3s.Identity()
            away.append(coal.distance(body.geometry, still, ball, place, request, result))
        if away[1] > 0.0:  # a mesh has no inside
            assert away[0] == pytest.approx(away[1], abs=1e-6)


def test_the_unit_of_a_dae_is_a_note(tmp_path: Path) -> None:
    (tmp_path / "cm.dae").write_text(DAE.format(unit=0.01, lists=triangles("0 1 2 3 4 5")))
    (tmp_path / "m.dae").write_text(DAE.format(unit=1, lists=triangles("0 1 2 3 4 5")))
    (note,) = robot(tmp_path, "cm.dae").notes()
    assert "mesh 'cm.dae': its unit is 0.01 m" in note and 'scale="0.01 0.01 0.01"' in note
    assert robot(tmp_path, "m.dae").notes() == []
    (item,) = robot(tmp_path, "cm.dae").build().geometry.geometryObjects
    assert item.geometry.vertices().max() == 6.0
