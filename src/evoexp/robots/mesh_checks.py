"""Meshes are looked at before coal reads them, and compared with the file afterwards.

coal's loader (3.0.3) adds up the vertices of the parts of a mesh, but not always the numbers by
which their triangles name them: triangles of several materials in one OBJ object, or of several
lists in one node of a DAE, end in the vertices of the first part.
"""

import re
import tempfile
from pathlib import Path
from typing import Any

import coal
import numpy as np

from evoexp.attachments import MESHES
from evoexp.errors import SettingError
from evoexp.input_files import stand_in
from evoexp.records import IntArray

PARTED = (".obj", ".dae")  # endings of meshes with parts
BINARY = 84  # [B] of a binary STL before its triangles
TRIANGLE = np.dtype([("numbers", "<f4", 12), ("attribute", "<u2")])  # of a binary STL
# a vertex that is no number, in files of text
NOT_FINITE = {
    ".obj": re.compile(rb"^\s*v\b[^\n]*?[-+\s](?:nan|inf)", re.IGNORECASE | re.MULTILINE),
    ".stl": re.compile(rb"\bvertex\b[^\n]*?[-+\s](?:nan|inf)", re.IGNORECASE),
    ".dae": re.compile(rb"<float_array[^>]*>[^<]*?(?<![a-z])(?:nan|inf)", re.IGNORECASE),
    ".ply": re.compile(rb"^[-+\d.e \t]*[-+\s](?:nan|inf)", re.IGNORECASE | re.MULTILINE),
}
# in an OBJ: several materials; lines that are indented, in capitals or continued, which are lost
PECULIAR = re.compile(
    rb"\busemtl\b.*\n(?s:.*)\busemtl\b|^[ \t]+[fv][ \t]|^[FV][ \t]|\\\r?$", re.MULTILINE
)
# of a DAE: two of these are one list of triangles, and its instance
DAE_PARTS = re.compile(
    rb"<(?:triangles|polylist|polygons|tristrips|trifans|instance_geometry|instance_node)\b"
)
DAE_UNIT = re.compile(rb"<unit\s[^>]*\bmeter\s*=\s*[\"']([^\"']*)")


def whole_mesh(content: bytes, name: str, field: str) -> bytes:
    """Check a mesh's file, and write it anew if coal would join its triangles to other vertices."""
    ending = Path(name).suffix.lower()
    reason = stand_in(content) or _damage(content, ending)
    if not reason and ending == ".obj" and PECULIAR.search(content):
        plain = _one_part(content)
        content = content if _same(content, plain, name, field) else plain
    several = ending == ".dae" and len(DAE_PARTS.findall(content)) > 2
    if not reason and several and unused_vertices(load(content, name, field)):
        reason = "parts whose triangles coal joins to other vertices (save it as one mesh, an STL)"
    if reason:
        raise SettingError(field, "a URDF whose meshes can be read", f"'{name}': {reason}")
    return content


def _same(content: bytes, plain: bytes, name: str, field: str) -> bool:
    """Whether coal reads as much of an OBJ as of its vertices and faces alone."""
    try:
        mesh, other = (load(text, name, field) for text in (content, plain))
    except SettingError:
        return False
    return not unused_vertices(mesh) and mesh.num_tris == other.num_tris


def mesh_shape(
    content: bytes, name: str, scale: tuple[float, ...], field: str, *, hull: bool
) -> Any:
    """Return a mesh as a coal shape of triangles, or as its convex hull."""
    mesh, reason = load(content, name, field, scale), ""
    if not np.isfinite(mesh.vertices()).all():
        reason = "a vertex that is no finite number"
    elif not hull and name.lower().endswith(PARTED) and (count := unused_vertices(mesh)):
        reason = f"{count} of {mesh.num_vertices} vertices end in no triangle"
    if reason:
        raise SettingError(field, "a URDF whose meshes can be read", f"'{name}': {reason}")
    if hull:
        mesh.buildConvexRepresentation(True)
        return mesh.convex
    return mesh


def load(content: bytes, name: str, field: str, scale: tuple[float, ...] = (1.0, 1.0, 1.0)) -> Any:
    """Load a mesh by coal, as a model of triangles; the ending of its name tells the format."""
    ending = Path(name).suffix.lower()
    if ending not in MESHES:
        raise SettingError(field, f"of meshes that end in {', '.join(MESHES)}", name)
    with tempfile.TemporaryDirectory() as directory:
        place = Path(directory) / f"mesh{ending}"
        place.write_bytes(content)
        try:
            return coal.MeshLoader().load(str(place), np.array(scale))
        except (ValueError, RuntimeError) as error:
            reason = str(error).replace(directory, "").strip().splitlines()
    # coal says where in its own source it stopped, then what it could not load, then why
    why = [line for line in reason if not line.startswith(("From file", "in function", "at line"))]
    why = [line for line in why if "Could not load resource" not in line] or reason
    was = f"'{name}': {why[0].removeprefix('message: ').rstrip('.')}"
    raise SettingError(field, "a URDF whose meshes can be read", was) from None


def triangles_of(mesh: Any) -> IntArray:
    """Return the triangles (triangles, 3) of a coal mesh, as numbers of its vertices."""
    faces = [mesh.tri_indices(k) for k in range(mesh.num_tris)]
    return np.array([[f[0], f[1], f[2]] for f in faces], dtype=np.int64).reshape(-1, 3)


def unused_vertices(mesh: Any) -> int:
    """Count the vertices of a coal mesh that no triangle ends in: coal's loader leaves none."""
    return int(mesh.num_vertices) - len(np.unique(triangles_of(mesh)))


def unit_of(content: bytes, name: str) -> float:
    """Read the unit of a mesh's file [m]: 1, unless it is a DAE that gives another."""
    found = DAE_UNIT.search(content) if name.lower().endswith(".dae") else None
    try:
        return 1.0 if found is None else float(found[1])
    except ValueError:
        return 1.0


def _damage(content: bytes, ending: str) -> str:
    """Tell why a file is no mesh; empty: it may be one."""
    if ending not in NOT_FINITE:
        return f"its name does not end in {', '.join(NOT_FINITE)}"
    if ending == ".stl":
        is_text = content.lstrip()[:5].lower() == b"solid"
        count, rest = int.from_bytes(content[80:BINARY], "little"), len(content) - BINARY
        if rest == count * TRIANGLE.itemsize and count:
            numbers = np.frombuffer(content, TRIANGLE, offset=BINARY)["numbers"]
            return "" if np.isfinite(numbers[:, 3:]).all() else "a vertex that is no finite number"
        if not is_text:
            follow = f"{max(rest, 0) / TRIANGLE.itemsize:g} follow"
            return f"its header tells {count} triangles, {follow}" if rest >= 0 else "no STL"
        if not re.search(rb"\bfacet\b", content):
            return "no triangles"
    if ending == ".obj" and not re.search(rb"^\s*[fF]\s", content, re.MULTILINE):
        return "no triangles"
    return "a vertex that is no finite number" if NOT_FINITE[ending].search(content) else ""


def _one_part(content: bytes) -> bytes:
    """Leave the vertices of an OBJ file and its faces, without materials, objects and normals."""
    lines = []
    for line in re.sub(rb"\\\r?\n", b" ", content).splitlines():
        kind, *words = line.lower().split() or [b""]
        if kind == b"v":
            lines.append(b" ".join([kind, *words[:3]]))
        elif kind == b"f":
            lines.append(b" ".join([kind, *(word.partition(b"/")[0] for word in words)]))
    return b"\n".join([*lines, b""])
