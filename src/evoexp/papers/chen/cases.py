"""Chen & Zalzala 1995, section 4.2.

Which conditions belong to one criterion, and what the paper prints of it.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.records import FloatArray
from evoexp.report.proportions import Proportion
from evoexp.report.results import ConditionResults, Results

METHODS = {
    "newton": "Newton-type",
    "bounded": "Newton-type, smooth form",
    "subgradient": "subgradient",
}
CLOSE = (0.001, 0.01)  # [-] gaps to the optimum that shares are told of


class Printed(NamedTuple):
    """What the paper prints of one criterion.

    Attributes:
        figure: Where.
        term: Which number of a posture it is.
        value: The number; NaN: only angles are printed.
        angles: θ1, θ2 [deg]; None: not printed.
    """

    figure: str
    term: str
    value: float
    angles: tuple[float, float] | None = None


PRINTED = {
    "least torque norm": Printed("Fig. 4", "torque_norm", 1.73),
    "minimax torque": Printed("Fig. 5", "torque_max", 0.90, (68.96, 41.74)),
    "obstacle and link 2": Printed("Fig. 6", "torque_norm", 2.08),
    "obstacle and platform": Printed("Fig. 7", "torque_norm", 3.01),
    "manipulability and torque": Printed("Fig. 8", "cost", np.nan, (114.24, -36.93)),
}


class Case(NamedTuple):
    """The conditions of one criterion; None: there is none with data.

    Attributes:
        name: Of the criterion, a key of PRINTED; else the label of the search.
        plain: The genetic algorithm without elitism.
        elitist: With elitism.
        search: Random search at equal evaluations.
        optimum: The exact one.
        conventional: Local methods from many starts.
        landscape: E over θ1 and θ2.
    """

    name: str
    plain: ConditionResults | None = None
    elitist: ConditionResults | None = None
    search: ConditionResults | None = None
    optimum: ConditionResults | None = None
    conventional: ConditionResults | None = None
    landscape: ConditionResults | None = None

    @property
    def evolved(self) -> dict[str, ConditionResults]:
        """What was run with many seeds, by a name for figures."""
        named = {"GA": self.plain, "GA, elitism": self.elitist, "random search": self.search}
        return {name: c for name, c in named.items() if c is not None}

    @property
    def any(self) -> ConditionResults:
        """Any of them: they share robot, task and criterion."""
        return next(c for c in self[1:] if isinstance(c, ConditionResults))

    @property
    def printed(self) -> Printed | None:
        """What the paper prints of it."""
        return PRINTED.get(self.name)

    @property
    def least(self) -> float:
        """E of the exact optimum; NaN where it was not computed."""
        return float(self.optimum.column("best_cost")[0]) if self.optimum is not None else np.nan

    def gaps(self, costs: FloatArray) -> FloatArray:
        """Return by how much costs are above the optimum, in units of it."""
        return costs / self.least - 1.0

    def within(self, costs: FloatArray, close: float) -> Proportion:
        """Return how many costs are within a gap of the optimum."""
        return Proportion(int(np.count_nonzero(self.gaps(costs) <= close)), len(costs))

    def measured(self, angles: Any) -> dict[str, float]:
        """Return everything about the posture θ1, θ2 [deg]."""
        planner, problem = self.any.prepared
        return dict(planner.evaluate(problem, np.asarray(angles, dtype=np.float64)))

    def ends(self) -> dict[str, FloatArray]:
        """Return where conventional methods ended, (starts, 3).

        Θ1, θ2 [deg], E, by the method's name.
        """
        if self.conventional is None:
            return {}
        found = {}
        for key, name in METHODS.items():
            try:
                found[name] = self.conventional.array(key)
            except KeyError:
                continue
        return found


def cases(results: Results) -> list[Case]:
    """Return the criteria in the order of the experiment, each with its conditions."""
    found: dict[Any, dict[str, ConditionResults]] = {}
    for c in results.with_data:
        key = c.condition.robot, c.condition.scenario, c.planner.objective
        found.setdefault(key, {}).setdefault(_role(c), c)
    return [Case(_name(next(iter(own.values()))), **own) for own in found.values()]


def fits(results: Results) -> bool:
    """Whether all planners are placement searches."""
    return all(c.planner.component == "placement_ga" for c in results.with_data)


def _role(condition: ConditionResults) -> str:
    if condition.is_reference:
        return condition.condition.planner.component.removeprefix("placement_")
    if condition.is_control:
        return "search"
    return "elitist" if condition.planner.ga.num_elites else "plain"


def _name(condition: ConditionResults) -> str:
    objective = condition.planner.objective
    weights = (
        objective.torque_norm_weight,
        objective.torque_max_weight,
        objective.manipulability_weight,
    )
    links = [one.link for one in objective.avoidances]
    names = {
        (True, False, False, ()): "least torque norm",
        (False, True, False, ()): "minimax torque",
        (True, False, False, (2,)): "obstacle and link 2",
        (True, False, False, (0,)): "obstacle and platform",
        (True, False, True, ()): "manipulability and torque",
    }
    return names.get((*map(bool, weights), tuple(links)), condition.label)  # type: ignore[arg-type]
