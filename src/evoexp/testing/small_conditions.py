"""The conditions of an experiment at a small budget, for tests."""

from evoexp.condition import Condition
from evoexp.configuration import compose


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
