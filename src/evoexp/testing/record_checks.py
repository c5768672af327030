"""Checks of the records that a planner yields: counts, costs, finite numbers."""

import itertools
import math

import numpy as np

from evoexp.condition import Condition
from evoexp.store.log_reader import read_log
from evoexp.testing.evolution_record import demand, evolution, finished

BETTER_THAN_ALONE = {"team_cost", "sub_path", "phase"}
"""Terms of planners whose best is more than one individual: a team, or a whole plan."""
STARTS_ANEW = "attempts"  # a term of planners that begin again where an attempt has failed


def generations_are_numbered(condition: Condition) -> None:
    """Generations count from 0 without a gap, and are no more than announced."""
    found = evolution(condition)
    indices = [generation.index for generation in found.generations]
    must = "generations must be numbered 0, 1, 2, …, the initial population being 0"
    demand(indices == list(range(len(indices))), condition, must, indices)
    if STARTS_ANEW in found.last.terms:
        return
    announced = found.planner.num_generations
    must = f"generations after the initial one must be at most num_generations ({announced})"
    demand(indices[-1] <= announced, condition, must, indices[-1])


def evaluations_add_up(condition: Condition) -> None:
    """Evaluations grow by what `num_evaluations` announces for each generation.

    The last generation may have fewer where the planner ends by itself.
    """
    found = evolution(condition)
    counts = [generation.evaluations for generation in found.generations]
    must = "evaluations must grow with every generation"
    demand(all(a < b for a, b in itertools.pairwise([0, *counts])), condition, must, counts)
    if condition.is_reference or STARTS_ANEW in found.last.terms:
        return
    costs = found.generations[0].costs  # of several populations at once, there is a row for each
    each = found.planner.num_evaluations
    rows = len(costs) if costs.ndim > 1 else 1
    announced = itertools.accumulate(rows * each(index) for index in range(len(counts)))
    for index, (wanted, was) in enumerate(zip(announced, counts, strict=True)):
        must = f"evaluations up to generation {index} must be the sum of num_evaluations, {wanted}"
        ends = bool(found.generations[index].stop_reason)
        demand(was == wanted or (ends and was < wanted), condition, must, was)


def collision_queries_never_decrease(condition: Condition) -> None:
    """Collision queries are counted since the start."""
    counts = [generation.collision_queries for generation in evolution(condition).generations]
    must = "collision_queries are counted since the start: they must never decrease"
    demand(all(a <= b for a, b in itertools.pairwise([0, *counts])), condition, must, counts)


def the_best_so_far_never_gets_worse(condition: Condition) -> None:
    """The best cost is the least of all generations so far, or the least that was proven."""
    found = evolution(condition)
    generations, lowest = found.generations, np.inf
    if found.planner.answers_are_proven:  # and cheaper ones may be refuted
        costs = [generation.best_cost for generation in generations]
        must = "best_cost must never get worse, and be no less than the least cost so far"
        least = np.minimum.accumulate([each.best_cost_in_generation for each in generations])
        never_worse = all(a >= b for a, b in itertools.pairwise(costs))
        demand(never_worse and bool(np.all(costs >= least)), condition, must, costs)
        return
    for generation in generations:
        lowest = min(lowest, generation.best_cost_in_generation)
        must = f"best_cost must be the least cost so far ({lowest!r} in generation "
        must += f"{generation.index})"
        demand(generation.best_cost == lowest, condition, must, repr(generation.best_cost))


def costs_are_those_of_the_generation(condition: Condition) -> None:
    """Least and mean cost and the number of feasible individuals agree with the costs."""
    for generation in evolution(condition).generations:
        costs, where = generation.costs, f" in generation {generation.index}"
        must = f"num_feasible must lie between 0 and the number of costs, {costs.size},{where}"
        fits = 0 <= generation.num_feasible <= costs.size
        demand(fits, condition, must, generation.num_feasible)
        if costs.ndim != 1:  # the best is a team of several populations
            continue
        least = generation.best_cost_in_generation
        must = f"best_cost_in_generation must be the least of costs, {costs.min()!r},{where}"
        demand(least == costs.min(), condition, must, repr(least))
        if BETTER_THAN_ALONE & generation.terms.keys():
            continue
        finite = costs[np.isfinite(costs)]
        wanted = (finite.mean(), finite.std()) if finite.size else (np.nan, np.nan)
        was = (generation.mean_cost, generation.std_cost)
        size = float(np.abs(finite).max()) if finite.size else 0.0
        fits = np.allclose(was, wanted, rtol=1e-9, atol=1e-9 * size, equal_nan=True)
        must = f"mean_cost and std_cost must be those of the finite costs, {wanted},{where}"
        demand(fits, condition, must, was)


def numbers_are_finite(condition: Condition) -> None:
    """Solutions, populations and terms are finite; costs are numbers or inf, never NaN."""
    for generation in evolution(condition).generations:
        where = f" in generation {generation.index}"
        for name, values in (("best", generation.best), ("population", generation.population)):
            must = f"{name} must hold finite numbers{where}"
            demand(np.all(np.isfinite(values)), condition, must, "inf or NaN")
        must = f"costs must be numbers, or inf where an individual is infeasible{where}"
        demand(not np.isnan(generation.costs).any(), condition, must, "NaN")
        must = f"solved must be true or false{where}"
        demand(type(generation.solved) is bool, condition, must, repr(generation.solved))
        wrong = {k: v for k, v in generation.terms.items() if not isinstance(v, int | float)}
        must = f"terms must be numbers by name{where}"
        demand(not wrong, condition, must, wrong)


def the_summary_says_what_the_log_says(condition: Condition) -> None:
    """The summary of a replicate has the numbers of its last generation."""
    log = read_log(finished(condition, 0).content)
    last, summary = log.generations[-1], log.summary
    for name in ("best_cost", "evaluations", "collision_queries", "solved"):
        was, wanted = getattr(summary, name), getattr(last, name)
        must = f"{name} of the summary must be that of the last generation, {wanted}"
        demand(was == wanted, condition, must, was)
    found = evolution(condition)  # which no cap on collision queries ends
    evaluated = found.planner.evaluate(found.problem, np.array(log.solutions[-1].values))
    must = "terms of the summary must be those that are recorded and those of evaluate"
    given, wanted = (sorted(terms.items()) for terms in (summary.terms, last.terms | evaluated))
    demand(repr(given) == repr(wanted), condition, must, summary.terms)  # NaN equals NaN
    must = f"the last logged solution must have the best cost, {last.best_cost}"
    same = log.solutions[-1].cost == last.best_cost or math.isnan(last.best_cost)
    demand(same, condition, must, log.solutions[-1].cost)
