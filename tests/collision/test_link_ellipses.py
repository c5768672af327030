"""Links among ellipses against coal; whole paths are those of `references.lavoie_numpy`."""

from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from coal_shapes import distance, placed
from evoexp.collision.planar.link_ellipses import EllipseCollision, LinkEllipses
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots.arms import Arms, PlanarChain
from evoexp.scenarios.obstacles import EllipseObstacle, obstacle_table
from obstacle_samples import ellipse, sphere
from references import arms_6r

BOX = (
    ellipse((19.5, 11.0), (3.8, 0.3)),
    ellipse((23.0, 6.5), (4.8, 0.3), 90.0),
    ellipse((19.5, 2.0), (3.8, 0.3)),
    ellipse((16.0, 9.65), (1.65, 0.3), 90.0),
    ellipse((16.0, 2.35), (0.65, 0.3), 90.0),
)
TILTED = ellipse((14.0, 6.0), (4.0, 0.8), 33.0), ellipse((-6.0, 9.0), (0.5, 2.5), -70.0)
ARM = PlanarChain(link_lengths=(10.0, 10.0, 10.0, 4.0, 4.0, 3.0, 2.0), base_position=(0.0, 0.0))
TURNED = PlanarChain(link_lengths=(6.0, 7.0, 8.0), base_position=(1.0, -2.0), base_angle=40.0)


def bound(
    swept: str = "chords",
    num_positions: int = 10,
    arm: Any = ARM,
    obstacles: tuple[object, ...] = BOX,
    blind: bool = False,
) -> EllipseCollision:
    model = LinkEllipses(num_positions=num_positions, swept=swept, blind=blind)
    return model.bind(arm.build(), obstacle_table(obstacles))


def joints(arm: PlanarChain, q: FloatArray) -> FloatArray:
    """Return base and link ends, (N + 1, 2)."""
    angles = np.deg2rad(arm.base_angle) + np.cumsum(q)
    steps = np.array(arm.link_lengths)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.vstack([arm.base_position, np.array(arm.base_position) + np.cumsum(steps, axis=0)])


def excess(solid: EllipseObstacle, p: FloatArray, q: FloatArray) -> FloatArray:
    """Return how far segments pq (n, 2) pass the unit circle to which an ellipse is mapped."""
    turn = np.deg2rad(solid.angle)
    into = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    a, b = ((into @ (point - solid.center).T).T / solid.semi_axes for point in (p, q))
    way = b - a
    share = np.clip(-(a * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-300), 0.0, 1.0)
    return np.asarray(np.linalg.norm(a + share[:, None] * way, axis=1) - 1.0)


def test_a_contact_is_where_it_is_said_to_be() -> None:
    rng, seen = np.random.default_rng(5), set()
    collision = bound(arm=TURNED, obstacles=TILTED)
    for _ in range(200):
        start = rng.uniform(-1.5, 1.5, 3)
        end = start + rng.uniform(-0.8, 0.8, 3)
        contact = collision.contact(start, end)
        if contact is None:
            continue
        seen.add(contact.swept)
        before, now = (
            joints(TURNED, start + j / 10 * (end - start))
            for j in (contact.position - 1, contact.position)
        )
        other = before[contact.link] if contact.swept else now[contact.link - 1]
        solid = TILTED[contact.obstacle - 1]
        assert excess(solid, other[None], now[contact.link][None])[0] <= 1e-9
    assert seen == {False, True}


def link_collides(p: Any, q: Any, solid: EllipseObstacle) -> bool:
    """Whether one link from p to q collides."""
    x, y = np.subtract(q, p).tolist()
    chain = PlanarChain(link_lengths=(float(np.hypot(x, y)),), base_position=tuple(p))
    angle = np.array([[np.arctan2(y, x)]])
    return bool(bound("none", 1, chain, (solid,)).collide(angle, angle)[0])


def test_segments_agree_with_coal() -> None:
    """Random segments around random ellipses; what lies within 1e-4 of contact is left out."""
    rng, outcomes = np.random.default_rng(2), []
    for _ in range(40):
        semi_axes, angle = tuple(rng.uniform(0.2, 5.0, 2)), float(rng.uniform(-180.0, 180.0))
        center = rng.uniform(-9, 9, 2)
        solid = ellipse(tuple(center), semi_axes, angle)
        place = pin.SE3(pin.utils.rotate("z", np.deg2rad(angle)), np.array([*center, 0.0]))
        body = placed(coal.Ellipsoid(*semi_axes, 1.0), place)
        for p, q in center + rng.uniform(-6.0, 6.0, (50, 2, 2)):
            rod = placed(*arms_6r.capsule(np.array([*p, 0.0]), np.array([*q, 0.0]), 0.0))
            away = distance(rod, body)
            if abs(away) > 1e-4:
                assert link_collides(p.tolist(), q.tolist(), solid) == (away <= 0.0)
                outcomes.append(away <= 0.0)
            else:
                assert abs(excess(solid, p[None], q[None])[0]) < 1e-2
    assert len(outcomes) > 1900
    assert 200 < sum(outcomes) < 1800


@pytest.mark.parametrize(
    ("p", "q", "touches"),
    [
        ((-5.0, 11.3), (30.0, 11.3), True),  # along the tangent
        ((-5.0, 11.3 + 1e-7), (30.0, 11.3 + 1e-7), False),
        ((15.7, 20.0), (15.7, 11.0), True),  # ends on the tip of the ellipse
        ((15.7 - 1e-7, 20.0), (15.7 - 1e-7, 11.0), False),
        ((19.5, 11.0), (19.6, 11.0), True),  # inside
        ((19.5, 20.0), (19.5, 11.300001), False),  # stops before it
        ((10.0, 11.0), (15.0, 11.0), False),  # points at it
    ],
)
def test_contact_is_collision_and_a_link_has_ends(p: Any, q: Any, touches: bool) -> None:
    assert link_collides(p, q, BOX[0]) is touches


@pytest.mark.parametrize("num_positions", [1, 3, 10, 97])
def test_the_last_position_is_the_end_itself(num_positions: int) -> None:
    """Ends at the edge of contact: 0 + 1 (q − 0) would do, s + (q − s) would not."""
    chain = PlanarChain(link_lengths=(10.0,), base_position=(0.0, 0.0))
    collision = bound("none", num_positions, chain, (ellipse((9.0, 0.0), (0.5, 0.2)),))
    rng = np.random.default_rng(0)
    starts = rng.uniform(0.5, 1.0, (1, 400))
    # the link's direction there is within 1e-3 of contact
    ends = 0.02 + rng.uniform(-1e-3, 1e-3, (1, 400))
    assert np.array_equal(collision.collide(starts, ends), collision.collide(ends, ends))


@pytest.mark.parametrize(
    ("settings", "collides", "queries"),
    [({"blind": True}, False, 0), ({}, True, 10), ({"obstacles": ()}, False, 0)],
    ids=["blind", "seeing", "no obstacles"],
)
def test_blind_arms_and_arms_without_obstacles_meet_nothing(
    settings: Any, collides: bool, queries: int
) -> None:
    collision, q = bound(**settings), np.random.default_rng(0).uniform(-2.0, 2.0, (2, 7, 64))
    assert collision.collide(q[0], q[1]).any() == collides
    assert collision.queries == queries


@pytest.mark.parametrize("count", [1, 31, 32, 33, 100])
def test_every_individual_is_judged_alone(count: int) -> None:
    starts, ends = np.random.default_rng(count).uniform(-1.0, 2.0, (2, 7, count))
    alone = [bound().collide(starts[:, [k]], ends[:, [k]])[0] for k in range(count)]
    assert bound().collide(starts, ends).tolist() == alone


def test_an_ellipse_counts_from_the_first_link_that_reaches_it() -> None:
    assert bound().ellipses[1].tolist() == [2, 3, 2, 2, 2]  # the first link, of 10, reaches none


@pytest.mark.parametrize(
    ("robot", "obstacles", "message"),
    [
        (ARM, (sphere((1.0, 2.0), 1.0),), r"scenario.obstacles\[0\].shape: must be"),
        (ARM, (ellipse((1.0, 2.0, 3.0), (1.0, 2.0)),), "in the plane z = 0"),
        (Arms(arms=(ARM, TURNED)), BOX, "robot: must be one planar arm"),
        (ARM.model_copy(update={"link_radius": 0.1}), BOX, "robot.link_radius: must be 0"),
        (ARM.model_copy(update={"tool_radius": 0.1}), BOX, "robot: must be one planar arm"),
    ],
)
def test_what_the_model_cannot_be_is_refused(robot: Any, obstacles: Any, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        bound("none", 1, robot, obstacles)


def test_shapes_are_checked() -> None:
    with pytest.raises(ValueError, match="starts and ends must be"):
        bound().collide(np.zeros((7, 3)), np.zeros((6, 3)))
