"""Configurations of a planar arm among ellipses, as planners of straight edges ask for them."""

import numpy as np

from evoexp.collision.models.link_ellipses import EllipseCollision
from evoexp.numeric.elementary import DEGREE
from evoexp.records import BoolArray, FloatArray


class EllipseConfigurations:
    """The model of Lavoie & Boudreau 2001 at single configurations, without chords."""

    def __init__(self, collision: EllipseCollision) -> None:
        """Take the model of paths."""
        self._collision = collision._replace(num_positions=1, chords=False)

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations (N, count) [deg] collide, (count,)."""
        angles = np.ascontiguousarray(DEGREE * q)
        return self._collision.collide(angles, angles)

    def any_collides(self, q: FloatArray) -> bool:
        """Whether any of the configurations (N, count) [deg] collides."""
        return bool(self.collides(q).any())
