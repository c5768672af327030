"""Moves over a grid by proof: against distances from lines to boxes, and searches over them."""

from typing import Any

import numpy as np
import pytest

from evoexp.errors import SettingError
from evoexp.paths.grids import Grid, NodeArray
from evoexp.planners.grid_path_ga.path_climbing import PathClimbing
from evoexp.records import FloatArray
from evoexp.robots.arms import FloorPlatform
from evoexp.scenarios.grid_motion import GridMotion
from planners.grid_samples import planner, scenario
from planners.runs import evolved, verdict


def platform(radius: float, dimensions: int = 2) -> FloorPlatform:
    return FloorPlatform(body_radius=radius, body_height=0.5, dimensions=dimensions)


def permitted(radius: float, scene: GridMotion, acceptance: str = "certified") -> Grid:
    """Return the grid of the moves that a platform may take."""
    own, robot = planner(acceptance=acceptance), platform(radius, len(scene.size))
    return own.prepare(robot, scene).fields.grid


def moves(radius: float, scene: GridMotion, acceptance: str = "certified") -> NodeArray:
    """Return where the permitted moves of every node lead to; −1: nowhere."""
    return permitted(radius, scene, acceptance).neighbours


def random_scene(seed: int, margin: float = 0.0) -> GridMotion:
    blocked = np.random.default_rng(seed).random((9, 7)) < 0.15
    blocked[0, :] = blocked[-1, :] = blocked[:, 0] = blocked[:, -1] = False
    return scenario(blocked, security_margin=margin)


def clearance_of_move(one: FloatArray, two: FloatArray, scene: GridMotion) -> float:
    """Least distance in the plane of a dense row of points on a move from all boxes."""
    points = one + np.linspace(0.0, 1.0, 2001)[:, None] * (two - one)
    least = np.inf
    for box in scene.bodies():
        away = np.abs(points - box.center[:2]) - 0.5 * np.array(box.size[:2])
        least = min(least, float(np.linalg.norm(np.maximum(away, 0.0), axis=1).min()))
    return least


@pytest.mark.parametrize("radius", [0.4, 0.7, 0.8, 0.985, 1.3])
@pytest.mark.parametrize("seed", range(4))
def test_moves_are_those_that_keep_away(radius: float, seed: int) -> None:
    scene = random_scene(seed)
    try:
        proven = moves(radius, scene)
    except SettingError as error:  # no way is left, or the body does not fit anywhere
        assert radius > 0.5 and "moves that are not proven" in str(error)
        return
    plain = permitted(0.4, scene, "model")
    where = plain.coordinates.astype(float)
    for node, targets in enumerate(plain.neighbours):
        for move, target in enumerate(targets):
            if target >= 0:
                clear = clearance_of_move(where[node], where[target], scene)
                assert abs(clear - radius) > 1e-3, "undecided by these points"
                assert (proven[node, move] == target) == (clear > radius)


def test_a_margin_is_kept_where_it_is_asked_for() -> None:
    scene = random_scene(3, margin=0.35)
    as_wide = moves(0.75, scene)
    assert np.array_equal(moves(0.4, scene, "margin"), as_wide)
    assert (moves(0.4, scene) >= 0).sum() > (as_wide >= 0).sum()


@pytest.mark.parametrize("control", [False, True])
def test_every_path_is_proven(control: bool) -> None:
    refuted = 0
    for acceptance in ("model", "certified"):
        searched = planner(acceptance=acceptance)
        chosen: Any = PathClimbing(num_paths=3, planner=searched) if control else searched
        for seed in range(12):
            problem = chosen.prepare(platform(0.72), random_scene(seed))
            for best in (generation.best for generation in evolved(chosen, problem, seed)):
                certified = verdict(chosen, problem, best).certified
                assert certified is True or acceptance == "model"
                refuted += certified is False
                assert chosen.departures(problem, best) == []
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
    wide, slim = (moves(radius, scenario(blocked)) for radius in (0.9, 0.3))
    plain = moves(0.3, scenario(blocked), "model")
    assert np.array_equal(slim, plain)
    assert (plain >= 0).sum() > (wide >= 0).sum() > 0
    assert not ((wide >= 0) & (plain < 0)).any()


def test_no_way_is_left() -> None:
    blocked = np.zeros((5, 3), dtype=bool)
    blocked[2, [0, 2]] = True
    must = r"scenario\.goal: .*obstacles, or moves that are not proven, are between"
    with pytest.raises(SettingError, match=must):
        moves(1.2, scenario(blocked))
