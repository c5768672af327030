"""Checks of solutions: shape, terms, motion, and the arrays that hold them."""

import contextlib
import functools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from evoexp.condition import Condition
from evoexp.errors import EvoexpError, SettingError
from evoexp.paths.motion import Motion
from evoexp.planners.answers import num_values
from evoexp.robots.assembly import Robot
from evoexp.testing.contract import Demand, evolution, obligation

TOLERANCE = 1e-9  # [-] of numbers that pass through another unit on their way
NUM_SAMPLES = 6  # [-] individuals that are drawn and judged
# terms that describe how the search went, which no solution alone can know
OF_THE_SEARCH = {
    *("attempts", "sub_path", "phase", "cycles", "idle_cycles", "certificates", "iterations"),
    *("nodes", "plans", "first_solution_queries", "first_solution_length_deg"),
}


@obligation
def a_best_solution_is_never_changed(condition: Condition) -> Iterator[Demand]:
    """The array of a best solution keeps its values; a better solution is another array."""
    found = evolution(condition)
    for generation, afterwards in zip(found.generations, found.bests, strict=True):
        must = f"the best solution of generation {generation.index} must keep its values"
        is_same = np.array_equal(afterwards, generation.best)
        yield is_same, must, "changed later: yield a copy"


@obligation
def the_last_population_is_left_alone(condition: Condition) -> Iterator[Demand]:
    """The last population keeps its values after the planner has ended; the digest reads it."""
    found = evolution(condition)
    must = "the last population must keep its values after evolve has ended"
    yield np.array_equal(found.last.population, found.last_population), must, "changed"


@obligation
def solutions_have_the_documented_shape(condition: Condition) -> Iterator[Demand]:
    """A solution is flat, as long as `shape` says; `evaluate` refuses any other size."""
    found = evolution(condition)
    best, shape = found.last.best, found.planner.shape(found.problem)
    is_flat = best.ndim == 1 and best.dtype == np.float64
    yield is_flat, "a solution must be one flat array of float64", (best.shape, best.dtype)
    must = f"a solution must have the size that shape documents, {shape}"
    yield _fits(best.size, shape), must, best.size
    for wrong in (best[:-1], np.append(best, 0.0)):
        if not _fits(wrong.size, shape):
            with contextlib.suppress(ValueError, EvoexpError):
                found.planner.evaluate(found.problem, wrong)
                yield False, f"evaluate must refuse a solution of {wrong.size} values", "no error"


def _fits(size: int, shape: Any) -> bool:
    if len(shape) and shape[0] is ...:
        return size > 0 and size % num_values(shape[1:]) == 0
    return size == num_values(shape)


@functools.lru_cache(maxsize=8)
def _drawn(condition: Condition) -> Any:
    """Draw individuals; None of references and plans of stages, which have no one population."""
    planner, problem = condition.prepare()
    with contextlib.suppress(SettingError):  # by which a planner of several stages refuses
        if not condition.is_reference:
            return planner.sample(problem, condition.rng(0), NUM_SAMPLES)
    return None


@obligation
def samples_are_judged_alike(condition: Condition) -> Iterator[Demand]:
    """Individuals are drawn from `rng` alone, and judged alike alone, together, and twice."""
    if (drawn := _drawn(condition)) is None:
        return
    found = evolution(condition)
    planner, problem = found.planner, found.problem
    must = f"sample must return {NUM_SAMPLES} individuals when asked for {NUM_SAMPLES}"
    yield NUM_SAMPLES in drawn.shape, must, f"an array {drawn.shape}"
    again = planner.sample(problem, condition.rng(0), NUM_SAMPLES)
    must = "sample must draw the same individuals from the same state of rng"
    yield np.array_equal(drawn, again), must, "others"
    costs = np.array(planner.cost(problem, again).cost)
    must = "cost must leave the population as it is"
    yield np.array_equal(drawn, again), must, "a changed population"
    must = f"cost must judge each of {NUM_SAMPLES} individuals by a number or inf"
    yield costs.shape == (NUM_SAMPLES,) and not np.isnan(costs).any(), must, costs
    twice = np.array(planner.cost(problem, again).cost)
    must = "cost must return the same costs a second time"
    yield np.array_equal(costs, twice), must, f"{costs}, then {twice}"
    if found.last.costs.ndim == 1:  # else individuals are judged by those beside them
        axis = -1 if drawn.shape[-1] == NUM_SAMPLES else 0
        single = (np.ascontiguousarray(drawn.take([k], axis)) for k in range(NUM_SAMPLES))
        alone = np.array([planner.cost(problem, each).cost[0] for each in single])
        must = "cost must return the same for an individual alone and among others"
        yield np.array_equal(costs, alone), must, f"{alone} alone, {costs} together"


@obligation
def recorded_costs_are_those_of_the_population(condition: Condition) -> Iterator[Demand]:
    """`cost` gives the recorded costs, where populations are recorded as they are drawn."""
    if (drawn := _drawn(condition)) is None:
        return
    found = evolution(condition)
    for generation in found.generations:
        population, costs = generation.population, generation.costs
        as_drawn = population.shape == (*drawn.shape[:-1], costs.size)
        if costs.ndim == 1 and as_drawn and not OF_THE_SEARCH & generation.terms.keys():
            judged = found.planner.cost(found.problem, np.ascontiguousarray(population)).cost
            where = f"generation {generation.index}"
            must = f"costs of {where} must equal what cost returns for its population"
            yield np.array_equal(judged, costs), must, "others"


@obligation
def a_solved_solution_is_one_of_the_task(condition: Condition) -> Iterator[Demand]:
    """`departures` gives phrases, and none where the planner's own model accepts its best."""
    found = evolution(condition)
    departures = found.planner.departures(found.problem, np.array(found.last.best))
    is_text = not isinstance(departures, str) and all(isinstance(one, str) for one in departures)
    yield is_text, "departures must return phrases", departures
    must = "the best solution is solved, so departures must return none"
    yield not (found.last.solved and departures), must, departures


@obligation
def terms_agree_with_evaluate(condition: Condition) -> Iterator[Demand]:
    """`evaluate` gives the recorded terms of the best solution, and numbers only."""
    found = evolution(condition)
    recorded = found.last.terms
    terms = found.planner.evaluate(found.problem, np.array(found.last.best))
    wrong = {k: v for k, v in terms.items() if not isinstance(v, int | float | np.number)}
    yield not wrong, "evaluate must return numbers by name", wrong
    if not condition.is_reference:  # whose terms describe more than a solution
        missing = sorted(recorded.keys() - terms.keys() - OF_THE_SEARCH)
        must = "evaluate must name every recorded term of a solution"
        yield not missing, must, f"without {', '.join(missing)}"
    for name in sorted(recorded.keys() & terms.keys()):
        one, two = float(recorded[name]), float(terms[name])
        same = math.isclose(one, two, rel_tol=1e-6, abs_tol=TOLERANCE)
        both_nan = math.isnan(one) and math.isnan(two)
        must = f"evaluate must give the recorded {name} of the best solution, {one!r}"
        yield same or both_nan, must, repr(two)
    told, cost = float(found.planner.cost_of_terms(terms)), found.last.best_cost
    must = f"cost_of_terms must give the recorded cost of the best solution, {cost!r}"
    same = math.isclose(cost, told, rel_tol=TOLERANCE, abs_tol=TOLERANCE)
    yield same or math.isnan(told) or not math.isfinite(cost), must, repr(told)


@obligation
def motions_fit_the_robot(condition: Condition) -> Iterator[Demand]:
    """A motion has the robot's joints, finite, within their limits; or there is no motion."""
    found = evolution(condition)
    for best in (found.generations[0].best, found.last.best):
        given = np.array(best)
        motion = found.planner.motion(found.problem, given)
        yield np.array_equal(given, best), "motion must not change a solution", "so"
        if motion is None:
            continue
        must = "motion must return a Motion, or None where the answer is no motion"
        yield isinstance(motion, Motion), must, type(motion).__name__
        assert isinstance(condition.robot, Robot)
        model = condition.robot.build().model
        must = f"a motion must have one column per joint coordinate, {model.nq}"
        yield motion.q.shape[1:] == (model.nq,), must, motion.q.shape
        yield np.isfinite(motion.q).all(), "a motion must be finite", "inf or NaN"
        low, high = model.lowerPositionLimit, model.upperPositionLimit
        for joint, values in enumerate(motion.q.T):
            limits = f"{low[joint] - TOLERANCE:.6g} to {high[joint] + TOLERANCE:.6g}"
            must = f"joint {joint + 1} must stay within its limits, {limits}"
            inside = (values >= low[joint] - TOLERANCE) & (values <= high[joint] + TOLERANCE)
            yield inside.all(), must, f"{values.min():.6g} to {values.max():.6g}"


@obligation
def pieces_cover_the_motion(condition: Condition) -> Iterator[Demand]:
    """`parts` divides a motion without gaps; `security_margin` is a distance."""
    found = evolution(condition)
    motion = found.planner.motion(found.problem, np.array(found.last.best))
    if motion is None:
        return
    ends = [(part.first, part.last) for part in found.planner.parts(found.problem, motion)]
    must = f"parts must follow each other from instant 0 to {motion.num_segments}"
    joints = [0, *(last for _, last in ends)]  # where each part begins, and the last one ends
    follow = [first for first, _ in ends] == joints[:-1]
    yield follow and joints[-1] == (motion.num_segments if ends else 0), must, ends
    margin = found.planner.security_margin(found.problem)
    yield 0.0 <= margin < math.inf, "security_margin must be a distance, at least 0", margin


@obligation
def the_local_operator_leaves_its_argument_alone(condition: Condition) -> Iterator[Demand]:
    """`improve` returns None, or another population of the same shape."""
    if (drawn := _drawn(condition)) is None:
        return
    found, population = evolution(condition), drawn.copy()
    improved = found.planner.improve(found.problem, population, condition.rng(1))
    must = "improve must leave the given population as it is"
    yield np.array_equal(drawn, population), must, "changed"
    if improved is not None:
        must = f"improve must return a finite population of shape {drawn.shape}, or None"
        fits = improved.shape == drawn.shape and bool(np.isfinite(improved).all())
        yield fits, must, improved.shape


@obligation
def tables_and_remarks_can_be_printed(condition: Condition) -> Iterator[Demand]:
    """`listing` returns None or rows as long as their names; `notes` returns lines of text."""
    found = evolution(condition)
    listing = found.planner.listing(found.problem, np.array(found.last.best))
    if listing is not None:
        must = f"every row of listing must have one value per name, {len(listing[0])}"
        yield all(len(row) == len(listing[0]) for row in listing[1]), must, listing[1]
    notes = list(found.planner.notes(found.problem))
    are_lines = all(isinstance(note, str) and "\n" not in note for note in notes)
    yield are_lines, "notes must return lines of text", notes
