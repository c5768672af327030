"""The length of a chromosome that a speed limit asks for (Curkovic et al. 2013, Eqs. 2 and 3)."""

import math
from collections.abc import Sequence

from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.validation import Positive, Settings

# [deg] section 2: the "angles calculated", for l1 = l2 = 0.25 m, 5 m/s, 0.01 s
PRINTED_STEPS = (11.5, 23.0)
# [-] section 2: the "resulting chromosome length", from boundary to boundary of the half-plane
PRINTED_LENGTH = 32
HALF_TURN = 180.0  # [deg]


class SpeedLimit(Settings):
    """How fast the end-effector may be, and how often it is told where to go."""

    tcp_speed: Positive  # V_max, greatest speed of the tool centre point [length unit/s]
    sampling_time: Positive  # T, between two configurations [s]

    def greatest_steps(self, lengths: Sequence[float]) -> tuple[float, float]:
        """Return the largest turn of either link alone between two configurations (Eq. 2) [deg]."""
        travel = self.tcp_speed * self.sampling_time
        return travel / (lengths[0] + lengths[1]) / DEGREE, travel / lengths[1] / DEGREE


def needed_length(turn: float, greatest_step: float) -> int:
    """Return the chromosome's length for a turn of a link [deg] (Eq. 3): the next even number.

    A configuration has two genes. The greatest step is Δφ1,max of Eq. 2 [deg].
    """
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
        asked, worst = needed_length(turn, first), needed_length(HALF_TURN, first)
        step = turn / segments
        verdict = f"violates it {step / first:.3g} times over" if step > first else "is within it"
        notes += [
            f"robot {r + 1}: Eq. 2 allows steps of {first:.2f} and {second:.2f} deg "
            f"(printed: {PRINTED_STEPS[0]:g} and {PRINTED_STEPS[1]:g})",
            f"robot {r + 1}: Eq. 3 asks for L = {asked} here ({turn:g} deg), for L = {worst} over "
            f"{HALF_TURN:g} deg (printed: {PRINTED_LENGTH})",
            f"robot {r + 1}: L = {chromosome_length} (K = {segments - 1}) takes steps of "
            f"{step:.2f} deg at best, which {verdict}",
        ]
    return notes
