"""The planner keeps every obligation of a planner, in every condition of its experiment."""

import pytest

from evoexp.records import generations
from evoexp.testing import CHECKS, Check, conditions

CONDITIONS = conditions("experiment=my_planner")


@pytest.mark.parametrize("label", CONDITIONS)
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_planner_keeps_its_obligations(check: Check, label: str) -> None:
    check(CONDITIONS[label])


def test_the_search_finds_shorter_paths_than_it_began_with() -> None:
    planner, problem = CONDITIONS["λ = 4"].prepare()
    costs = [
        each.best_cost for each in generations(planner.evolve(problem, CONDITIONS["λ = 4"].rng(0)))
    ]
    assert costs[-1] < costs[0]
