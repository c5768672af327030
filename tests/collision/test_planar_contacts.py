"""Yes and no for circles at equal steps along links, beside the sign of the exact clearance."""

import numpy as np
import pytest

from collision.built_bodies import num_before_contact
from collision.touching_arms import ONE_PLANAR, THREE_PLANAR, TWO_PLANAR, TWO_SPATIAL
from evoexp.collision.bodies.body_collision import leading_free
from evoexp.collision.bodies.planar_contacts import contacts, link_lines
from evoexp.collision.bodies.touching_spheres import SphereCollision, TouchingSpheres
from evoexp.numeric.elementary import DEGREE
from evoexp.robots.arms import Arms
from evoexp.robots.assembly import Robot
from evoexp.robots.planar_chain import PlanarChain

ROBOTS = {
    "two arms": TWO_PLANAR,
    "three arms": THREE_PLANAR,
    "in space": TWO_SPATIAL,
    "alone": ONE_PLANAR,
}


def touching(robot: Robot, spheres: int, radius: float = 0.5) -> SphereCollision:
    model = TouchingSpheres(spheres_per_link=spheres, sphere_radius=radius, collision_substeps=1)
    return model.bind(robot.build(), ())


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("spheres", [1, 2, 5, 11, 200])
@pytest.mark.parametrize("count", [1, 9, 64, 8 * 64 + 5])
def test_circles_at_equal_steps_collide_where_their_clearance_is_negative(
    robot: str, spheres: int, count: int
) -> None:
    collision = touching(ROBOTS[robot], spheres)
    rng = np.random.default_rng(spheres + count)
    nq = len(collision.assembly.table.parent)
    for spread in (180.0, 5.0):
        middle = rng.uniform(-180.0, 180.0, size=(nq, 1))
        q = middle + rng.uniform(-spread, spread, size=(nq, count))
        exact = collision.clearance(q).least
        assert np.abs(exact).min() > 1e-10
        assert np.array_equal(collision.collides(q), exact < 0.0)
        assert num_before_contact(collision.general, DEGREE * q) == leading_free(exact < 0.0)


def test_circles_that_touch_are_measured_exactly() -> None:
    """Two links along y, whose lines are one diameter apart, and a last bit less or more."""
    arms = Arms(
        arms=(
            PlanarChain(link_lengths=(4.0, 4.0), base_position=(0.0, 0.0)),
            PlanarChain(link_lengths=(4.0, 4.0), base_position=(0.75, 0.0)),
        )
    )
    for radius in np.nextafter(0.375, [0.0, 0.375, 1.0]):
        collision = touching(arms, 5, float(radius))
        q = np.repeat(np.array([[90.0], [0.0], [90.0], [0.0]]), 9, axis=1)
        q[1, 4] = 1.0  # turned towards the other
        exact = collision.clearance(q).least
        assert np.abs(np.delete(exact, 4)).max() < 1e-15
        assert np.array_equal(collision.collides(q), exact < 0.0)


def test_large_angles_and_what_is_not_a_number_are_measured_exactly() -> None:
    collision = touching(TWO_PLANAR, 5)
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.0, 1.0, size=(4, 70)) * 10.0 ** rng.uniform(2.0, 9.0, size=(1, 70))
    q[1, 3], q[2, 50] = np.nan, np.inf
    with np.errstate(invalid="ignore"):
        exact = collision.clearance(q).least
    assert 0 < (exact < 0.0).sum() < 70
    assert np.array_equal(collision.collides(q), ~(exact >= 0.0))


def test_spheres_at_unequal_steps_are_measured_exactly() -> None:
    collision, links = touching(TWO_PLANAR, 5), np.array([[0, 5]])
    joint, local, radius = collision.spheres
    chain, arm_links = collision.assembly.table.chain, np.array([[0, 1]])
    assert link_lines(chain, joint, local, radius, links, arm_links).scale < np.inf
    moved = local.copy()
    moved[2, 1] += 0.7
    assert link_lines(chain, joint, moved, radius, links, arm_links).scale == np.inf
    moved = local.copy()
    moved[2, 2] += 0.7
    assert link_lines(chain, joint, moved, radius, links, arm_links).scale == np.inf
    tables = collision.tables
    unequal = tables._replace(lines=tables.lines._replace(scale=np.inf))
    q = np.random.default_rng(0).uniform(-180.0, 180.0, size=(4, 300))
    out = np.empty(300)
    contacts(unequal, q, 0, out)
    assert np.array_equal(out < 0.0, collision.clearance(q).least < 0.0)
