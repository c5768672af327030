"""Moves over a grid by proof: against distances from lines to boxes, and searches over them."""

import numpy as np
import pytest

from evoexp.errors import SettingError
from evoexp.planners.grid_path_ga.path_climbing import PathClimbing
from evoexp.planners.planner import Planner
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations
from evoexp.robots.floor_platform import FloorPlatform
from evoexp.scenarios.grid_motion import GridMotion
from planners.grid_samples import planner, scenario

PROVEN = planner(acceptance="certified")


def platform(radius: float, dimensions: int = 2) -> FloorPlatform:
    return FloorPlatform(body_radius=radius, body_height=0.5, dimensions=dimensions)


def random_scene(seed: int, share: float = 0.15, margin: float = 0.0) -> GridMotion:
    rng = np.random.default_rng(seed)
    blocked = rng.random((9, 7)) < share
    blocked[0, :] = blocked[-1, :] = blocked[:, 0] = blocked[:, -1] = False
    return scenario(blocked, security_margin=margin)


def clearance_of_move(one: np.ndarray, two: np.ndarray, scene: GridMotion) -> float:
    """Least distance in the plane of a dense row of points on a move from all boxes."""
    points = one + np.linspace(0.0, 1.0, 2001)[:, None] * (two - one)
    found = np.inf
    for box in scene.bodies():
        away = np.abs(points - box.center[:2]) - 0.5 * np.array(box.size[:2])
        found = min(found, float(np.linalg.norm(np.maximum(away, 0.0), axis=1).min()))
    return found


@pytest.mark.parametrize("radius", [0.4, 0.7, 0.8, 0.985, 1.3])
@pytest.mark.parametrize("seed", range(4))
def test_moves_are_those_that_keep_away(radius: float, seed: int) -> None:
    scene = random_scene(seed)
    plain = planner().prepare(platform(0.4), scene).fields.grid
    try:
        proven = PROVEN.prepare(platform(radius), scene).fields.grid.neighbours
    except SettingError as error:  # no way is left, or the body does not fit anywhere
        assert radius > 0.5 and "moves that are not proven" in str(error)
        return
    where = plain.coordinates.astype(float)
    for node, targets in enumerate(plain.neighbours):
        for move, target in enumerate(targets):
            if target >= 0:
                clear = clearance_of_move(where[node], where[target], scene)
                assert abs(clear - radius) > 1e-3, "undecided by these points"
                assert (proven[node, move] == target) == (clear > radius)


def test_a_margin_is_kept_where_it_is_asked_for() -> None:
    scene = random_scene(3, margin=0.35)
    by_margin = planner(acceptance="margin").prepare(platform(0.4), scene)
    as_wide = PROVEN.prepare(platform(0.75), scene)
    assert (by_margin.fields.grid.neighbours == as_wide.fields.grid.neighbours).all()
    some = PROVEN.prepare(platform(0.4), scene).fields.grid.neighbours
    assert (some >= 0).sum() > (as_wide.fields.grid.neighbours >= 0).sum()


@pytest.mark.parametrize("control", [False, True])
def test_every_path_is_proven(control: bool) -> None:
    refuted = 0
    for acceptance in ("model", "certified"):
        searched = planner(acceptance=acceptance)
        chosen: Planner = PathClimbing(num_paths=3, planner=searched) if control else searched
        for seed in range(12):
            problem = chosen.prepare(platform(0.72), random_scene(seed))
            for generation in generations(chosen.evolve(problem, np.random.default_rng(seed))):
                motion = chosen.motion(problem, generation.best)
                found = judge_motion(chosen, problem, motion)
                assert found.certified is True or acceptance == "model"
                refuted += found.certified is False
                assert chosen.departures(problem, generation.best) == []
    assert refuted > 0, "the papers' moves pass corners too closely for this platform"


def test_moves_that_are_not_proven_are_departures() -> None:
    blocked = np.zeros((3, 3), dtype=bool)
    blocked[1, 1] = True
    past_the_corner = np.array([0.0, 0.0, 1.0, 0.0, 2.0, 1.0, 2.0, 2.0])
    for acceptance, departures in (("model", []), ("certified", ["forbidden moves: 1"])):
        own = planner(acceptance=acceptance)
        problem = own.prepare(platform(0.72), scenario(blocked))
        assert own.departures(problem, past_the_corner) == departures


def test_in_space_too() -> None:
    blocked = np.zeros((3, 3, 3), dtype=bool)
    blocked[1, 1, 1] = True
    wide, slim = (
        PROVEN.prepare(platform(radius, 3), scenario(blocked)).fields.grid.neighbours
        for radius in (0.9, 0.3)
    )
    plain = planner().prepare(platform(0.3, 3), scenario(blocked)).fields.grid.neighbours
    assert (slim == plain).all()
    assert (plain >= 0).sum() > (wide >= 0).sum() > 0
    assert not ((wide >= 0) & (plain < 0)).any()


def test_no_way_is_left() -> None:
    blocked = np.zeros((5, 3), dtype=bool)
    blocked[2, 0] = blocked[2, 2] = True
    must = r"scenario\.goal: .*obstacles, or moves that are not proven, are between"
    with pytest.raises(SettingError, match=must):
        PROVEN.prepare(platform(1.2), scenario(blocked))
