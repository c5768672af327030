"""The compiled planner against the same algorithm in plain numpy and scipy.

From the same uniform numbers.

As long as both take the same discrete decisions (who is drawn, which sites, who collides), a
generation differs by no more than the arithmetic. A decision flips only if a number comes closer to
its threshold than that, which with the seeds below never happens; were one to flip, the strings
would differ by degrees and the test would fail.
"""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.records import generations
from references import rana_numpy

ROUNDING = 1e-9  # [deg] measured: 7e-13

# The reference measures arc length by chords, a rule of second order, the planner by one of fourth
# order; so the difference is the reference's error. Measured: 1.3e-3 for 128 per segment, 2.3e-5
# for 1024, where the points are 10 apart: a factor of 57, for steps 8 times finer.
ARC_LENGTH = {128: 3e-3, 1024: 6e-5}  # [deg]


def condition(*overrides: str, experiment: str = "rana_planar") -> Condition:
    return composed(f"experiment={experiment}", *overrides)


def largest_differences(given: Condition, seed: int, **changes: Any) -> tuple[float, float]:
    """Largest difference of strings [deg] and of costs over all generations.

    Collisions must be the same.
    """
    planner, problem = given.prepare()
    size = planner.ga.population_size
    ours = generations(planner.evolve(problem, np.random.default_rng(seed)))
    theirs = rana_numpy.evolve(
        rana_numpy.from_condition(given, **changes), np.random.default_rng(seed)
    )
    strings, costs, hits = 0.0, 0.0, 0
    for generation, expected in zip(ours, theirs, strict=True):
        arms = [generation.population[a:b, :, :size] for a, b in problem.arm_slices]
        found = np.array(arms).transpose(3, 0, 2, 1)  # (individuals, arms, N + 1, joints)
        strings = max(strings, np.abs(found - expected.strings).max())
        costs = max(costs, np.abs(generation.costs - expected.costs).max())
        assert generation.num_feasible == np.count_nonzero(expected.collisions == 0)
        hits += int(expected.collisions.sum())
    assert hits > 0, "the run meets collisions"
    return strings, costs


@pytest.mark.examples(2)
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("chords", ARC_LENGTH)
def test_generations_agree_to_the_accuracy_of_the_arc_length(chords: int, seed: int) -> None:
    given = condition("planner.samples_per_segment=1024", "ga.num_generations=3")
    strings, costs = largest_differences(given, seed, chords_per_segment=chords)
    assert strings < ARC_LENGTH[chords]
    assert costs < ARC_LENGTH[chords]  # weighted by 0.5 and 0.005, but summed over points


@pytest.mark.examples(1)
@pytest.mark.parametrize(
    ("experiment", "overrides"),
    [
        ("rana_planar", ["planner.spline_end=clamped"]),
        ("rana_planar", ["collision.collision_substeps=3", "ga.num_elites=5"]),
        ("rana_three_arms", []),
        ("rana_three_arms", ["planner.crossover_reading=segment"]),
    ],
)
def test_variants_agree_to_the_accuracy_of_the_arc_length(
    experiment: str, overrides: list[str]
) -> None:
    finer = ["planner.samples_per_segment=128", "ga.num_generations=4"]
    given = condition(*finer, *overrides, experiment=experiment)
    strings, costs = largest_differences(given, 2, chords_per_segment=128)
    assert max(strings, costs) < ARC_LENGTH[128]


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("experiment", "overrides"),
    [
        ("rana_planar", []),
        ("rana_three_arms", []),
        ("rana_three_arms", ["planner.crossover_reading=segment"]),
        ("rana_planar", ["collision.collision_substeps=4"]),
        (
            "rana_planar",
            ["ga.crossover_rate=0.5", "ga.mutation_rate=0.5", "planner.num_new_trajectories=12"],
        ),
        (
            "rana_planar",
            ["ga.population_size=31", "ga.num_elites=0", "planner.crossover_distance=15"],
        ),
        ("rana_planar", ["objective.fitness_offset=0", "planner.relaxation_step=0"]),
        ("rana_planar", ["planner.num_via_points=7", "planner.walk_step=1", "planner.max_turn=30"]),
        ("rana_planar", ["collision.spheres_per_link=8", "collision.sphere_radius=0.6"]),
    ],
    ids=str,
)
def test_without_redistribution_generations_agree_to_rounding(
    experiment: str, overrides: list[str]
) -> None:
    given = condition(
        "planner.redistribution=false", "ga.num_generations=40", *overrides, experiment=experiment
    )
    for seed in (0, 1):
        strings, costs = largest_differences(given, seed)
        assert max(strings, costs) < ROUNDING


def test_a_wrong_term_would_be_noticed() -> None:
    given = condition("planner.redistribution=false", "ga.num_generations=3")
    assert max(largest_differences(given, 0, unevenness_weight=0.0051)) > ROUNDING


@pytest.mark.matrix
def test_runs_end_equally_well() -> None:
    """With 8 samples of arc length the planner goes other ways than the reference, as far.

    After some tens of generations roundings have become decisions, and runs are two samples of one
    distribution: the means of eight differ by less than three standard errors, a bound that chance
    exceeds in less than a percent.
    """
    given = condition("ga.num_generations=60")
    planner, problem = given.prepare()
    ours, theirs = np.empty(8), np.empty(8)
    for seed in range(8):
        *_, last = generations(planner.evolve(problem, np.random.default_rng(seed)))
        ours[seed] = last.best_cost
        *_, end = rana_numpy.evolve(rana_numpy.from_condition(given), np.random.default_rng(seed))
        theirs[seed] = end.costs.min()
    error = np.sqrt((ours.var(ddof=1) + theirs.var(ddof=1)) / 8)
    assert abs(ours.mean() - theirs.mean()) < 3.0 * error
    assert (
        0.2 < ours.std(ddof=1) / theirs.std(ddof=1) < 5.0
    )  # F test: 4.995 and its reciprocal are the 5 % bounds
