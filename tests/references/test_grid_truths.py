"""What is known of the shipped maps, and the script that finds it."""

from typing import Any

import numpy as np
import pytest

import composed
from evoexp.references.grid_frontier import GridFrontier, known_maps
from references.test_grid_frontier import path_cost
from shipped_conditions import expanded

EXPERIMENTS = ("chen_path", "chen_lingering", "chen_claims")


@pytest.fixture(scope="module")
def script() -> Any:
    return composed.script("update-grid-truths")


def reference(label: str) -> Any:
    return dict(expanded("chen_path", "paper").conditions)[f"{label}, exact"].prepare()


def test_the_best_path_of_a_shipped_map_is_a_path_and_no_bound_is_above_it() -> None:
    own, problem = reference("(b)")
    known = known_maps()[own.key(problem)]
    costs = [path_cost(own.planner, problem, path) for path in known.paths]
    assert 32.567 < min(known.bounds) <= min(costs) < 32.7304
    for path in known.paths:
        assert (path[0], path[-1]) == problem.ends and len(set(path)) == len(path)
    assert own.truth(problem).cost == pytest.approx(min(costs), rel=1e-12)
    # a map is known by all that its truth depends on
    heavier = own.planner.objective.model_copy(update={"distance_weight": 0.123})
    planner_of_another = own.planner.model_copy(update={"objective": heavier})
    for update in ({"max_nodes": own.max_nodes - 1}, {"planner": planner_of_another}):
        assert own.model_copy(update=update).key(problem) not in known_maps()


@pytest.mark.matrix
@pytest.mark.parametrize(("label", "least"), [("(b)", 31.540), ("(c)", 55.998)])
def test_the_truth_of_the_papers_workspace_is_known_within_one_per_cent(
    label: str, least: float
) -> None:
    own, problem = reference(label)
    truth = own.truth(problem)
    assert least < truth.terms["lower_bound"] <= truth.cost
    assert truth.cost <= 1.01 * truth.terms["lower_bound"]


@pytest.mark.matrix
def test_every_shipped_map_is_known_and_nothing_else(script: Any) -> None:
    keys = set()
    for name in EXPERIMENTS:
        for _, condition in expanded(name, "paper").conditions:
            own = condition.planner
            if isinstance(own, GridFrontier) and script.is_searched(own):
                own, problem = condition.prepare()
                keys.add(own.key(problem))
    assert keys == known_maps().keys()


@pytest.mark.matrix
def test_the_script_finds_what_is_stored(script: Any) -> None:
    label = "(c), exact, every other obstacle"  # the fastest map
    own, problem = dict(expanded("chen_claims", "paper").conditions)[label].prepare()
    stored, found = known_maps()[own.key(problem)], script.searched(own, problem)
    assert (found.paths, found.improved) == (stored.paths, stored.improved)
    np.testing.assert_allclose(found.bounds, stored.bounds, rtol=1e-12)
