"""The hyperparameters of co-evolving populations, and the chromosome's length by a speed limit.

Curkovic et al. 2013, Eqs. 2 and 3.
"""

import math
from collections.abc import Sequence
from typing import Any, ClassVar, Literal, Self

from pydantic import model_validator

from evoexp.evolution.operators.breeding import Operators, PopulationSettings
from evoexp.evolution.operators.crossover import OnePoint
from evoexp.evolution.operators.mutation import AlleleMutation
from evoexp.evolution.operators.operator import Crossover, Mutation, Named, Selection
from evoexp.evolution.operators.selection import DifferenceRoulette, InverseRoulette
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.validation import Count, Positive, Rate, Settings

# [deg] section 2: the "angles calculated", for l1 = l2 = 0.25 m, 5 m/s, 0.01 s
PRINTED_STEPS = (11.5, 23.0)
# [-] section 2: the "resulting chromosome length", from boundary to boundary of the half-plane
PRINTED_LENGTH = 32
HALF_TURN_DEG = 180.0  # [deg]
_FLOOR_GUARD = 1e-9  # [-] 0.29 × 100 is 28.999999999999996


class CoevolutionSettings(PopulationSettings):
    """Settings of co-evolving populations, the same for each (Curkovic et al. 2013, section 3)."""

    component: ClassVar[str] = "coevolutionary"

    # difference of `mutation_rate`, that of one allele of an individual, between the first and the
    # last generation (Eq. 10) [-]; 0: it is constant
    mutation_decay: Rate
    mutation_step: Positive  # largest change of an allele (Eq. 9) [deg]
    # `one_sided` as Eq. 9 is printed (alleles only grow), or `symmetric`
    mutation_direction: Literal["one_sided", "symmetric"]
    # weight on the roulette wheel: the `inverse` of the cost, or its `difference` to the
    # highest
    selection: Literal["inverse", "difference"] | Named[Selection]
    hall_depth: Rate  # share of a population that the hall of fame may hold [-]; 0: no hall
    # generations after which a team of the hall gives way to any new one [-]; None: never
    hall_memory: Count | None
    hall_frozen: bool  # whether a full hall stays as it is (an ablation)
    # generations without a feasible team before fresh populations are drawn [-]; None: never
    restart_after: Count | None
    # nobody is in two teams of the hall. `genome`: copies count as one, and members of the
    # hall are offered again, so that one may find a better partner. `index`: copies count as
    # others, so the hall may fill with copies of one team; members of the hall are not
    # offered again. Runs by index are bit for bit those of revision 1 of `coevolution`,
    # unless a link's angle is exactly a multiple of 90°
    hall_distinct: Literal["genome", "index"] = "genome"
    # what the hall holds. `pairs`: teams of members of the fronts, until a better one is found;
    # `front`: the present front of each population, the cheapest first, copied to the next
    hall_members: Literal["pairs", "front"] = "pairs"

    crossover: Named[Crossover] | None = None  # None: at one point
    mutation: Named[Mutation] | None = None  # None: of one allele (Eq. 9)

    @model_validator(mode="after")
    def _settings_agree(self) -> Self:
        rate, demand = self.mutation_rate, self.demand
        demand("mutation_decay", self.mutation_decay <= rate, f"at most mutation_rate ({rate})")
        has_hall, no_hall = self.hall_depth > 0.0, "where there is no hall (hall_depth is 0)"
        must = "0, or large enough for one pair (at least 1/population_size)"
        demand("hall_depth", not has_hall or self.num_hall_teams > 0, must)
        demand("hall_memory", has_hall or self.hall_memory is None, f"null {no_hall}")
        demand("hall_frozen", has_hall or not self.hall_frozen, f"false {no_hall}")
        demand("hall_distinct", has_hall or self.hall_distinct == "genome", f"genome {no_hall}")
        pairs, no_pairs = self.hall_members == "pairs", "where fronts are copied"
        demand("hall_members", has_hall or pairs, f"pairs {no_hall}")
        demand("hall_memory", pairs or self.hall_memory is None, f"null {no_pairs}")
        demand("hall_frozen", pairs or not self.hall_frozen, f"false {no_pairs}")
        must = "null where the hall is frozen (hall_frozen)"
        demand("hall_memory", not self.hall_frozen or self.hall_memory is None, must)
        most = self.population_size - self.num_hall_teams
        must = f"at most population_size less the hall's teams ({most})"
        demand("num_elites", self.num_offspring >= 0, must)
        takes_normals = self.mutation is not None and self.mutation.takes_normals
        demand("mutation", not takes_normals, "one that takes uniform numbers only")
        return self

    @property
    def num_hall_teams(self) -> int:
        """Teams that the hall of fame may hold; each takes one individual of every population."""
        return math.floor(self.hall_depth * self.population_size + _FLOOR_GUARD)

    @property
    def num_offspring(self) -> int:
        """Individuals of a population that are new beside the elites and a full hall."""
        return self.population_size - self.num_elites - self.num_hall_teams

    @property
    def operators(self) -> Operators:
        """The paper's operators, where the settings name no others."""
        named: dict[Any, Any] = {"inverse": InverseRoulette(), "difference": DifferenceRoulette()}
        step, symmetric = DEGREE * self.mutation_step, self.mutation_direction == "symmetric"
        return Operators(
            named.get(self.selection, self.selection),
            self.crossover or OnePoint(),
            self.mutation or AlleleMutation(step=step, symmetric=symmetric),
        )

    def mutation_rate_at(self, index: int) -> float:
        """Return the rate on the way to a generation (Eq. 10: 1 − 0.9 t/G)."""
        share = index / self.num_generations if self.num_generations > 0 else 0.0
        return min(max(self.mutation_rate - self.mutation_decay * share, 0.0), 1.0)


class SpeedLimit(Settings):
    """How fast the end-effector may be, and how often it is told where to go."""

    tcp_speed: Positive  # V_max, greatest speed of the tool centre point [length unit/s]
    sampling_time: Positive  # T, between two configurations [s]

    def greatest_steps(self, lengths: Sequence[float]) -> tuple[float, float]:
        """Return the largest turn of either link alone between two configurations (Eq. 2) [deg]."""
        travel = self.tcp_speed * self.sampling_time
        return travel / (lengths[0] + lengths[1]) / DEGREE, travel / lengths[1] / DEGREE


def needed_length(turn: float, greatest_step: float) -> int:
    """Return the next even chromosome length for a turn by greatest steps [deg] (Eq. 3)."""
    genes = math.ceil(2.0 * turn / greatest_step * (1.0 - 1e-12))  # a whole number stays whole
    return max(2, genes + genes % 2)


def length_notes(
    limit: SpeedLimit,
    lengths: Sequence[Sequence[float]],
    start: FloatArray,
    goal: FloatArray,
    chromosome_length: int,
) -> list[str]:
    """Compare this chromosome, line by line, with Eqs. 2 and 3 and with the paper's numbers.

    Lengths of the links are (robots, 2) [length unit], start and goal (robots, 2) [rad].
    """
    notes = []
    segments = chromosome_length // 2 + 1
    for r, links in enumerate(lengths):
        first, second = limit.greatest_steps(links)
        turn = float(abs(goal[r] - start[r]).max()) / DEGREE
        asked, worst = needed_length(turn, first), needed_length(HALF_TURN_DEG, first)
        step = turn / segments
        verdict = f"violates it {step / first:.3g} times over" if step > first else "is within it"
        notes += [
            f"robot {r + 1}: Eq. 2 allows steps of {first:.2f} and {second:.2f} deg "
            f"(printed: {PRINTED_STEPS[0]:g} and {PRINTED_STEPS[1]:g})",
            f"robot {r + 1}: Eq. 3 asks for L = {asked} here ({turn:g} deg), for L = {worst} over "
            f"{HALF_TURN_DEG:g} deg (printed: {PRINTED_LENGTH})",
            f"robot {r + 1}: L = {chromosome_length} (K = {segments - 1}) takes steps of "
            f"{step:.2f} deg at best, which {verdict}",
        ]
    return notes
