"""Links among ellipses: against coal, against brute force, and the paths of Lavoie & Boudreau."""

import itertools

import coal
import numpy as np
import pytest

from evoexp.collision.planar.link_ellipses import EllipseCollision, LinkEllipses, _spread
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots.arms import Arms
from evoexp.robots.planar_chain import PlanarChain
from evoexp.scenarios.obstacles import EllipseObstacle, SphereObstacle, obstacle_table
from matrix import first

BOX = (
    EllipseObstacle(shape="ellipse", center=(19.5, 11.0), semi_axes=(3.8, 0.3)),
    EllipseObstacle(shape="ellipse", center=(23.0, 6.5), semi_axes=(4.8, 0.3), angle=90.0),
    EllipseObstacle(shape="ellipse", center=(19.5, 2.0), semi_axes=(3.8, 0.3)),
    EllipseObstacle(shape="ellipse", center=(16.0, 9.65), semi_axes=(1.65, 0.3), angle=90.0),
    EllipseObstacle(shape="ellipse", center=(16.0, 2.35), semi_axes=(0.65, 0.3), angle=90.0),
)
TILTED = (
    EllipseObstacle(shape="ellipse", center=(14.0, 6.0), semi_axes=(4.0, 0.8), angle=33.0),
    EllipseObstacle(shape="ellipse", center=(-6.0, 9.0), semi_axes=(0.5, 2.5), angle=-70.0),
)
ARM = PlanarChain(link_lengths=(10.0, 10.0, 10.0, 4.0, 4.0, 3.0, 2.0), base_position=(0.0, 0.0))
TURNED = PlanarChain(link_lengths=(6.0, 7.0, 8.0), base_position=(1.0, -2.0), base_angle=40.0)


def bound(
    swept: str = "chords",
    num_positions: int = 10,
    arm: PlanarChain = ARM,
    obstacles: tuple[object, ...] = BOX,
) -> EllipseCollision:
    model = LinkEllipses(num_positions=num_positions, swept=swept, blind=False)  # type: ignore[arg-type]
    return model.bind(arm.build(), obstacle_table(obstacles))


def joints(arm: PlanarChain, q: FloatArray) -> FloatArray:
    """Return base and link ends, (N + 1, 2)."""
    angles = np.deg2rad(arm.base_angle) + np.cumsum(q)
    steps = np.array(arm.link_lengths)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.vstack([arm.base_position, np.array(arm.base_position) + np.cumsum(steps, axis=0)])


def excess(ellipse: EllipseObstacle, p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the least distance of segments pq (n, 2) from an ellipse's centre.

    Mapped to the unit circle, less 1.
    """
    turn = np.deg2rad(ellipse.angle)
    into = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    a, b = ((into @ (point - ellipse.center).T).T / ellipse.semi_axes for point in (p, q))
    way = b - a
    share = np.clip(-(a * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-300), 0.0, 1.0)
    return np.asarray(np.linalg.norm(a + share[:, None] * way, axis=1) - 1.0)


def path_excess(
    arm: PlanarChain,
    obstacles: tuple[EllipseObstacle, ...],
    start: FloatArray,
    end: FloatArray,
    num: int,
    chords: bool,
) -> float:
    """Return the least `excess` over all that is tested of one path, in plain numpy."""
    places = [joints(arm, start + j / num * (end - start)) for j in range(num + 1)]
    places[num] = joints(arm, end)
    segments = [(place[:-1], place[1:]) for place in places[1:]]
    if chords:
        segments += list(itertools.pairwise(places))
    return min(float(excess(o, p, q).min()) for o in obstacles for p, q in segments)


@pytest.mark.examples(1)
@pytest.mark.parametrize("swept", ["none", "chords"])
@pytest.mark.parametrize("num_positions", first(2, [3, 10, 1, 2, 50]))
@pytest.mark.parametrize(("arm", "obstacles"), [(ARM, BOX), (TURNED, TILTED), (TURNED, TILTED[:1])])
def test_paths_agree_with_brute_force(
    swept: str, num_positions: int, arm: PlanarChain, obstacles: tuple[EllipseObstacle, ...]
) -> None:
    rng = np.random.default_rng(num_positions)
    num = len(arm.link_lengths)
    starts = rng.uniform(-1.5, 1.5, (num, 150))
    ends = starts + rng.uniform(-0.8, 0.8, (num, 150))
    collision = bound(swept, num_positions, arm, obstacles)
    found = collision.collide(starts, ends)
    for k in range(150):
        value = path_excess(
            arm, obstacles, starts[:, k], ends[:, k], num_positions, swept == "chords"
        )
        if abs(value) > 1e-8:
            assert found[k] == (value < 0.0)
        contact = collision.contact(starts[:, k], ends[:, k])
        assert found[k] == (contact is not None)
    assert 10 < np.count_nonzero(found) < 140


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
        now, before = (
            joints(TURNED, start + j / 10 * (end - start))
            for j in (contact.position, contact.position - 1)
        )
        other = before[contact.link] if contact.swept else now[contact.link - 1]
        value = excess(TILTED[contact.obstacle - 1], other[None], now[contact.link][None])
        assert value[0] <= 1e-9
    assert seen == {False, True}


def test_segments_agree_with_coal() -> None:
    """Random segments around random ellipses; what lies within 1e-4 of contact is left out."""
    rng, checked, touching = np.random.default_rng(2), 0, 0
    for _ in range(40):
        semi_axes, angle = tuple(rng.uniform(0.2, 5.0, 2)), float(rng.uniform(-180.0, 180.0))
        ellipse = EllipseObstacle(
            shape="ellipse", center=tuple(rng.uniform(-9, 9, 2)), semi_axes=semi_axes, angle=angle
        )
        table = obstacle_table((ellipse,))
        body, place = (
            coal.Ellipsoid(*table.size[0]),
            coal.Transform3s(table.rotation[0].reshape(3, 3), table.center[0]),
        )
        for _ in range(50):
            p = np.array(ellipse.center) + rng.uniform(-6.0, 6.0, 2)
            q = np.array(ellipse.center) + rng.uniform(-6.0, 6.0, 2)
            length = float(np.linalg.norm(q - p))
            chain = PlanarChain(link_lengths=(length,), base_position=tuple(p.tolist()))
            direction = np.arctan2(*(q - p)[::-1])
            model = LinkEllipses(num_positions=1, swept="none").bind(chain.build(), table)
            found = bool(model.collide(np.array([[direction]]), np.array([[direction]]))[0])
            distance = distance_of_coal(body, place, p, q)
            if abs(distance) > 1e-4:
                assert found == (distance <= 0.0)
                checked, touching = checked + 1, touching + found
            else:
                assert abs(excess(ellipse, p[None], q[None])[0]) < 1e-2
    assert checked > 1900
    assert 200 < touching < 1800


def distance_of_coal(
    body: coal.Ellipsoid, place: coal.Transform3s, p: FloatArray, q: FloatArray
) -> float:
    """Return the signed distance of a segment, a capsule of radius 0, and an ellipsoid."""
    way = np.array([*(q - p), 0.0])
    z = way / np.linalg.norm(way)
    x = np.array([0.0, 0.0, 1.0])
    rotation = np.column_stack([x, np.cross(z, x), z])
    middle = np.array([*(0.5 * (p + q)), 0.0])
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    capsule = coal.Capsule(0.0, float(np.linalg.norm(way)))
    return float(
        coal.distance(capsule, coal.Transform3s(rotation, middle), body, place, request, result)
    )


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
def test_contact_is_collision_and_a_link_has_ends(
    p: tuple[float, ...], q: tuple[float, ...], touches: bool
) -> None:
    length, direction = (
        float(np.hypot(q[0] - p[0], q[1] - p[1])),
        np.arctan2(q[1] - p[1], q[0] - p[0]),
    )
    chain = PlanarChain(link_lengths=(length,), base_position=(p[0], p[1]))
    collision = bound("none", 1, chain, BOX[:1])
    angle = np.array([[direction]])
    assert bool(collision.collide(angle, angle)[0]) is touches


def test_the_last_position_is_the_end_itself() -> None:
    """Ends one rounding apart, at the edge of contact.

    0 + 1 (q − 0) would do, s + (q − s) would not.
    """
    chain = PlanarChain(link_lengths=(10.0,), base_position=(0.0, 0.0))
    ellipse = EllipseObstacle(shape="ellipse", center=(9.0, 0.0), semi_axes=(0.5, 0.2))
    rng = np.random.default_rng(0)
    for num_positions in (1, 3, 10, 97):
        collision = bound("none", num_positions, chain, (ellipse,))
        starts = rng.uniform(0.5, 1.0, (1, 400))
        edge = 0.02  # the link's direction there is within 1e-3 of contact
        ends = edge + rng.uniform(-1e-3, 1e-3, (1, 400))
        alone = collision.collide(ends, ends)
        assert np.array_equal(collision.collide(starts, ends) & ~alone, np.zeros(400, dtype=bool))
        assert np.array_equal(collision.collide(starts, ends), alone)


def test_blind_arms_meet_nothing() -> None:
    model = LinkEllipses(num_positions=10, swept="chords", blind=True).bind(
        ARM.build(), obstacle_table(BOX)
    )
    seeing = bound()
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (2, 7, 64))
    assert not model.collide(q[0], q[1]).any()
    assert model.queries == 0
    assert seeing.collide(q[0], q[1]).any()
    assert seeing.queries == 10


def test_without_obstacles_nothing_collides() -> None:
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (2, 7, 5))
    assert not bound(obstacles=()).collide(q[0], q[1]).any()


@pytest.mark.parametrize("count", [1, 31, 32, 33, 100])
def test_every_individual_is_judged_alone(count: int) -> None:
    rng = np.random.default_rng(count)
    starts, ends = rng.uniform(-1.0, 2.0, (2, 7, count))
    together = bound().collide(starts, ends)
    alone = [
        bool(bound().collide(starts[:, k : k + 1], ends[:, k : k + 1])[0]) for k in range(count)
    ]
    assert together.tolist() == alone


@pytest.mark.parametrize("num", range(1, 40))
def test_positions_are_each_tested_once_the_end_first(num: int) -> None:
    order = _spread(num)
    assert order[0] == num
    assert sorted(order) == list(range(1, num + 1))


def test_an_ellipse_counts_from_the_first_link_that_reaches_it() -> None:
    assert bound().ellipses[1].tolist() == [2, 3, 2, 2, 2]  # the first link, of 10, reaches none


@pytest.mark.parametrize(
    ("robot", "obstacles", "message"),
    [
        (
            ARM,
            (SphereObstacle(shape="sphere", center=(1.0, 2.0), radius=1.0),),
            "scenario.obstacles[0].shape: must be",
        ),
        (
            ARM,
            (EllipseObstacle(shape="ellipse", center=(1.0, 2.0, 3.0), semi_axes=(1.0, 2.0)),),
            "in the plane z = 0",
        ),
        (Arms(arms=(ARM, TURNED)), BOX, "robot: must be one planar arm"),
        (ARM.model_copy(update={"link_radius": 0.1}), BOX, "robot.link_radius: must be 0"),
        (ARM.model_copy(update={"tool_radius": 0.1}), BOX, "robot: must be one planar arm"),
    ],
)
def test_what_the_model_cannot_be_is_refused(
    robot: object, obstacles: tuple[object, ...], message: str
) -> None:
    with pytest.raises(SettingError) as caught:
        LinkEllipses(num_positions=1, swept="none").bind(robot.build(), obstacle_table(obstacles))  # type: ignore[attr-defined]
    assert message in str(caught.value)


def test_shapes_are_checked() -> None:
    with pytest.raises(ValueError, match="starts and ends must be"):
        bound().collide(np.zeros((7, 3)), np.zeros((6, 3)))
