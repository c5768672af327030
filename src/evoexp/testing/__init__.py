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

from evoexp.testing.contract import CHECKS, Check, check_planner, conditions
from evoexp.testing.evolution_record import ContractBroken
from evoexp.testing.operator_checks import check_operator, crossed, mutated, selected

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
