"""Checks of solutions: shape, terms, motion, and the arrays that hold them."""

import math
from typing import Any

import numpy as np

from evoexp.condition import Condition
from evoexp.errors import EvoexpError
from evoexp.paths.motion import Motion
from evoexp.planners.answers import num_values
from evoexp.records import FloatArray
from evoexp.robots.assembly import Robot
from evoexp.testing.evolution_record import demand, evolution
from evoexp.testing.protocol_checks import has_one_population

TOLERANCE = 1e-9  # [-] of numbers that pass through another unit on their way
OF_THE_SEARCH = {
    *("attempts", "sub_path", "phase", "cycles", "idle_cycles"),
    "certificates",
    *("iterations", "nodes", "plans", "first_solution_queries", "first_solution_length_deg"),
}
"""Terms that describe how the search went, which no solution alone can know."""
NUM_SAMPLES = 6  # [-] individuals that are drawn and judged


def a_best_solution_is_never_changed(condition: Condition) -> None:
    """The array of a best solution keeps its values; a better solution is another array."""
    found = evolution(condition)
    for generation, afterwards in zip(found.generations, found.bests, strict=True):
        must = f"the best solution of generation {generation.index} must keep its values"
        is_same = np.array_equal(afterwards, generation.best)
        demand(is_same, condition, must, "changed later: yield a copy")


def the_last_population_is_left_alone(condition: Condition) -> None:
    """The last population keeps its values after the planner has ended; the digest reads it."""
    found = evolution(condition)
    must = "the last population must keep its values after evolve has ended"
    same = np.array_equal(found.last.population, found.last_population)
    demand(same, condition, must, "changed")


def solutions_have_the_documented_shape(condition: Condition) -> None:
    """A solution is flat, as long as `shape` says; `evaluate` refuses any other size."""
    found = evolution(condition)
    best, shape = found.last.best, found.planner.shape(found.problem)
    must = "a solution must be one flat array of float64"
    demand(best.ndim == 1 and best.dtype == np.float64, condition, must, (best.shape, best.dtype))
    must = f"a solution must have the size that shape documents, {shape}"
    demand(_fits(best.size, shape), condition, must, best.size)
    for wrong in (best[:-1], np.append(best, 0.0)):
        if _fits(wrong.size, shape):
            continue
        try:
            found.planner.evaluate(found.problem, wrong)
        except (ValueError, EvoexpError):
            continue
        must = f"evaluate must refuse a solution of {wrong.size} values"
        demand(False, condition, must, "no error")


def _fits(size: int, shape: Any) -> bool:
    """Return whether a flat solution of this size can have a documented shape."""
    if len(shape) and shape[0] is ...:
        return size > 0 and size % num_values(shape[1:]) == 0
    return size == num_values(shape)


def samples_are_judged_alike(condition: Condition) -> None:
    """Individuals are drawn from `rng` alone, and judged alike alone, together, and twice."""
    if not has_one_population(condition):
        return
    found = evolution(condition)
    planner, problem = found.planner, found.problem
    drawn = planner.sample(problem, condition.rng(0), NUM_SAMPLES)
    must = f"sample must return {NUM_SAMPLES} individuals where so many are asked for"
    demand(NUM_SAMPLES in drawn.shape, condition, must, f"an array {drawn.shape}")
    again = planner.sample(problem, condition.rng(0), NUM_SAMPLES)
    must = "sample must draw the same individuals from the same state of rng"
    demand(np.array_equal(drawn, again), condition, must, "others")
    costs = np.array(planner.cost(problem, drawn).cost)
    must = "cost must leave the population as it is"
    demand(np.array_equal(drawn, again), condition, must, "a changed population")
    must = f"cost must judge each of {NUM_SAMPLES} individuals by a number or inf"
    demand(costs.shape == (NUM_SAMPLES,) and not np.isnan(costs).any(), condition, must, costs)
    twice = np.array(planner.cost(problem, drawn).cost)
    must = "cost must judge a population alike a second time"
    demand(np.array_equal(costs, twice), condition, must, f"{costs}, then {twice}")
    if found.last.costs.ndim == 1:  # else individuals are judged by those beside them
        axis = -1 if drawn.shape[-1] == NUM_SAMPLES else 0
        single = (np.ascontiguousarray(drawn.take([k], axis)) for k in range(NUM_SAMPLES))
        alone = np.array([planner.cost(problem, each).cost[0] for each in single])
        must = "cost must judge an individual the same alone and among others"
        demand(np.array_equal(costs, alone), condition, must, f"{alone} alone, {costs} together")


def recorded_costs_are_those_of_the_population(condition: Condition) -> None:
    """`cost` gives the recorded costs, where populations are recorded as they are drawn."""
    if not has_one_population(condition):
        return
    found = evolution(condition)
    drawn = found.planner.sample(found.problem, condition.rng(0), NUM_SAMPLES)
    for generation in found.generations:
        population, costs = generation.population, generation.costs
        as_drawn = population.shape == (*drawn.shape[:-1], costs.size)
        if costs.ndim == 1 and as_drawn and not OF_THE_SEARCH & generation.terms.keys():
            judged = found.planner.cost(found.problem, np.ascontiguousarray(population)).cost
            must = f"costs of generation {generation.index} must be those that cost gives its "
            must += "population"
            demand(np.array_equal(judged, costs), condition, must, "others")


def a_solved_solution_is_one_of_the_task(condition: Condition) -> None:
    """`departures` gives phrases, and none where the planner's own model accepts its best."""
    found = evolution(condition)
    departures = found.planner.departures(found.problem, np.array(found.last.best))
    is_text = not isinstance(departures, str) and all(isinstance(one, str) for one in departures)
    demand(is_text, condition, "departures must return phrases", departures)
    if found.last.solved:
        must = "the best solution is solved, so departures must return none"
        demand(not departures, condition, must, departures)


def terms_agree_with_evaluate(condition: Condition) -> None:
    """`evaluate` gives the recorded terms of the best solution, and numbers only."""
    found = evolution(condition)
    terms = found.planner.evaluate(found.problem, np.array(found.last.best))
    wrong = {k: v for k, v in terms.items() if not isinstance(v, int | float | np.number)}
    demand(not wrong, condition, "evaluate must return numbers by name", wrong)
    recorded = found.last.terms
    if not condition.is_reference:  # whose terms describe more than a solution
        missing = sorted(recorded.keys() - terms.keys() - OF_THE_SEARCH)
        must = "evaluate must name every recorded term of a solution"
        demand(not missing, condition, must, f"without {', '.join(missing)}")
    for name in sorted(recorded.keys() & terms.keys()):
        one, two = float(recorded[name]), float(terms[name])
        same = math.isclose(one, two, rel_tol=1e-6, abs_tol=TOLERANCE)
        both_nan = math.isnan(one) and math.isnan(two)
        must = f"evaluate must give the recorded {name} of the best solution, {one!r}"
        demand(same or both_nan, condition, must, repr(two))
    told, cost = float(found.planner.cost_of_terms(terms)), found.last.best_cost
    if math.isfinite(cost) and not math.isnan(told):
        must = f"cost_of_terms must give the recorded cost of the best solution, {cost!r}"
        same = math.isclose(cost, told, rel_tol=TOLERANCE, abs_tol=TOLERANCE)
        demand(same, condition, must, repr(told))


def motions_fit_the_robot(condition: Condition) -> None:
    """A motion has the robot's joints, finite, within their limits; or there is no motion."""
    found = evolution(condition)
    for best in (found.generations[0].best, found.last.best):
        given = np.array(best)
        motion = found.planner.motion(found.problem, given)
        demand(np.array_equal(given, best), condition, "motion must not change a solution", "so")
        if motion is None:
            continue
        must = "motion must return a Motion, or None where the answer is no motion"
        demand(isinstance(motion, Motion), condition, must, type(motion).__name__)
        assert isinstance(condition.robot, Robot)
        model = condition.robot.build().model
        must = f"a motion must have one column per joint coordinate, {model.nq}"
        demand(motion.q.shape[1:] == (model.nq,), condition, must, motion.q.shape)
        demand(np.isfinite(motion.q).all(), condition, "a motion must be finite", "inf or NaN")
        low, high = model.lowerPositionLimit - TOLERANCE, model.upperPositionLimit + TOLERANCE
        for joint in range(model.nq):
            values: FloatArray = motion.q[:, joint]
            must = f"joint {joint + 1} must stay within its limits, {low[joint]:.6g} to "
            must += f"{high[joint]:.6g}"
            inside = (values >= low[joint]).all() and (values <= high[joint]).all()
            demand(inside, condition, must, f"{values.min():.6g} to {values.max():.6g}")


def pieces_cover_the_motion(condition: Condition) -> None:
    """`parts` divides a motion without gaps; `security_margin` is a distance."""
    found = evolution(condition)
    motion = found.planner.motion(found.problem, np.array(found.last.best))
    if motion is None:
        return
    parts = found.planner.parts(found.problem, motion)
    ends = [(part.first, part.last) for part in parts]
    must = f"parts must follow each other from instant 0 to {motion.num_segments}"
    starts = [0, *(last for _, last in ends[:-1])] if ends else []
    follow = [first for first, _ in ends] == starts
    demand(follow and (not ends or ends[-1][1] == motion.num_segments), condition, must, ends)
    margin = found.planner.security_margin(found.problem)
    must = "security_margin must be a distance, at least 0"
    demand(0.0 <= margin < math.inf, condition, must, margin)


def the_local_operator_leaves_its_argument_alone(condition: Condition) -> None:
    """`improve` returns None, or another population of the same shape."""
    if not has_one_population(condition):
        return
    found = evolution(condition)
    drawn = found.planner.sample(found.problem, condition.rng(0), NUM_SAMPLES)
    kept = drawn.copy()
    improved = found.planner.improve(found.problem, drawn, condition.rng(1))
    must = "improve must leave the given population as it is"
    demand(np.array_equal(drawn, kept), condition, must, "changed")
    if improved is not None:
        must = f"improve must return a finite population of shape {drawn.shape}, or None"
        fits = improved.shape == drawn.shape and bool(np.isfinite(improved).all())
        demand(fits, condition, must, improved.shape)


def tables_and_remarks_can_be_printed(condition: Condition) -> None:
    """`listing` returns None or rows as long as their names; `notes` returns lines of text."""
    found = evolution(condition)
    listing = found.planner.listing(found.problem, np.array(found.last.best))
    if listing is not None:
        names, rows = listing
        must = f"every row of listing must have one value per name, {len(names)}"
        demand(all(len(row) == len(names) for row in rows), condition, must, rows)
    notes = list(found.planner.notes(found.problem))
    must = "notes must return lines of text"
    demand(
        all(isinstance(note, str) and "\n" not in note for note in notes), condition, must, notes
    )
