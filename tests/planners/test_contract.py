"""What every planner keeps to, in every kind of shipped condition."""

import functools

import numpy as np
import pyarrow as pa
import pytest

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.records import flatten
from evoexp.store.log import Finished
from evoexp.store.log_reader import read_log, read_summary
from shipped_conditions import KINDS, kinds_of_conditions


@pytest.fixture(params=KINDS)
def condition(request: pytest.FixtureRequest) -> Condition:
    return kinds_of_conditions("smoke")[request.param]


@functools.cache
def finished(condition: Condition, replicate: int) -> Finished:
    return run_replicate(condition, replicate)


def test_same_seed_same_bits_other_replicate_other_bits(condition: Condition) -> None:
    first, again, other = (
        finished(condition, 0),
        run_replicate(condition, 0),
        finished(condition, 1),
    )
    assert first.summary.digest == again.summary.digest
    assert first.summary.digest != other.summary.digest


def test_records_are_consistent(condition: Condition) -> None:
    log = read_log(finished(condition, 0).content)
    rows = log.generations
    assert [row.index for row in rows] == list(range(len(rows)))
    assert all(b.best_cost <= a.best_cost for a, b in zip(rows, rows[1:], strict=False)), (
        "best so far is monotone"
    )
    assert all(row.best_cost <= row.best_cost_in_generation for row in rows)
    if (
        not {"team_cost", "sub_path", "phase"} & rows[0].terms.keys()
    ):  # else the best is a team, or a whole plan
        assert all(
            row.best_cost_in_generation <= row.mean_cost
            for row in rows
            if np.isfinite(row.mean_cost)
        )
    assert all(b.evaluations > a.evaluations for a, b in zip(rows, rows[1:], strict=False))
    assert log.summary.best_cost == rows[-1].best_cost == log.solutions[-1].cost
    assert log.summary.evaluations == rows[-1].evaluations
    assert log.summary.solved == rows[-1].solved


def test_the_summary_is_the_row_that_its_log_gives(condition: Condition) -> None:
    content, summary = finished(condition, 0)
    given, read = (
        pa.Table.from_pylist([flatten(each)]) for each in (summary, read_summary(content))
    )
    assert set(given.schema) == set(read.schema)
    assert repr(sorted(given.to_pylist()[0].items())) == repr(
        sorted(read.to_pylist()[0].items())
    )  # NaN equals NaN


def test_the_best_solution_is_worth_what_was_recorded(condition: Condition) -> None:
    planner, problem = condition.prepare()
    log = read_log(finished(condition, 0).content)
    terms = planner.evaluate(problem, log.solutions[-1].values)
    recorded = log.generations[-1].terms
    if not condition.is_reference:  # whose own numbers are not a solution's
        search = {"attempts", "sub_path", "phase", "cycles", "idle_cycles"}
        assert recorded.keys() - terms.keys() <= search, "what only the search knows"
    common = recorded.keys() & terms.keys()  # equal but for the rounding of a solution's units
    assert {name: recorded[name] for name in common} == pytest.approx(
        {name: terms[name] for name in common}, abs=1e-9
    )
    assert log.summary.terms == recorded | terms


def test_costs_and_populations_are_views_that_hold_until_the_next_generation(
    condition: Condition,
) -> None:
    planner, problem = condition.prepare()
    best = np.inf
    for generation in planner.evolve(problem, condition.rng(0)):
        assert np.all(np.isfinite(generation.population))
        if (
            generation.costs.ndim == 1
        ):  # else the best is a team of several populations, or a plan of several searches
            assert generation.costs.min() == generation.best_cost_in_generation
        best = min(best, generation.best_cost_in_generation)
        assert generation.best_cost == best
        assert generation.num_feasible <= generation.costs.size


def test_a_best_solution_is_never_changed(condition: Condition) -> None:
    planner, problem = condition.prepare()
    best, values = np.empty(0), np.empty(0)
    for generation in planner.evolve(problem, condition.rng(0)):
        assert np.array_equal(best, values)
        best, values = generation.best, generation.best.copy()


def test_the_last_population_is_left_alone_after_its_generation(condition: Condition) -> None:
    planner, problem = condition.prepare()
    generations = planner.evolve(problem, condition.rng(0))
    last = None
    for last in generations:
        kept = last.population.copy()
    assert last is not None
    assert np.array_equal(last.population, kept)


def test_motions_fit_the_robot(condition: Condition) -> None:
    planner, problem = condition.prepare()
    generation = next(planner.evolve(problem, condition.rng(0)))
    motion = planner.motion(problem, generation.best)
    if motion is None:  # the answer is none
        return
    assert motion.q.shape[1] == condition.robot.build().model.nq
    assert np.all(np.isfinite(motion.q))


def test_a_condition_survives_its_json(condition: Condition) -> None:
    again = Condition.from_json(condition.to_json())
    assert again == condition
    assert again.id == condition.id
