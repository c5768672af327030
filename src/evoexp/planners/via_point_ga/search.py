"""One run of the search over strings of via-points, and one whose answers are proven."""

from typing import TYPE_CHECKING

import numpy as np

from evoexp.planners.driver import GeneticSearch
from evoexp.planners.planner import Candidate
from evoexp.planners.proofs import Proofs
from evoexp.planners.via_point_ga import kernels
from evoexp.planners.via_point_ga.kernels import Scratch
from evoexp.planners.via_point_ga.strings import Problem, Strings
from evoexp.records import Best, FloatArray, IntArray

if TYPE_CHECKING:
    from evoexp.planners.via_point_ga.planner import ViaPointGa


class Search(GeneticSearch):
    """One run, and memory for its generations."""

    def __init__(
        self,
        planner: "ViaPointGa",
        problem: Problem,
        strings: Strings,  # the planner's steps on this problem
        per_call: int | None = None,  # generations computed at once; None: as many as is best
    ) -> None:
        """Begin a run."""
        ga, operators = planner.ga, planner.operators
        super().__init__(ga, operators, strings.genome, per_call or strings.generations_per_call)
        self._planner, self._problem, self._strings = planner, problem, strings
        self.table, offspring = strings.table(self.num_places), strings.empty(ga.num_offspring)
        terms = strings.no_terms(offspring, ga.num_offspring)
        self.scratch = Scratch(offspring, terms, self.elites, self.parents)
        self.costs, self._shown = self.table.costs, np.empty(self.table.strings.shape[1:])
        self.queries_each = planner.num_via_points * planner.collision.collision_substeps

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population."""
        strings, size = self._strings, self.costs.shape[1]
        self.table.strings[:] = strings.drawn(rng, size)
        judged = strings.judge(self.table.strings[0], size)
        self.costs[0], self.table.collisions[0] = judged.cost, judged.terms["collisions"]
        self._summarise(0)

    def advance(self, uniforms: FloatArray, normals: FloatArray, first: int) -> int:
        """Compute generations."""
        self._strings.evolve(self, uniforms, normals, first)
        return first + len(uniforms)

    def candidate(self, place: int, individual: int) -> Candidate:
        """Return a string and its terms, judged once more by itself."""
        own = self.table.strings[place, :, :, individual, None]
        terms = self._strings.judge(self._strings.padded(own), 1).named_terms(0)
        solution = self._planner.solution(self._problem, own, 0)
        return Candidate(solution, terms, terms["collisions"] == 0.0)

    def population(self, index: int) -> FloatArray:
        """Return the strings, padded, in the same array for all generations.

        So the digest of a run that its budget ends is that of the first generation beyond it.
        """
        np.copyto(self._shown, self.table.strings[index % self.num_places])
        return self._shown

    def _summarise(self, place: int) -> None:
        costs, collisions = self.costs[place], self.table.collisions[place]
        kernels.summarise_strings(costs, collisions, self.summaries[place])


class ProvenSearch(Search):
    """A run whose best string is proven: what is refuted costs more in the next generation."""

    def __init__(self, planner: "ViaPointGa", problem: Problem, strings: Strings) -> None:
        """Begin a run, see `Search`, without any verdict."""
        super().__init__(planner, problem, strings, per_call=1)
        self._proofs = Proofs(planner, problem)

    def improve(self, places: IntArray) -> list[Best]:
        """Keep a proven string that costs less than the one kept, if the generation has one."""
        (place,), keeper = places.tolist(), self.keeper
        strings, costs, hits = (array[place] for array in self.table)
        k = settle(self._proofs, strings, costs, hits, keeper.cost)
        proven = np.zeros(len(costs), bool)
        if k is not None:
            proven[k] = True

        def candidate(k: int, solved: bool) -> Candidate:
            found = super(ProvenSearch, self).candidate(place, k)
            found.terms["certificates"] = float(self._proofs.num_certificates)
            return found._replace(solved=solved)

        keeper.keep_proven(costs, proven, candidate)
        self._summarise(place)
        return [keeper.standing]


def settle(
    proofs: Proofs, strings: FloatArray, costs: FloatArray, hits: FloatArray, below: float = np.inf
) -> int | None:
    """Judge free strings, the cheapest first, until one is proven; return it, None if none is.

    Each one that is refuted counts as colliding at one instant more, and costs as much.

    Args:
        proofs: Of a `ViaPointGa` and its problem.
        strings: (nq, N + 1, ≥ individuals).
        costs: (individuals,), changed.
        hits: (individuals,) colliding instants, changed.
        below: Costs from which on nothing is judged: as low a one is proven already.
    """
    planner, problem = proofs.planner, proofs.problem
    open_costs = np.where((hits == 0.0) & (costs < below), costs, np.inf)
    settled = open_costs.copy()
    proven = proofs.settle(settled, lambda k: planner.solution(problem, strings, k))
    refuted = settled != open_costs
    hits[refuted] += 1.0
    costs[refuted] += planner.objective.collision_weight
    return proven
