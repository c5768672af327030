"""Motions of every kind of planner, recorded once per test process."""

import functools

import numpy as np
from scipy.spatial.transform import Rotation

from composed import composed
from evoexp.condition import Condition
from evoexp.playback.recording import Heading, Outline, Recording, record
from evoexp.records import generations

SAMPLES = {  # name: words, label, whether the search is run to its end
    "two arms": (["experiment=rana_planar", "budget=smoke"], "via-point GA", False),
    "two arms in space": (["experiment=rana_puma", "budget=smoke"], "via-point GA", False),
    "three arms": (["experiment=rana_three_arms", "budget=smoke"], "", False),
    "among obstacles": (["experiment=rana_obstacles", "budget=smoke"], "", False),
    "co-evolution": (["experiment=curkovic_motion", "budget=smoke"], "cubic spline", False),
    "redundant arm": (["experiment=lavoie_7dof", "budget=smoke"], "", True),
    "grid": (["experiment=chen_path", "budget=smoke"], "(c)", False),
    "mission": (["experiment=chen_mission", "budget=smoke"], "(b)", True),
    "placement": (["experiment=chen_placement", "budget=smoke"], "A torque norm", True),
    "postures": (["experiment=corsepius_gate_narrow", "budget=smoke"], "scope .10 rad", True),
    "pick and place": (["experiment=corsepius_pick_and_place"], "", True),
}
REPLICATE = {"pick and place": 2}  # one that puts the bottle down, hence holds it on the way


def condition(name: str) -> Condition:
    """Return a sample's condition."""
    words, label, _ = SAMPLES[name]
    return composed(*words, label=label)


@functools.cache
def recording(name: str) -> Recording:
    """Return a sample's motion."""
    own = condition(name)
    planner, problem = own.prepare()
    rows = generations(planner.evolve(problem, own.rng(REPLICATE.get(name, 0))))
    best = np.array(next(rows).best)
    improvements = [(0, 2.0)]
    if SAMPLES[name][2]:
        for generation in rows:
            best = np.array(generation.best)
            improvements.append((generation.index, float(generation.best_cost)))
    return record(own, best, Heading(name, 0, tuple(improvements)))


@functools.cache
def refuted() -> Recording:
    """Return a motion of two arms that cross each other twice: they go there and back, twice."""
    own = condition("two arms")
    _, problem = own.prepare()
    share = np.abs(np.sin(np.linspace(0.0, 2.0 * np.pi, 21)))[:, None]
    way = problem.start + share * (problem.goal - problem.start)
    parts = [way[:, a:b].ravel() for a, b in problem.arm_slices]
    return record(own, np.concatenate(parts), Heading("refuted"))


def matrix(row: np.ndarray) -> np.ndarray:
    """Return a position and a quaternion as a matrix, without Pinocchio."""
    m = np.eye(4)
    m[:3, :3] = Rotation.from_quat(row[3:]).as_matrix()
    m[:3, 3] = row[:3]
    return m


def half_extent(drawn: Outline) -> np.ndarray:
    """Return half the edges of the box around a shape, in its own frame."""
    kind, (a, *others) = drawn.kind, drawn.size
    half_height = 0.5 * others[0] if others else 0.0
    extents = {
        "box": 0.5 * np.array(drawn.size),
        "sphere": np.full(3, a),
        "ellipsoid": np.array(drawn.size),
        "capsule": np.array([a, a, half_height + a]),
    }
    return extents.get(kind, np.array([a, a, half_height]))
