"""Checks of the whole planner: its members, its identity, its randomness."""

import contextlib
import functools
import inspect
import pickle
from typing import Any, get_args

import numpy as np

from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.planner import MEMBERS, Reproducibility
from evoexp.testing.evolution_record import demand, evolution, finished
from evoexp.validation import Component


@functools.lru_cache(maxsize=8)
def has_one_population(condition: Condition) -> bool:
    """Return whether individuals can be drawn and judged: not of references and plans of stages."""
    planner, problem = condition.prepare()
    with contextlib.suppress(SettingError):  # by which a planner of several stages refuses
        if not condition.is_reference:
            return planner.sample(problem, condition.rng(0), 1) is not None
    return False


def every_member_is_there(condition: Condition) -> None:
    """A planner has every member that one must have, with the same parameters."""
    planner = condition.planner
    must = "a planner must be a Component, so that a configuration can name it"
    demand(isinstance(planner, Component), condition, must, type(planner).__name__)
    missing = [name for name in MEMBERS if not hasattr(planner, name)]
    must = "a planner must have every member of evoexp.planners.planner.Planner (PlannerDefaults "
    must += "gives the usual answers)"
    demand(not missing, condition, must, f"without {', '.join(missing)}")
    for name, wanted in MEMBERS.items():
        if not inspect.isfunction(wanted):
            continue
        method, expected = getattr(planner, name), list(inspect.signature(wanted).parameters)[1:]
        demand(callable(method), condition, f"{name} must be a method", type(method).__name__)
        try:
            inspect.signature(method).bind(*expected)
        except TypeError:
            must = f"{name} must take ({', '.join(expected)})"
            demand(False, condition, must, f"{name}{inspect.signature(method)}")
    known: Any = planner
    choices = {"reproducibility": get_args(Reproducibility), "is_reference": (False, True)}
    for name, values in choices.items():
        must = f"{name} must be one of {', '.join(map(repr, values))}"
        demand(getattr(known, name) in values, condition, must, repr(getattr(known, name)))
    must = "revision must be a whole number, at least 1"
    demand(type(known.revision) is int and known.revision > 0, condition, must, known.revision)


def a_condition_survives_its_json(condition: Condition) -> None:
    """A condition read back from its canonical form, or unpickled, is the same with one hash."""
    forms = {
        "from its JSON": Condition.from_json(condition.to_json()),
        "from a pickle": pickle.loads(pickle.dumps(condition)),
    }
    for how, again in forms.items():
        must = f"a condition read back {how} must be equal and have the same hash"
        demand(again == condition and again.id == condition.id, condition, must, again.id[:12])


def the_same_seed_gives_the_same_bits(condition: Condition) -> None:
    """A replicate run twice has one digest; another replicate has another one."""
    first, other = finished(condition, 0), finished(condition, 1)
    again = finished.__wrapped__(condition, 0)
    must = "two runs of one replicate must agree in every bit (keep nothing from run to run)"
    was = f"{first.summary.digest} and {again.summary.digest}"
    demand(first.summary.digest == again.summary.digest, condition, must, was)
    must = "another replicate must use its own random numbers and so give other bits"
    was = f"one digest, {first.summary.digest}"
    demand(other.summary.digest != first.summary.digest, condition, must, was)


def randomness_comes_from_the_given_generator(condition: Condition) -> None:
    """Only `rng` is drawn from, only while the planner evolves, and never kept."""
    must = "random numbers must come from rng, never from a global generator"
    demand(not evolution(condition).global_randomness, condition, must, "another state of it")
    must = "evolve must draw its random numbers from rng"
    drawn = evolution(condition).has_drawn or condition.is_reference
    demand(drawn, condition, must, "a generator that nobody drew from")
    planner, problem = condition.prepare()
    rng = condition.rng(0)
    evolution_of_two = planner.evolve(problem, rng)
    next(evolution_of_two)
    state = rng.bit_generator.state
    for call in (planner.motion, planner.evaluate):
        call(problem, np.array(evolution(condition).last.best))
    must = "motion and evaluate must not draw from a generator that evolve was given"
    demand(rng.bit_generator.state == state, condition, must, "another state of it")
    evolution_of_two.close()
