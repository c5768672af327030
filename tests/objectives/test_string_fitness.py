"""Eqs. 2–7 by hand."""

import numpy as np
import pytest

from evoexp.objectives.string_fitness import StringFitness, count_collisions, weigh

PAPER = StringFitness(
    length_weight=0.5, unevenness_weight=0.005, collision_weight=100.0, fitness_offset=500.0
)


def test_cost_is_the_bracket_of_equation_7() -> None:
    lengths, unevenness = np.array([[10.0, 1.0], [20.0, 2.0]]), np.array([[3.0, 0.0], [4.0, 0.0]])
    cost = np.empty(2)
    weigh(PAPER.weights, lengths, unevenness, np.array([2.0, 0.0]), cost)
    assert cost == pytest.approx([0.5 * 30.0 + 0.005 * 7.0 + 200.0, 1.5])
    assert PAPER.fitness(cost) == pytest.approx([500.0 - 215.035, 498.5])


def test_collisions_lower_the_fitness() -> None:
    """The printed sign of Eq. 7 would reward them."""
    assert PAPER.fitness(np.array([300.0]))[0] < PAPER.fitness(np.array([200.0]))[0]


def test_an_instant_collides_if_any_of_its_substeps_does() -> None:
    clearance = np.array(
        [
            [[0.1, -0.1], [0.1, 0.1]],
            [[0.0, -0.1], [-1e-300, 0.1]],
            [[np.inf, 0.1], [0.1, 0.1]],
        ]
    )  # (instants, substeps, lanes)
    out = np.empty(2)
    count_collisions(clearance[None], out)
    assert out.tolist() == [1.0, 2.0]
    count_collisions(np.stack([np.full_like(clearance, np.inf), clearance]), out)
    assert out.tolist() == [1.0, 2.0]
