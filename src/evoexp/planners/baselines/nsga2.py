"""NSGA-II (Deb et al. 2002) on a planner's own coding and the terms of its cost, by pymoo."""

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from evoexp.errors import SettingError, nearest
from evoexp.planners.baselines.real_vectors import RealVectorControl, real_vectors
from evoexp.planners.planner import Populations, Reproducibility

SEEDS = 2**32  # of numpy's older generators
ENDLESS = 10**9  # generations: this planner counts them itself


class Nsga2(RealVectorControl):
    """Evolves a front: individuals that no other surpasses in all objectives at once.

    Objectives are terms of the planner's own judgement; the answer is the individual of the
    planner's least cost. Operators are pymoo's defaults, within the box of all individuals drawn at
    first. Linear algebra of libraries makes the last bits those of an environment.
    """

    component: ClassVar[str] = "nsga2"
    reproducibility: ClassVar[Reproducibility] = "environment"

    fewest: ClassVar[int] = 4

    # names of terms, to be minimised; a name stands for the sum of all terms that begin with it,
    # as `length` does for the lengths of all arms
    objectives: Annotated[tuple[str, ...], Field(min_length=2)]

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        problem = super().prepare(robot, scenario)
        one = self.planner.sample(problem, np.random.Generator(np.random.PCG64(0)), 1)
        names = tuple(self.planner.cost(problem, one).named_terms(0))
        for k, name in enumerate(self.objectives):
            if not any(term.startswith(name) for term in names):
                must = f"the begin of a term ({', '.join(names)})"
                raise SettingError(f"control.objectives[{k}]", must, name, nearest(name, names))
        return problem

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation after the other."""
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.problem import Problem

        planner, size = self.planner, self.num_evaluations(1)
        drawn = planner.sample(problem, rng, max(self.num_drawn, size))
        coding = real_vectors(planner, problem, drawn)
        vectors = coding.drawn.T
        box = Problem(
            n_var=vectors.shape[1],
            n_obj=len(self.objectives),
            xl=vectors.min(axis=0),
            xu=vectors.max(axis=0),
        )
        search = NSGA2(pop_size=size, sampling=vectors[:size], eliminate_duplicates=False)
        forever = ("n_gen", ENDLESS)
        search.setup(box, termination=forever, seed=int(rng.integers(SEEDS)), verbose=False)
        while True:
            asked = search.ask()
            judged = yield coding.population(np.asarray(asked.get("X"), dtype=np.float64))
            rows = []
            for k, cost in enumerate(judged.cost):
                named = judged.named_terms(k).items()
                sums = [sum(v for n, v in named if n.startswith(o)) for o in self.objectives]
                rows.append(sums if np.isfinite(cost) else [np.finfo(float).max] * len(sums))
            asked.set("F", np.array(rows, dtype=np.float64))
            search.tell(infills=asked)
