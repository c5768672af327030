"""Generations computed in one call, against the same ones computed kernel by kernel."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.numeric.generator_state import state_bytes
from evoexp.planners.coevolution import generations as team_generations
from evoexp.planners.coevolution.generations import CACHED, PER_CALL, per_call
from evoexp.records import Generation, generations

SMALL = ("ga.population_size=12", "ga.num_generations=30")


def prepared(*words: str, label: str = "") -> tuple[Any, Any]:
    planner, problem = composed(*words, label=label).prepare()
    assert problem.collision.is_lines
    return planner, problem


def told(found: Iterator[Generation], rng: np.random.Generator) -> Iterator[tuple[Any, ...]]:
    """Yield everything that a log takes of a generation, and the state of the generator there."""
    for generation in found:
        arrays = generation.best, generation.costs, generation.population, generation.criteria
        state = generation.state or state_bytes(rng.bit_generator)
        row = generation._replace(state=state)
        rest = [value for value in row if not isinstance(value, np.ndarray)]
        copies = [None if array is None else array.tobytes() for array in arrays]
        yield *copies, repr(rest)


@pytest.mark.examples(4)
@pytest.mark.parametrize(
    "words",
    [
        *(("experiment=curkovic_methods", name) for name in ("I", "III", "VI", "VIII")),
        ("experiment=curkovic_three collision.collision_substeps=1", ""),
        ("experiment=curkovic_stationary scenario.obstacles=[]", ""),
        ("experiment=curkovic_methods ga.hall_frozen=true", "V"),
        ("experiment=curkovic_methods ga.hall_memory=3 ga.hall_distinct=index", "V"),
        ("experiment=curkovic_methods ga.num_generations=0", "V"),
        ("experiment=curkovic_methods ga.population_size=13 ga.num_elites=13", "I"),
    ],
    ids=" ".join,
)
def test_generations_in_one_call_are_those_of_one_kernel_after_the_other(
    words: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    given = words[0].split()
    named = {word.split("=")[0] for word in given}
    small = [word for word in SMALL if word.split("=")[0] not in named]
    planner, problem = prepared(*given, *small, label=words[1])
    one, other = np.random.default_rng(5), np.random.default_rng(5)
    at_once = list(told(generations(planner.evolve(problem, one)), one))
    monkeypatch.setattr(type(problem.collision), "is_lines", False)
    in_turn = told(generations(planner.evolve(problem, other)), other)
    for ours, expected in zip(at_once, in_turn, strict=True):
        assert ours == expected


def test_the_number_of_generations_per_call_changes_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    planner, problem = prepared("experiment=curkovic_methods", *SMALL, label="V")
    rng = np.random.default_rng(2)
    expected = list(told(generations(planner.evolve(problem, rng)), rng))
    for length in (1, 3, 100):
        monkeypatch.setattr(team_generations, "per_call", lambda robots, count, most=length: most)
        rng = np.random.default_rng(2)
        assert list(told(generations(planner.evolve(problem, rng)), rng)) == expected


def test_large_populations_are_computed_generation_by_generation() -> None:
    assert per_call(2, 100) == PER_CALL
    assert per_call(2, 5000) == 1
    for count in (1, 10, 150, 200, 1000):
        length = per_call(2, count)
        assert length == 1 or 2 * length * count * count <= CACHED


def test_coordinates_that_are_not_finite_are_refused() -> None:
    planner, problem = prepared("experiment=curkovic_methods", *SMALL, label="V")
    problem = problem._replace(arms=np.full_like(problem.arms, 1e200))
    with pytest.raises(ValueError, match="must be finite"):
        next(iter(generations(planner.evolve(problem, np.random.default_rng(0)))))
