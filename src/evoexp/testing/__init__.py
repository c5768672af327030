"""The obligations of a planner as tests: for planners of other packages and for evoexp's own.

A test file of a package needs these lines only:

    import pytest
    from evoexp.testing import CHECKS, Check, conditions

    CONDITIONS = conditions("experiment=my_experiment")

    @pytest.mark.parametrize("label", CONDITIONS)
    @pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
    def test_a_planner_keeps_its_obligations(check: Check, label: str) -> None:
        check(CONDITIONS[label])

Operators have `check_operator`, and `selected`, `crossed` and `mutated`, which call their kernels.
A check that fails raises `ContractBroken`, whose message says what a planner or an
operator must do, and what this one did.
"""

import evoexp.testing.solution_checks  # noqa: F401  # adds its checks
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.testing.contract import (
    CHECKS,
    Check,
    ContractBroken,
    check_operator,
    crossed,
    mutated,
    selected,
)

__all__ = [
    "CHECKS",
    "Check",
    "ContractBroken",
    "check_operator",
    "check_planner",
    "conditions",
    "crossed",
    "mutated",
    "selected",
]


def conditions(*overrides: str, budget: str = "smoke") -> dict[str, Condition]:
    """Return the conditions of an experiment by their labels.

    Args:
        overrides: As on the command line: `experiment=my_experiment`, `ga.num_offspring=4`.
        budget: Name of the budget; `smoke` takes seconds.

    Raises:
        EvoexpError: If the experiment cannot be run.
    """
    experiments = compose.expand([*overrides, f"budget={budget}"])
    return {label: condition for each in experiments for label, condition in each.conditions}


def check_planner(condition: Condition) -> None:
    """Check every obligation of a condition's planner, at a small budget.

    Raises:
        ContractBroken: For the first obligation that the planner does not keep.
    """
    for check in CHECKS:
        check(condition)
