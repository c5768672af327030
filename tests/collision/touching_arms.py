"""Robots that tests of touching spheres share."""

from evoexp.robots.arms import Arms
from evoexp.robots.planar_chain import PlanarChain
from evoexp.robots.serial_chain import SerialChain, SerialJoint


def elbow(base: tuple[float, float, float]) -> SerialChain:
    """Return a spatial 3R arm, for the kernel in space."""
    waist = SerialJoint(axis=(0.0, 0.0, 1.0), offset=(0.0, 0.0, 0.0))
    shoulder = SerialJoint(axis=(0.0, 1.0, 0.0), offset=(0.0, 0.0, 1.0))
    joints = (waist, shoulder, SerialJoint(axis=(0.0, 1.0, 0.0), offset=(1.5, 0.0, 0.0)))
    return SerialChain(joints=joints, tip=(1.2, 0.1, 0.0), base_position=base)


TWO_PLANAR = Arms(
    arms=(
        PlanarChain(link_lengths=(4.0, 4.0), base_position=(0.0, 0.0)),
        PlanarChain(link_lengths=(4.0, 4.0), base_position=(0.0, 8.0), base_angle=20.0),
    )
)
THREE_PLANAR = Arms(
    arms=(*TWO_PLANAR.arms, PlanarChain(link_lengths=(3.0, 2.0, 2.0), base_position=(9.0, 4.0)))
)
TWO_SPATIAL = Arms(arms=(elbow((0.0, 0.0, 0.0)), elbow((0.0, 2.5, 0.0))))
ONE_PLANAR = PlanarChain(link_lengths=(4.0, 4.0), base_position=(0.0, 4.0))
