"""References: deterministic truths about the problem of the planner that they stand beside.

An exact optimum, a frontier, a landscape, what a conventional method ends at: computed once, run
and stored like a condition of one replicate, its arrays attached to the log. Libraries such as
scipy may compute it, which are not reproducible bit by bit; so `reproduce` compares its numbers, to
1e-9, and not its digest.
"""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.paths.motion import Motion
from evoexp.records import FloatArray, Generation
from evoexp.validation import Component


class Truth(NamedTuple):
    """What a reference finds.

    Attributes:
        best: Flat solution in the shape of the planner beside it.
        cost: Its cost, as the planner's own; lower is better, inf: there is none.
        solved: Whether the planner's own model accepts it.
        evaluations: Of the planner's cost that it took.
        terms: Numbers of its own (the share of starts that end at the optimum, say), beside those
            of `evaluate`.
        arrays: What is drawn or tabulated, by name: attached to the log as `<name>.npy`, any shape,
            float64 or int64.
    """

    best: FloatArray
    cost: float
    solved: bool
    evaluations: int
    terms: Mapping[str, float] = {}
    arrays: Mapping[str, np.ndarray] = {}


class Reference(Component):
    """Base of every reference; a subclass has `truth`.

    Everything else is as the planner beside it has it.

    Attributes:
        planner: The planner whose problem, cost and solutions it shares.
    """

    component: ClassVar[str] = "reference"
    is_reference: ClassVar[bool] = True

    planner: Any

    def truth(self, problem: Any) -> Truth:
        """Return what is true of a problem, the same at every call."""
        raise NotImplementedError

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the problem of the planner beside it."""
        return self.planner.prepare(robot, scenario)

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the truth as the one generation there is; nothing is drawn."""
        found = self.truth(problem)
        costs, is_finite = np.array([found.cost]), bool(np.isfinite(found.cost))
        yield Generation(
            index=0,
            best=found.best,
            best_cost=float(found.cost),
            best_cost_in_generation=float(found.cost),
            mean_cost=float(found.cost) if is_finite else np.nan,
            std_cost=0.0 if is_finite else np.nan,
            num_feasible=int(found.solved),
            evaluations=found.evaluations,
            collision_queries=0,
            solved=found.solved,
            terms={name: float(value) for name, value in found.terms.items()},
            costs=costs,
            population=found.best[None, :],
            arrays=dict(found.arrays),
        )

    def motion(self, problem: Any, solution: FloatArray) -> Motion | None:
        """Return the motion of a solution, as the planner beside it has it."""
        motion: Motion | None = self.planner.motion(problem, solution)
        return motion

    def evaluate(self, problem: Any, solution: FloatArray) -> dict[str, float]:
        """Return the terms of a solution, as the planner beside it has them."""
        return dict(self.planner.evaluate(problem, solution))

    def shape(self, problem: Any) -> Any:
        """Return the shape of a solution, as the planner beside it has it."""
        return self.planner.shape(problem)
