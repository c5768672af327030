"""Spheres and capsules fixed to the joints of a model, and the bodies that they make up."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from evoexp.records import BoolArray, FloatArray, IntArray

Pairs = Iterable[tuple[int, int]]


class Shapes(NamedTuple):
    """Capsules fixed to the joints of a model; those whose ends coincide are spheres."""

    joint: IntArray  # (shapes,) index of the Pinocchio joint that moves each; 0 for the world
    start: FloatArray  # (shapes, 3) one end, or the centre, in the joint's frame [length unit]
    end: FloatArray  # (shapes, 3) the other end
    radius: FloatArray  # (shapes,) at least 0
    # (shapes,) number of the body that each belongs to; None: all shapes of one joint are one body,
    # whose number is the joint's
    body: IntArray | None = None

    @property
    def labels(self) -> IntArray:
        """(shapes,) number of the body that each belongs to."""
        return self.joint if self.body is None else self.body

    def of(self, chosen: BoolArray) -> "Shapes":
        """Return some of the shapes, with the numbers of their bodies."""
        every = self._replace(body=self.labels)
        return Shapes(*(np.asarray(column)[chosen] for column in every))

    @classmethod
    def joined(cls, parts: Iterable["Shapes"]) -> "Shapes":
        """Return the shapes of several bodies together, with the numbers of their bodies."""
        columns = zip(*(part._replace(body=part.labels) for part in parts), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    def checked(self, model: Any) -> "Shapes":
        """Return the shapes as arrays of the right types.

        Raises:
            ValueError: If arrays do not fit each other or the model, or a radius is negative.
        """
        joint, body = (np.asarray(column, dtype=np.int64) for column in (self.joint, self.labels))
        start, end, radius = (np.asarray(column, dtype=np.float64) for column in self[1:4])
        if joint.ndim != 1 or len(joint) == 0:
            raise ValueError(
                f"shapes.joint must have shape (shapes,) with one shape at least, was {joint.shape}"
            )
        for name, points in (("start", start), ("end", end)):
            if points.shape != (len(joint), 3) or not np.isfinite(points).all():
                raise ValueError(
                    f"shapes.{name} must be finite, of shape ({len(joint)}, 3), was {points.shape}"
                )
        if radius.shape != joint.shape or not np.all((radius >= 0.0) & np.isfinite(radius)):
            raise ValueError(
                f"shapes.radius must be finite, at least 0, of shape {joint.shape}, was "
                f"{radius.tolist()}"
            )
        if joint.min() < 0 or joint.max() >= model.njoints:
            raise ValueError(
                f"shapes.joint must be joints of the model, 0 to {model.njoints - 1}, was "
                f"{joint.tolist()}"
            )
        if body.shape != joint.shape:
            raise ValueError(f"shapes.body must have shape {joint.shape}, was {body.shape}")
        return Shapes(joint, start, end, radius, body)


def default_pairs(model: Any, joints: Iterable[int]) -> tuple[tuple[int, int], ...]:
    """Return all pairs of different joints of which neither is the other's parent."""
    own = sorted({int(joint) for joint in joints})
    apart = ((a, b) for k, a in enumerate(own) for b in own[k + 1 :])
    return tuple((a, b) for a, b in apart if model.parents[b] != a and model.parents[a] != b)


def arms_of_joints(model: Any) -> tuple[int, ...]:
    """Return the arm of each joint, the world's being −1: a tree that starts at the world each."""
    arms, count = [-1], 0
    for joint in range(1, model.njoints):
        root = model.parents[joint] == 0
        arms.append(count if root else arms[model.parents[joint]])
        count += root
    return tuple(arms)
