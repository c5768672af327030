"""The obligations of a planner as tests: for planners of other packages and for evoexp's own.

A test file of a package needs these lines only:

    import pytest
    from evoexp.testing import CHECKS, Check, conditions

    CONDITIONS = conditions("experiment=my_experiment")

    @pytest.mark.parametrize("label", CONDITIONS)
    @pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
    def test_a_planner_keeps_its_obligations(check: Check, label: str) -> None:
        check(CONDITIONS[label])

A check that fails raises `ContractBroken`, whose message says what a planner must do and what this
planner did.
"""

from evoexp.testing.contract import CHECKS, Check, check_planner
from evoexp.testing.evolution_record import ContractBroken
from evoexp.testing.small_conditions import conditions

__all__ = ["CHECKS", "Check", "ContractBroken", "check_planner", "conditions"]
