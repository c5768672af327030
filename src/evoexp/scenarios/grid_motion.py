"""A start and a goal on an occupancy grid."""

import math
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from evoexp.attachments import File
from evoexp.errors import SettingError
from evoexp.scenarios.grid_maps import read_map
from evoexp.scenarios.obstacles import BoxObstacle
from evoexp.validation import Component, Count, NonNegative, Positive

Node = Annotated[tuple[int, ...], Field(min_length=2, max_length=3)]
Corners = Annotated[tuple[int, ...], Field(min_length=4, max_length=6)]

MOST_NODES = 20_000_000  # of a grid: one of 4000 × 4000, or 250 × 250 × 250
POST = 0.02  # [cell] thickness of bodies that span one node: a box has some


class GridMotion(Component):
    """A path over a grid whose nodes are one length unit apart (Chen & Zalzala 1995, section 2)."""

    component: ClassVar[str] = "grid_motion"

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
    map: File | None = None  # A file with more obstacles, see `grid_maps.read_map`

    @model_validator(mode="after")
    def _nodes_are_inside(self) -> Self:
        if math.prod(self.size) > MOST_NODES:
            raise SettingError("size", f"of at most {MOST_NODES:,} nodes", list(self.size))
        for name in ("start", "goal"):
            self._check_node(name, getattr(self, name))
        if self.start == self.goal:
            raise SettingError("goal", "another node than start", list(self.goal))
        for k, corners in enumerate(self.obstacles):
            half = len(self.size)
            if len(corners) != 2 * half:
                raise SettingError(
                    f"obstacles[{k}]", f"two corners, {2 * half} numbers", list(corners)
                )
            if any(
                not 0 <= a <= b < n
                for a, b, n in zip(corners[:half], corners[half:], self.size, strict=True)
            ):
                raise SettingError(
                    f"obstacles[{k}]",
                    f"from a lower to an upper corner inside the grid ({self.inside})",
                    list(corners),
                )
        return self

    def _check_node(self, name: str, node: tuple[int, ...]) -> None:
        if len(node) != len(self.size) or any(
            not 0 <= a < n for a, n in zip(node, self.size, strict=True)
        ):
            raise SettingError(name, f"a node inside the grid ({self.inside})", list(node))

    @property
    def inside(self) -> str:
        """The nodes in words: "0..31 × 0..31"."""
        return " × ".join(f"0..{count - 1}" for count in self.size)

    def blocked(self) -> np.ndarray:
        """Return which nodes belong to obstacles, (nodes along x, along y[, along z]).

        Raises:
            SettingError: If the map does not fit, or start or goal lies inside an obstacle.
            MissingFile: If the content of the map is nowhere.
        """
        nodes = np.zeros(self.size, dtype=bool)
        if self.map is not None:
            nodes |= read_map(self.map.content, self.size, "scenario.map")
        for corners in self.obstacles:
            nodes[self._slices(corners)] = True
        for name in ("start", "goal"):
            node = getattr(self, name)
            if nodes[node]:
                raise SettingError(
                    f"scenario.{name}", "a free node; an obstacle is there", list(node)
                )
        return nodes

    def bodies(self) -> tuple[BoxObstacle, ...]:
        """Return obstacles as boxes that span the centres of their nodes.

        In two dimensions the boxes stand on the floor. They are not grown by half a cell: then they
        would touch the moves past their corners, which are permitted.
        """
        half = len(self.size)
        found = [(corners[:half], corners[half:]) for corners in self.obstacles]
        if self.map is not None:
            found += blocks(read_map(self.map.content, self.size, "scenario.map"))
        return tuple(
            self._box(np.array(low, dtype=float), np.array(high, dtype=float))
            for low, high in found
        )

    def _box(self, low: np.ndarray, high: np.ndarray) -> BoxObstacle:
        size, center = np.maximum(high - low, POST).tolist(), (0.5 * (low + high)).tolist()
        if len(self.size) == 2:
            size, center = [*size, self.obstacle_height], [*center, 0.5 * self.obstacle_height]
        return BoxObstacle(shape="box", center=tuple(center), size=tuple(size))

    def _slices(self, corners: tuple[int, ...]) -> tuple[slice, ...]:
        half = len(self.size)
        return tuple(slice(a, b + 1) for a, b in zip(corners[:half], corners[half:], strict=True))


def blocks(nodes: np.ndarray) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return blocks of nodes (lower corner, upper corner) that together cover exactly a set.

    Blocks may overlap. Where blocks meet, a slit of one cell may stay open between the bodies that
    span their centres; it leads nowhere, because paths go over free nodes.

    Args:
        nodes: (nodes along x, along y[, along z]).
    """
    found = []
    for axis in range(nodes.ndim):  # the longest run along an axis, then as wide as it stays full
        order = [axis, *(other for other in range(nodes.ndim) if other != axis)]
        covered = np.zeros(nodes.shape, dtype=bool)
        for node in np.argwhere(nodes):
            if covered[tuple(node)]:
                continue
            low, high = node.copy(), node.copy()
            for along in order:
                while high[along] + 1 < nodes.shape[along]:
                    wider = high.copy()
                    wider[along] += 1
                    if not nodes[
                        tuple(slice(a, b + 1) for a, b in zip(low, wider, strict=True))
                    ].all():
                        break
                    high = wider
            covered[tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))] = True
            found.append((tuple(map(int, low)), tuple(map(int, high))))
    return list(dict.fromkeys(found))
