"""The compiled planner of Rana & Zalzala against the same algorithm in plain numpy and scipy.

Both take the same uniform numbers. As long as both take the same discrete decisions (who is drawn,
which sites, who collides), a generation differs by no more than the arithmetic. A decision flips
only if a number comes closer to its threshold than that, which with the seeds below never happens;
were one to flip, the strings would differ by degrees and the test would fail.
"""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.records import generations
from planners.runs import ran
from references import rana_numpy

ROUNDING = 1e-9  # [deg] measured: 7e-13

# The reference measures arc length by chords, a rule of second order, the planner by one of fourth
# order; so the difference is the reference's error. Measured: 1.3e-3 for 128 per segment, 2.3e-5
# for 1024, where the points are 10 apart: a factor of 57, for steps 8 times finer.
ARC_LENGTH = {128: 3e-3, 1024: 6e-5}  # [deg]
PLANAR, THREE = "rana_planar", "rana_three_arms"


def condition(words: str, *more: str) -> Condition:
    return composed(*f"experiment={words}".split(), *more)


def largest_difference(given: Condition, seed: int, **changes: Any) -> float:
    """Return the largest difference of strings [deg] or costs over all generations.

    Collisions must be the same.
    """
    planner, problem = given.prepare()
    size = planner.ga.population_size
    ours = generations(planner.evolve(problem, np.random.default_rng(seed)))
    slow = rana_numpy.from_condition(given, **changes)
    theirs = rana_numpy.evolve(slow, np.random.default_rng(seed))
    largest, hits = 0.0, 0
    for generation, expected in zip(ours, theirs, strict=True):
        arms = [generation.population[a:b, :, :size] for a, b in problem.arm_slices]
        found = np.array(arms).transpose(3, 0, 2, 1)  # (individuals, arms, N + 1, joints)
        largest = max(largest, np.abs(found - expected.strings).max())
        largest = max(largest, np.abs(generation.costs - expected.costs).max())
        assert generation.num_feasible == np.count_nonzero(expected.collisions == 0)
        hits += int(expected.collisions.sum())
    assert hits > 0, "the run meets collisions"
    return largest


@pytest.mark.examples(4)
@pytest.mark.parametrize(
    ("words", "chords", "samples"),
    [
        (PLANAR, 1024, 1024),
        (PLANAR, 128, 1024),
        (f"{PLANAR} planner.spline_end=clamped", 128, 128),
        (f"{PLANAR} collision.collision_substeps=3 ga.num_elites=5", 128, 128),
        (THREE, 128, 128),
        (f"{THREE} planner.crossover_reading=segment", 128, 128),
    ],
)
def test_generations_agree_to_the_accuracy_of_the_arc_length(
    words: str, chords: int, samples: int
) -> None:
    given = condition(words, f"planner.samples_per_segment={samples}", "ga.num_generations=3")
    for seed in (0, 1):
        difference = largest_difference(given, seed, chords_per_segment=chords)
        assert difference < ARC_LENGTH[chords]


@pytest.mark.parametrize(
    "words",
    [
        PLANAR,
        THREE,
        f"{THREE} planner.crossover_reading=segment",
        f"{PLANAR} collision.collision_substeps=4",
        f"{PLANAR} ga.crossover_rate=0.5 ga.mutation_rate=0.5 planner.num_new_trajectories=12",
        f"{PLANAR} ga.population_size=31 ga.num_elites=0 planner.crossover_distance=15",
        f"{PLANAR} objective.fitness_offset=0 planner.relaxation_step=0",
        f"{PLANAR} planner.num_via_points=7 planner.walk_step=1 planner.max_turn=30",
        f"{PLANAR} collision.spheres_per_link=8 collision.sphere_radius=0.6",
    ],
)
def test_without_redistribution_generations_agree_to_rounding(words: str) -> None:
    given = condition(words, "planner.redistribution=false", "ga.num_generations=40")
    for seed in (0, 1):
        assert largest_difference(given, seed) < ROUNDING


@pytest.mark.parametrize(("redistribution", "tolerance"), [("true", 0.01), ("false", 1e-9)])
def test_generations_are_starts_and_sweeps_as_a_slow_version_makes_them(
    redistribution: str, tolerance: float
) -> None:
    """In plain numpy: fresh walks, smoothed k times more in the k-th generation of a start."""
    words = "ga.num_generations=5", "control.num_sweeps=2", "planner.samples_per_segment=128"
    own = f"planner.redistribution={redistribution}"
    given = composed("experiment=rana_planar", "control=multi_start", *words, own)
    alone = given._replace(planner=given.planner.planner)
    slow = rana_numpy.from_condition(alone, chords_per_segment=512)
    rng, lowest = np.random.default_rng(3), np.inf
    for k, generation in enumerate(ran(given, 3).records):
        if k % 3 == 0:
            strings = rana_numpy.walks(slow, rng, 50 if k == 0 else 48)
        strings = rana_numpy.smooth(slow, strings[:48] if k else strings)
        expected = rana_numpy.judge(slow, strings)
        lowest = min(lowest, expected.cost.min())
        assert generation.costs == pytest.approx(expected.cost, abs=tolerance)
        assert generation.best_cost == pytest.approx(lowest, abs=tolerance)
        assert generation.num_feasible == np.count_nonzero(expected.collisions == 0)
