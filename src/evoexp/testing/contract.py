"""The obligations of a planner, each a check of one condition; `planners/planner.py` explains them.

Every check takes a condition, runs its replicate 0 (once for all checks) and raises
`ContractBroken` where the planner does something else.
"""

from collections.abc import Callable

from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.testing import protocol_checks as protocol
from evoexp.testing import record_checks as records
from evoexp.testing import solution_checks as solutions

Check = Callable[[Condition], None]

CHECKS: tuple[Check, ...] = (
    protocol.every_member_is_there,
    protocol.a_condition_survives_its_json,
    protocol.the_same_seed_gives_the_same_bits,
    protocol.randomness_comes_from_the_given_generator,
    records.generations_are_numbered,
    records.evaluations_add_up,
    records.collision_queries_never_decrease,
    records.the_best_so_far_never_gets_worse,
    records.costs_are_those_of_the_generation,
    records.numbers_are_finite,
    records.the_summary_says_what_the_log_says,
    solutions.a_best_solution_is_never_changed,
    solutions.the_last_population_is_left_alone,
    solutions.solutions_have_the_documented_shape,
    solutions.samples_are_judged_alike,
    solutions.recorded_costs_are_those_of_the_population,
    solutions.terms_agree_with_evaluate,
    solutions.a_solved_solution_is_one_of_the_task,
    solutions.motions_fit_the_robot,
    solutions.pieces_cover_the_motion,
    solutions.the_local_operator_leaves_its_argument_alone,
    solutions.tables_and_remarks_can_be_printed,
)


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
