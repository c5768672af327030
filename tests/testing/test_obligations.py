"""Every obligation of a planner is checked: a planner that breaks it is told so, in plain words."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from evoexp.condition import Condition
from evoexp.planners.answers import Listing
from evoexp.planners.via_point_ga.planner import ViaPointGa
from evoexp.records import Generation, generations
from evoexp.testing import CHECKS, Check, ContractBroken, check_planner, conditions

SMALL = ("ga.population_size=8", "ga.num_generations=3", "planner.num_new_trajectories=1")
KEPT: list[Any] = []  # by planners that remember


@pytest.fixture(scope="module")
def condition() -> Condition:
    (found,) = conditions("experiment=rana_obstacles", *SMALL).values()
    return found


def check(name: str) -> Check:
    (found,) = [each for each in CHECKS if each.__name__ == name]
    return found


def with_planner(condition: Condition, **members: Any) -> Condition:
    """Return a condition whose planner has some members of its own."""
    kind: Any = type("Faulty", (ViaPointGa,), members)
    fields = {name: getattr(condition.planner, name) for name in ViaPointGa.model_fields}
    return condition._replace(planner=kind(**fields))


def evolving(change: Callable[[Generation], Generation]) -> dict[str, Any]:
    """Return an `evolve` whose generations are changed."""

    def evolve(self: ViaPointGa, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
        yield from map(change, generations(ViaPointGa.evolve(self, problem, rng)))

    return {"evolve": evolve}


def first(**fields: Any) -> dict[str, Any]:
    """Return an `evolve` whose first generation bred has other fields."""
    return evolving(lambda g: g._replace(**fields) if g.index == 1 else g)


def every(**changes: Callable[[Generation], Any]) -> dict[str, Any]:
    """Return an `evolve` of whose generations fields are functions of what they were."""
    return evolving(lambda g: g._replace(**{name: own(g) for name, own in changes.items()}))


def spoiled(values: np.ndarray) -> np.ndarray:
    copy = values.copy()
    copy.flat[0] = np.nan
    return copy


def in_place(generation: Generation) -> Generation:
    """Change the best solution of generations that were yielded before."""
    KEPT.append(generation.best)
    KEPT[0][0] += 1.0 if generation.index else 0.0
    return generation


def drawn_globally(generation: Generation) -> Generation:
    np.random.random()  # noqa: NPY002  # the fault
    return generation


def changing_after_the_end(
    self: ViaPointGa, problem: Any, rng: np.random.Generator
) -> Iterator[Generation]:
    population = np.empty(0)
    for generation in generations(ViaPointGa.evolve(self, problem, rng)):
        population = generation.population
        yield generation
    population += 1.0


def remembering(self: ViaPointGa, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
    KEPT.append(1)
    for generation in generations(ViaPointGa.evolve(self, problem, rng)):
        yield generation._replace(best=generation.best + len(KEPT))


def without_rng(self: ViaPointGa, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
    other = np.random.Generator(np.random.PCG64(0))
    yield from generations(ViaPointGa.evolve(self, problem, other))


def by_position(self: ViaPointGa, problem: Any, population: Any) -> Any:
    judged = ViaPointGa.cost(self, problem, population)
    return SimpleNamespace(cost=judged.cost + np.arange(len(judged.cost)))


def changing_its_argument(self: ViaPointGa, problem: Any, population: Any, rng: Any) -> None:
    population += 1.0


def in_one_piece_less(self: ViaPointGa, problem: Any, motion: Any) -> Any:
    (part,) = ViaPointGa.parts(self, problem, motion)
    return [part._replace(last=part.last - 1)]


def of_fewer_joints(self: ViaPointGa, problem: Any, solution: Any) -> Any:
    motion = ViaPointGa.motion(self, problem, solution)
    return motion._replace(q=motion.q[:, :3])


FAULTS: dict[str, list[tuple[dict[str, Any], str]]] = {  # obligation → what breaks it, what is told
    "generations_are_numbered": [
        (every(index=lambda g: g.index + 1), "must be numbered 0, 1, 2, …")
    ],
    "evaluations_add_up": [
        (first(evaluations=13), "up to generation 1 must be the sum of num_evaluations"),
        (first(evaluations=8), "must grow with every generation"),
    ],
    "collision_queries_never_decrease": [(first(collision_queries=1), "must never decrease")],
    "the_best_so_far_never_gets_worse": [(first(best_cost=1e9), "must be the least cost so")],
    "costs_are_those_of_the_generation": [
        (first(best_cost_in_generation=-1.0), "best_cost_in_generation must be the least of costs"),
        (first(num_feasible=9), "between 0 and the number"),
        (first(mean_cost=0.0), "mean_cost and std_cost"),
    ],
    "numbers_are_finite": [
        (every(population=lambda g: spoiled(g.population)), "population must hold finite numbers"),
        (every(costs=lambda g: spoiled(g.costs)), "costs must be numb"),
        (first(solved=np.True_), "solved must be true or false"),
        (first(terms={"a": "b"}), "terms must be numbers by name"),
    ],
    "a_best_solution_is_never_changed": [
        (evolving(in_place), "of generation 0 must keep its values")
    ],
    "solutions_have_the_documented_shape": [
        (every(best=lambda g: g.best[:-1]), "documents, ((21, 2), (21, 2)); was 83"),
    ],
    "recorded_costs_are_those_of_the_population": [
        (every(costs=lambda g: g.costs + 1.0), "of generation 0 must equal what cost returns"),
    ],
    "terms_agree_with_evaluate": [
        (every(terms=lambda g: {"collisions": -1.0}), "of the best solution, -1.0"),
        (every(terms=lambda g: {"beauty": 1.0}), "recorded term of a solution; was without beauty"),
        (every(best_cost=lambda g: g.best_cost + 1.0), "cost_of_terms must give the recorded cost"),
    ],
    "randomness_comes_from_the_given_generator": [
        (evolving(drawn_globally), "must come from rng, never from a global generator"),
        ({"evolve": without_rng}, "evolve must draw its random numbers from rng"),
    ],
    "the_last_population_is_left_alone": [({"evolve": changing_after_the_end}, "after evolve")],
    "the_same_seed_gives_the_same_bits": [({"evolve": remembering}, "agree in every bit")],
    "samples_are_judged_alike": [({"cost": by_position}, "the same for an individual alone")],
    "the_local_operator_leaves_its_argument_alone": [
        ({"improve": changing_its_argument}, "improve must leave the given population as it is"),
    ],
    "pieces_cover_the_motion": [
        ({"parts": in_one_piece_less}, "from instant 0 to 20; was [(0,"),
        ({"security_margin": lambda *_: -1.0}, "must be a distance, at least 0; was -1.0"),
    ],
    "motions_fit_the_robot": [
        ({"motion": of_fewer_joints}, "one column per joint coordinate, 4"),
        ({"motion": lambda *_: [1.0]}, "must return a Motion, or None"),
    ],
    "tables_and_remarks_can_be_printed": [
        ({"listing": lambda *_: Listing(["a", "b"], [[1.0]])}, "one value per name, 2"),
        ({"notes": lambda *_: [1]}, "lines of text; was [1]"),
    ],
    "every_member_is_there": [
        ({"notes": lambda self: ()}, "notes must take (problem)"),
        ({"reproducibility": "often"}, "must be one of 'bits', 'env"),
        ({"revision": 0}, "a whole number, at least 1; was 0"),
    ],
}


@pytest.mark.parametrize(
    ("name", "members", "message"), [(name, *row) for name, rows in FAULTS.items() for row in rows]
)
def test_a_broken_obligation_is_told(
    condition: Condition, name: str, members: dict[str, Any], message: str
) -> None:
    KEPT.clear()
    with pytest.raises(ContractBroken) as broken:
        check(name)(with_planner(condition, **members))
    assert str(broken.value).startswith("planner 'via_point_ga': ")
    assert message in str(broken.value)


def test_sound_planners_and_one_without_motion_pass(condition: Condition) -> None:
    check_planner(condition)
    silent = with_planner(condition, motion=lambda *_: None, component="via_point_ga")
    for name in ("motions_fit_the_robot", "pieces_cover_the_motion"):
        check(name)(silent)


def test_a_missing_member_is_named(condition: Condition) -> None:
    bare: Any = SimpleNamespace(component="bare", is_reference=False)
    with pytest.raises(ContractBroken, match="planner 'bare': a planner must be a Component"):
        check("every_member_is_there")(condition._replace(planner=bare))
