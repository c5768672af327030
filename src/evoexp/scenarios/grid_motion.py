"""A start and a goal on an occupancy grid, which may come out of a file: text or PNG."""

import io
import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evoexp.attachments import File
from evoexp.errors import SettingError, demand
from evoexp.scenarios.obstacles import BoxObstacle
from evoexp.validation import Component, Count, NonNegative, Positive

Node = Annotated[tuple[int, ...], Field(min_length=2, max_length=3)]
Corners = Annotated[tuple[int, ...], Field(min_length=4, max_length=6)]

BLOCKED, FREE, COMMENT = "*#", "+.", ";"
_PNG = b"\x89PNG\r\n\x1a\n"
MOST_NODES = 20_000_000  # of a grid: one of 4000 × 4000, or 250 × 250 × 250
POST = 0.02  # [cell] thickness of bodies that span one node: a box has some


class GridMotion(Component):
    """A path over a grid whose nodes are one length unit apart (Chen & Zalzala 1995, section 2)."""

    # how many nodes there are along x, y[, z]
    size: Annotated[tuple[Count, ...], Field(min_length=2, max_length=3)]
    start: Node  # node (x, y[, z]), counted from 0; y points up
    goal: Node  # node
    # of what stands on the floor, where the grid is two-dimensional [length unit]
    obstacle_height: Positive
    security_margin: NonNegative  # clearance between bodies that the task requires [length unit]
    length_unit: str  # name of the unit that nodes are apart
    # blocks of nodes from (x0, y0[, z0]) to (x1, y1[, z1]), both included: x0, y0, x1, y1
    obstacles: tuple[Corners, ...] = ()
    map: File | None = None  # A file with more obstacles, see `read_map`

    def _check(self) -> None:
        if math.prod(self.size) > MOST_NODES:
            raise SettingError("size", f"of at most {MOST_NODES:,} nodes", list(self.size))
        inside = " × ".join(f"0..{count - 1}" for count in self.size)
        for name in ("start", "goal"):
            node = getattr(self, name)
            is_inside = len(node) == len(self.size) and self._are_nodes(node, node)
            demand(is_inside, name, f"a node inside the grid ({inside})", list(node))
        demand(self.start != self.goal, "goal", "another node than start", list(self.goal))
        half = len(self.size)
        for k, corners in enumerate(self.obstacles):
            must = f"from a lower to an upper corner inside the grid ({inside})"
            if len(corners) != 2 * half:
                must = f"two corners, {2 * half} numbers"
            elif self._are_nodes(corners[:half], corners[half:]):
                continue
            raise SettingError(f"obstacles[{k}]", must, list(corners))

    def _are_nodes(self, low: tuple[int, ...], high: tuple[int, ...]) -> bool:
        return all(0 <= a <= b < n for a, b, n in zip(low, high, self.size, strict=True))

    def blocked(self) -> np.ndarray:
        """Return which nodes belong to obstacles, (nodes along x, along y[, along z])."""
        nodes, half = np.zeros(self.size, dtype=bool), len(self.size)
        if self.map is not None:
            nodes |= read_map(self.map.content, self.size, "scenario.map")
        for corners in self.obstacles:
            nodes[_block(corners[:half], corners[half:])] = True
        for name in ("start", "goal"):
            node = getattr(self, name)
            must = "a free node; an obstacle is there"
            demand(not nodes[node], f"scenario.{name}", must, list(node))
        return nodes

    def bodies(self) -> tuple[BoxObstacle, ...]:
        """Return obstacles as boxes that span the centres of their nodes, in the plane on a floor.

        Grown by half a cell, they would touch the moves past their corners, which are permitted.
        """
        half = len(self.size)
        corners = [(each[:half], each[half:]) for each in self.obstacles]
        if self.map is not None:
            corners += blocks(read_map(self.map.content, self.size, "scenario.map"))
        boxes = []
        for low, high in np.array(corners, dtype=float).reshape(-1, 2, half):
            size, center = np.maximum(high - low, POST).tolist(), (0.5 * (low + high)).tolist()
            if half == 2:
                size, center = [*size, self.obstacle_height], [*center, 0.5 * self.obstacle_height]
            boxes.append(BoxObstacle(shape="box", center=tuple(center), size=tuple(size)))
        return tuple(boxes)


def _block(low: Sequence[int], high: Sequence[int]) -> tuple[slice, ...]:
    """Return the nodes from a lower to an upper corner, both included, as an index."""
    return tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))


def blocks(nodes: np.ndarray) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return blocks of nodes (lower corner, upper corner) that together cover exactly a set.

    Blocks may overlap. Where blocks meet, a slit of one cell may stay open between the bodies that
    span their centres; it leads nowhere, because paths go over free nodes.
    """
    corners = []
    for axis in range(nodes.ndim):  # the longest run along an axis, then as wide as it stays full
        order = [axis, *(other for other in range(nodes.ndim) if other != axis)]
        covered = np.zeros(nodes.shape, dtype=bool)
        for node in np.argwhere(nodes).tolist():
            if covered[tuple(node)]:
                continue
            high = list(node)
            for along in order:
                while high[along] + 1 < nodes.shape[along]:
                    high[along] += 1
                    if not nodes[_block(node, high)].all():
                        high[along] -= 1
                        break
            covered[_block(node, high)] = True
            corners.append((tuple(node), tuple(high)))
    return list(dict.fromkeys(corners))


def read_map(content: bytes, size: tuple[int, ...], field: str) -> np.ndarray:
    """Return the occupancy grid that a file holds.

    A text has one line per y, the greatest y first, as one looks at a map: `*` or `#` for a blocked
    node, `+` or `.` for a free one, blanks between them at will; `;` begins a comment. In three
    dimensions there is one such block of lines per z, the least z first, with an empty line between
    blocks. A PNG (two dimensions) has one pixel per node, black for a blocked one, white for a free
    one.

    Returns:
        (nodes along x, along y[, along z]), true for blocked nodes.
    """
    is_png = content.startswith(_PNG)
    layers = _read_png(content, size, field)[None] if is_png else _read_text(content, field)
    blocked = layers[:, ::-1, :].transpose(2, 1, 0)  # (x, y, z)
    blocked = blocked[:, :, 0] if len(size) == 2 and blocked.shape[2] == 1 else blocked
    _check_size(size, blocked.shape, field)
    return np.ascontiguousarray(blocked)


def _read_text(content: bytes, field: str) -> np.ndarray:
    """Return layers (z, rows, columns)."""
    try:
        lines = [line for line in content.decode().splitlines() if line[:1] != COMMENT]
    except UnicodeDecodeError:
        raise SettingError(field, "a text or a PNG", "neither") from None
    blocks: list[list[str]] = [[]]
    for number, line in enumerate(lines, 1):
        row = "".join(line.partition(COMMENT)[0].split())
        if wrong := next((letter for letter in row if letter not in BLOCKED + FREE), ""):
            must = f"a map of {' or '.join(BLOCKED)} (blocked) and {' or '.join(FREE)} (free)"
            raise SettingError(field, must, f"{wrong} in row {number}")
        if row:
            blocks[-1].append(row)
        elif blocks[-1]:
            blocks.append([])
    blocks = [block for block in blocks if block]
    lengths = {len(row) for block in blocks for row in block}
    if len(lengths) != 1 or len({len(block) for block in blocks}) != 1:
        raise SettingError(field, "a map whose rows are equally long", sorted(lengths) or "empty")
    return np.array([[[letter in BLOCKED for letter in row] for row in block] for block in blocks])


def _read_png(content: bytes, size: tuple[int, ...], field: str) -> np.ndarray:
    """Return rows (rows, columns); a picture of another size is not unpacked."""
    from PIL import Image  # only pictures need it

    try:
        opened: Any = Image.open(io.BytesIO(content), formats=("PNG",))
        _check_size(size, opened.size, field)
        picture: Any = opened.convert("L")
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise SettingError(field, "a PNG that can be read", str(error)) from None
    pixels = np.asarray(picture)
    if wrong := sorted({int(value) for value in np.unique(pixels)} - {0, 255}):
        must = "a PNG of black (blocked) and white (free) pixels"
        raise SettingError(field, must, f"grey {wrong[0]}")
    return np.asarray(pixels == 0)


def _check_size(size: tuple[int, ...], was: tuple[int, ...], field: str) -> None:
    expected, counts = (" × ".join(map(str, shape)) for shape in (size, was))
    demand(was == tuple(size), field, f"a map of {expected} nodes, as scenario.size says", counts)
