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
Change = Callable[[Generation], Generation]


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


def evolving(change: Change) -> dict[str, Any]:
    """Return an `evolve` whose generations are changed."""

    def evolve(self: ViaPointGa, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
        yield from map(change, generations(ViaPointGa.evolve(self, problem, rng)))

    return {"evolve": evolve}


def replaced(index: int = 1, **fields: Any) -> Change:
    """Return a change of some fields of one generation."""
    return lambda g: g._replace(**fields) if g.index == index else g


def test_a_sound_planner_passes(condition: Condition) -> None:
    check_planner(condition)


def spoiled(values: np.ndarray) -> np.ndarray:
    copy = values.copy()
    copy.flat[0] = np.nan
    return copy


def in_place(generation: Generation) -> Generation:
    """Change the best solution of generations that were yielded before."""
    KEPT.append(generation.best)
    KEPT[0][0] += 1.0 if generation.index else 0.0
    return generation


KEPT: list[Any] = []


def drawn_globally(generation: Generation) -> Generation:
    np.random.random()  # noqa: NPY002  # the fault
    return generation


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        (
            "generations_are_numbered",
            lambda g: g._replace(index=g.index + 1),
            "must be numbered 0, 1, 2, …",
        ),
        (
            "evaluations_add_up",
            replaced(evaluations=13),
            "up to generation 1 must be the sum of num_evaluations",
        ),
        ("evaluations_add_up", replaced(evaluations=8), "must grow with every generation"),
        ("collision_queries_never_decrease", replaced(collision_queries=1), "must never decrease"),
        ("the_best_so_far_never_gets_worse", replaced(best_cost=1e9), "must be the least cost so"),
        (
            "costs_are_those_of_the_generation",
            replaced(best_cost_in_generation=-1.0),
            "best_cost_in_generation must be the least of costs",
        ),
        ("costs_are_those_of_the_generation", replaced(num_feasible=9), "between 0 and the number"),
        ("costs_are_those_of_the_generation", replaced(mean_cost=0.0), "mean_cost and std_cost"),
        (
            "numbers_are_finite",
            lambda g: g._replace(population=spoiled(g.population)),
            "population must hold finite numbers in generation 0",
        ),
        ("numbers_are_finite", lambda g: g._replace(costs=spoiled(g.costs)), "costs must be numb"),
        ("numbers_are_finite", replaced(solved=np.True_), "solved must be true or false"),
        ("numbers_are_finite", replaced(terms={"a": "b"}), "terms must be numbers by name"),
        ("a_best_solution_is_never_changed", in_place, "of generation 0 must keep its values"),
        (
            "solutions_have_the_documented_shape",
            lambda g: g._replace(best=g.best[:-1]),
            "must have the size that shape documents, ((21, 2), (21, 2)); was 83",
        ),
        (
            "recorded_costs_are_those_of_the_population",
            lambda g: g._replace(costs=g.costs + 1.0),
            "costs of generation 0 must be those that cost gives its population",
        ),
        (
            "terms_agree_with_evaluate",
            lambda g: g._replace(terms={"collisions": -1.0}),
            "must give the recorded collisions of the best solution, -1.0",
        ),
        (
            "terms_agree_with_evaluate",
            lambda g: g._replace(terms={"beauty": 1.0}),
            "evaluate must name every recorded term of a solution; was without beauty",
        ),
        (
            "terms_agree_with_evaluate",
            lambda g: g._replace(best_cost=g.best_cost + 1.0),
            "cost_of_terms must give the recorded cost of the best solution, ",
        ),
        (
            "randomness_comes_from_the_given_generator",
            drawn_globally,
            "random numbers must come from rng, never from a global generator",
        ),
    ],
)
def test_records_that_are_wrong(
    condition: Condition, name: str, change: Change, message: str
) -> None:
    KEPT.clear()
    faulty = with_planner(condition, **evolving(change))
    with pytest.raises(ContractBroken) as broken:
        check(name)(faulty)
    assert str(broken.value).startswith("planner 'via_point_ga': ")
    assert message in str(broken.value)


def changing_after_the_end(
    self: ViaPointGa, problem: Any, rng: np.random.Generator
) -> Iterator[Generation]:
    population = np.empty(0)
    for generation in generations(ViaPointGa.evolve(self, problem, rng)):
        population = generation.population
        yield generation
    population += 1.0


RUNS: list[int] = []


def remembering(self: ViaPointGa, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
    RUNS.append(1)
    for generation in generations(ViaPointGa.evolve(self, problem, rng)):
        yield generation._replace(best=generation.best + len(RUNS))


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


def in_degrees(self: ViaPointGa, problem: Any, solution: Any) -> Any:
    motion = ViaPointGa.motion(self, problem, solution)
    return motion._replace(q=motion.q[:, :3])


@pytest.mark.parametrize(
    ("name", "members", "message"),
    [
        ("the_last_population_is_left_alone", {"evolve": changing_after_the_end}, "after evolve"),
        ("the_same_seed_gives_the_same_bits", {"evolve": remembering}, "agree in every bit"),
        (
            "randomness_comes_from_the_given_generator",
            {"evolve": without_rng},
            "evolve must draw its random numbers from rng",
        ),
        ("samples_are_judged_alike", {"cost": by_position}, "the same alone and among others"),
        (
            "the_local_operator_leaves_its_argument_alone",
            {"improve": changing_its_argument},
            "improve must leave the given population as it is",
        ),
        ("pieces_cover_the_motion", {"parts": in_one_piece_less}, "from instant 0 to 20; was [(0,"),
        (
            "pieces_cover_the_motion",
            {"security_margin": lambda *_: -1.0},
            "security_margin must be a distance, at least 0; was -1.0",
        ),
        ("motions_fit_the_robot", {"motion": in_degrees}, "one column per joint coordinate, 4"),
        ("motions_fit_the_robot", {"motion": lambda *_: [1.0]}, "must return a Motion, or None"),
        (
            "tables_and_remarks_can_be_printed",
            {"listing": lambda *_: Listing(["a", "b"], [[1.0]])},
            "one value per name, 2",
        ),
        ("tables_and_remarks_can_be_printed", {"notes": lambda *_: [1]}, "lines of text; was [1]"),
        ("every_member_is_there", {"notes": lambda self: ()}, "notes must take (problem)"),
        ("every_member_is_there", {"reproducibility": "often"}, "must be one of 'bits', 'env"),
        ("every_member_is_there", {"revision": 0}, "a whole number, at least 1; was 0"),
    ],
)
def test_members_that_are_wrong(
    condition: Condition, name: str, members: dict[str, Any], message: str
) -> None:
    RUNS.clear()
    with pytest.raises(ContractBroken) as broken:
        check(name)(with_planner(condition, **members))
    assert message in str(broken.value)


def test_a_planner_without_motion_passes(condition: Condition) -> None:
    silent = with_planner(condition, motion=lambda *_: None, component="via_point_ga")
    for name in ("motions_fit_the_robot", "pieces_cover_the_motion"):
        check(name)(silent)
    assert check("the_summary_says_what_the_log_says")(silent) is None


def test_a_missing_member_is_named(condition: Condition) -> None:
    class Bare:
        component = "bare"
        is_reference = False

    with pytest.raises(ContractBroken, match="planner 'bare': a planner must be a Component"):
        check("every_member_is_there")(condition._replace(planner=Bare()))  # type: ignore[arg-type]
