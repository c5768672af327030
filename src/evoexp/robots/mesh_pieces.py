"""Meshes as convex pieces, found once, when a robot's files are read.

The pieces of a mesh contain its whole surface: where CoACD's pieces leave a part of it out, they
are grown until they hold it. They are kept as an OBJ file of one object per piece, which is
attached to the condition; whoever has it needs neither the library nor the time.
"""

import contextlib
import hashlib
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any, Literal

import coal
import numpy as np

from evoexp.errors import SettingError, demand
from evoexp.numeric.cache_folder import Damaged, cache_root, read_kept, write_kept
from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.records import FloatArray, IntArray
from evoexp.robots.mesh_checks import load, triangles_of

Decomposition = Literal["coacd", "hulls"]

MOST_PIECES = 64  # of a mesh
CONCAVITY = 0.05  # [-] of the mesh's size, assumed: CoACD's own default
SEARCH = {"mcts_nodes": 10, "mcts_iterations": 60, "resolution": 1000}  # assumed: half its defaults
CLOSE = 0.002  # [-] of the mesh's size: a triangle so close to a piece is taken into it whole
SHORT = 0.02  # [-] of the mesh's size: triangles so small are not cut any more
MOST_AT_ONCE = 2000  # triangles that are compared with a piece's faces


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
    kept = cache_root() / "pieces" / f"{key.hexdigest()}.obj"
    with contextlib.suppress(FileNotFoundError, Damaged):
        return read_kept(kept)
    corners, triangles = loaded_mesh(content, ending, field)
    coacd.set_log_level("error")
    found = coacd.run_coacd(
        coacd.Mesh(corners, triangles), threshold=CONCAVITY, max_convex_hull=MOST_PIECES, **SEARCH
    )
    text = _written(_grown([points for points, _ in found], corners, triangles), field)
    with contextlib.suppress(OSError):  # it takes longer the next time
        write_kept(kept, text)
    return text


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
