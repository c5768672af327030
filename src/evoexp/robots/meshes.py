"""Meshes of collision bodies: their files are checked, and cut into convex pieces.

They are looked at before coal reads them, and compared with the file afterwards:
coal's loader (3.0.3) adds up the vertices of the parts of a mesh, but not always the numbers by
which their triangles name them: triangles of several materials in one OBJ object, or of several
lists in one node of a DAE, end in the vertices of the first part.

Convex pieces of a mesh are found once, when a robot's files are read, and contain its whole
surface: where CoACD's pieces leave a part of it out, they are grown until they hold it. They are
kept as an OBJ file of one object per piece, which is attached to the condition; whoever has it
needs neither the library nor the time.
"""

import hashlib
import re
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import coal
import numpy as np

from evoexp.attachments import MESHES
from evoexp.errors import SettingError, demand
from evoexp.input_files import stand_in
from evoexp.numeric.cache_folder import cache_root, kept
from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.elementary import matrix_product
from evoexp.records import FloatArray, IntArray

Decomposition = Literal["coacd", "hulls"]
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
MOST_PIECES = 64  # of a mesh
CONCAVITY = 0.05  # [-] of the mesh's size, assumed: CoACD's own default
SEARCH = {"mcts_nodes": 10, "mcts_iterations": 60, "resolution": 1000}  # assumed: half its defaults
CLOSE = 0.002  # [-] of the mesh's size: a triangle so close to a piece is taken into it whole
SHORT = 0.02  # [-] of the mesh's size: triangles so small are not cut any more
MOST_AT_ONCE = 2000  # triangles that are compared with a piece's faces


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
    demand(not reason, field, "a URDF whose meshes can be read", f"'{name}': {reason}")
    return content


def _same(content: bytes, plain: bytes, name: str, field: str) -> bool:
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
    demand(ending in MESHES, field, f"of meshes that end in {', '.join(MESHES)}", name)
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


def mesh_pieces(content: bytes, ending: str, how: Decomposition, field: str) -> bytes:
    """Cut the mesh of a file whose name has an ending into convex pieces; return an OBJ file."""
    if how == "hulls":
        return _written([loaded_mesh(content, ending, field)[0]], field)
    try:
        import coacd  # an extra: only those who cut meshes need it
    except ImportError:
        must = "hulls, or coacd with it installed (pip install 'evoexp[meshes]')"
        raise SettingError(field, must, "coacd") from None
    key = hashlib.sha256(content)
    key.update(repr((ending, CONCAVITY, SEARCH, CLOSE, SHORT, version("coacd"))).encode())

    def cut() -> bytes:
        corners, triangles = loaded_mesh(content, ending, field)
        coacd.set_log_level("error")
        mesh, most = coacd.Mesh(corners, triangles), MOST_PIECES
        found = coacd.run_coacd(mesh, threshold=CONCAVITY, max_convex_hull=most, **SEARCH)
        return _written(_grown([points for points, _ in found], corners, triangles), field)

    return kept(cache_root() / "pieces" / f"{key.hexdigest()}.obj", cut)


def loaded_mesh(content: bytes, ending: str, field: str) -> tuple[FloatArray, IntArray]:
    """Return the corners (corners, 3) and triangles (triangles, 3) of a mesh's file."""
    mesh = load(content, f"mesh{ending}", field)
    corners = np.asarray(mesh.vertices(), dtype=np.float64).reshape(-1, 3)
    return corners, triangles_of(mesh)


def read_pieces(content: bytes, scale: FloatArray, field: str) -> list[Any]:
    """Return the pieces of an OBJ file that `mesh_pieces` wrote, scaled (3,), as coal shapes."""
    pieces: list[tuple[list[list[float]], list[list[int]]]] = []
    try:
        for line in content.decode("ascii").splitlines():
            kind, *words = line.split()
            if kind == "o":
                pieces.append(([], []))
            elif kind == "v":
                x, y, z = map(float, words)
                pieces[-1][0].append([x, y, z])
            elif kind == "f":
                before = sum(len(corners) for corners, _ in pieces[:-1])
                a, b, c = (int(word) - 1 - before for word in words)
                pieces[-1][1].append([a, b, c])
            else:
                raise ValueError(kind)
        if not 0 < len(pieces) <= MOST_PIECES:
            raise ValueError(len(pieces))
        return [convex_shape(np.array(corners) * scale, faces) for corners, faces in pieces]
    except (ValueError, IndexError, UnicodeDecodeError):
        raise SettingError(field, "pieces of a mesh", content[:40]) from None


def convex_shape(corners: FloatArray, faces: Sequence[Sequence[int]] | IntArray) -> Any:
    """Return a convex coal shape of corners (corners, 3) and triangles (3), turned outward."""
    if len(corners) < 4 or not np.isfinite(corners).all() or len(faces) < 4:
        raise ValueError
    if min(map(min, faces)) < 0 or max(map(max, faces)) >= len(corners):
        raise ValueError
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in corners:
        points.append(corner)
    for face in faces:
        triangles.append(coal.Triangle(*map(int, face)))
    return coal.Convex(points, triangles)


def _written(pieces: list[FloatArray], field: str) -> bytes:
    """Return the convex hulls of pieces as an OBJ file; those without an inside are left out."""
    lines: list[str] = []
    before = number = 0
    for hull in filter(None, map(hull_of, pieces)):
        corners, triangles = hull
        lines.append(f"o piece_{number}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (triangles + (1 + before)).tolist()]
        before, number = before + len(corners), number + 1
    demand(lines, field, "left out for meshes without an inside", "coacd or hulls")
    return ("\n".join(lines) + "\n").encode()


def _grown(pieces: list[FloatArray], corners: FloatArray, faces: IntArray) -> list[FloatArray]:
    """Return pieces to whose hulls corners are added until they contain all triangles of a mesh.

    A triangle belongs to the piece from which it stands out the least; one that stands out of all
    by more than `CLOSE` is cut in two, as long as its longest edge is not `SHORT`.
    """
    from scipy.spatial import ConvexHull  # only meshes need it, and it loads for long

    size = float((corners.max(axis=0) - corners.min(axis=0)).max())
    planes = [ConvexHull(points).equations for points in pieces]
    added: list[list[FloatArray]] = [[points] for points in pieces]
    waiting = corners[faces]  # (triangles, 3, 3)
    while len(waiting) > 0:
        now, waiting = waiting[:MOST_AT_ONCE], waiting[MOST_AT_ONCE:]
        out = np.array(
            [(matrix_product(now, each[:, :3].T) + each[:, 3]).max(axis=(1, 2)) for each in planes]
        )  # (pieces, triangles): by how much they stand out
        best = out.argmin(axis=0)
        least = out[best, np.arange(len(now))]
        edges = ((now - np.roll(now, -1, axis=1)) ** 2).sum(axis=2)
        longest = edges.argmax(axis=1)
        whole = (least <= CLOSE * size) | (edges.max(axis=1) <= (SHORT * size) ** 2)
        for piece in np.unique(best[whole]).tolist():
            taken = whole & (best == piece) & (least > 0.0)
            added[piece].append(now[taken].reshape(-1, 3))
        cut, first = now[~whole], longest[~whole]
        a, b, c = (cut[np.arange(len(cut)), (first + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        waiting = np.concatenate([*halves, waiting])
    return [np.unique(np.vstack(points), axis=0) for points in added]
