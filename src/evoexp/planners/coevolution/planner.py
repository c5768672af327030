"""Co-evolving populations, one per robot (Curkovic, Jerbic & Stipancic 2013).

An individual is a path of one robot: K configurations of two absolute link angles between start and
goal, which are given. Its cost depends on all individuals of the other robots' populations. The
answer is a team: one individual of every population, free of collision with each other. Nothing
here knows how many robots there are.

A population is an array (robots, 2 K, individuals) [rad]: the angles of configuration 1, of
configuration 2, …. A solution is flat: robot by robot, configuration by configuration, link by link
(robots × (K + 2) × 2) [deg], start and goal included.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from evoexp.collision.planar.arm_pairs import MOST_CONFIGURATIONS
from evoexp.collision.planar.link_collision import LinkCollision, LinkCrossings
from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError, demand
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.motion_criteria import MotionCriteria
from evoexp.paths.motion import Motion, clamped_cubic, joint_ranges, top_speeds
from evoexp.planners.answers import Acceptance, in_shape, of_limits, of_place
from evoexp.planners.coevolution import kernels
from evoexp.planners.coevolution.generations import CoevolutionSettings, ProvenTeams, TeamSearch
from evoexp.planners.planner import COPIES, JudgementArrays, PlannerDefaults, num_values
from evoexp.records import Block, BoolArray, FloatArray
from evoexp.robots.assembly import Assembly, Robot
from evoexp.scenarios.motion_tasks import LinkMotion
from evoexp.validation import Component, LayoutCount, Positive, Settings

# [deg] section 2: the "angles calculated", for l1 = l2 = 0.25 m, 5 m/s, 0.01 s
PRINTED_STEPS = (11.5, 23.0)
# [-] section 2: the "resulting chromosome length", from boundary to boundary of the half-plane
PRINTED_LENGTH = 32
HALF_TURN_DEG = 180.0  # [deg]
REFUSED = (
    f"points and bases must be finite and below 1e70, at most {MOST_CONFIGURATIONS} configurations"
)
PAIR_BYTES = 7  # of a pair of individuals: collisions in two generations, whether they are a team


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
            f"robot {r + 1}: Eq. 3 requires L = {asked} here ({turn:g} deg), L = {worst} over "
            f"{HALF_TURN_DEG:g} deg (printed: {PRINTED_LENGTH})",
            f"robot {r + 1}: L = {chromosome_length} (K = {segments - 1}) takes steps of "
            f"{step:.2f} deg at best, which {verdict}",
        ]
    return notes


class Problem(NamedTuple):
    """Robots and their scenario, prepared."""

    assembly: Assembly  # the robots, built
    collision: LinkCollision  # the paper's collision model on them
    arms: FloatArray  # (robots, 4) base x, base y, lengths of both links [length unit]
    start: FloatArray  # (robots, 2) absolute link angles [rad]
    goal: FloatArray  # (robots, 2) [rad]
    moving: BoolArray  # (robots,) false for robots that stand still
    scene: Scene  # the bodies themselves, for the exact verdict on a motion
    security_margin: float  # clearance that the task requires [length unit]


class Coevolution(PlannerDefaults, Component):
    """The algorithm of Curkovic et al., sections 2 and 3; Methods I–VIII are settings of it."""

    revision: ClassVar[int] = 2

    # L, even: two link angles for each of K = L/2 configurations between start and goal [-]
    chromosome_length: LayoutCount
    # the curve that is executed between configurations: straight lines in the joint angles,
    # or a cubic spline that starts and ends at rest (Fig. 9). The verdict judges that curve,
    # the search only the configurations
    interpolation: Literal["linear", "cubic"]
    speed_limit: SpeedLimit  # of the end-effector (Eqs. 2, 3); no part of the search
    ga: CoevolutionSettings  # populations, generations, rates, hall of fame
    objective: MotionCriteria  # weights of C1 … C4
    collision: LinkCrossings  # links as lines, or their envelopes
    # which teams are an answer: all that the model accepts at the configurations it tests, or
    # only teams whose motion the exact certifier also proves; robots of a refuted team count
    # as colliding once more
    acceptance: Acceptance = "model"

    def _check(self) -> None:
        fits = self.chromosome_length >= 2 and self.chromosome_length % 2 == 0
        must = "even and at least 2: two link angles per configuration"
        self.demand("chromosome_length", fits, must)

    @property
    def num_configurations(self) -> int:
        """K, the configurations between start and goal."""
        return self.chromosome_length // 2

    def prepare(self, robot: Robot, scenario: LinkMotion) -> Problem:
        """Build the robots and check that start and goal fit them and are free of collision."""
        assembly = robot.build()
        collision = self.collision.bind(assembly, scenario.obstacles)
        must = "two robots or more, which evolve together"
        demand(len(collision.arms) >= 2, "robot", must, len(collision.arms))
        arms = np.array([(*arm.base, *arm.lengths) for arm in collision.arms])
        start, goal = (DEGREE * ends for ends in scenario.ends(arms[:, :2], arms[:, 2:]))
        moving = np.array([r not in scenario.stationary for r in range(len(arms))])
        bodies, margin = scene(assembly, scenario.obstacles), scenario.security_margin
        for name, posture in (("q_start", start), ("q_goal", goal)):
            if contact := collision.contact(posture):
                relative = np.stack([posture[:, 0], posture[:, 1] - posture[:, 0]], axis=1)
                distances = bodies.distances(relative.ravel())
                closest = " and ".join(bodies.pair_names(int(np.argmin(distances))))
                must = f"free of collision ({contact}: {closest})"
                raise SettingError(f"scenario.{name}", must, (posture / DEGREE).round(9).tolist())
        return Problem(assembly, collision, arms, start, goal, moving, bodies, margin)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the initial populations, then one generation after the other (Fig. 2)."""
        return TeamSearch(self, problem).blocks(rng)

    def num_evaluations(self, index: int) -> int:
        """Return the size of each population: elites are judged again, by other collaborators."""
        return self.ga.population_size

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return populations of uniform genes, (robots, 2 K, count), of robots that move."""
        shape = len(problem.start), 2 * self.num_configurations, count
        return self.populations_of(problem, rng.random(shape))

    def populations_of(self, problem: Problem, uniforms: FloatArray) -> FloatArray:
        """Return the populations of uniform numbers of their shape, see `sample`."""
        genes = kernels.HALF_TURN * uniforms
        for robot in np.flatnonzero(~problem.moving):
            genes[robot] = np.tile(problem.start[robot], self.num_configurations)[:, None]
        return genes

    def evaluated(self, problem: Problem, populations: FloatArray) -> kernels.Evaluated:
        """Evaluate populations (robots, 2 K, individuals), all against all other robots (Eq. 4)."""
        collision, (robots, _, count) = problem.collision, populations.shape
        cost = self.objective
        own_weights = cost.path_weight, cost.rotation_weight, cost.evenness_weight
        envelope = self.collision.half_width, self.collision.tcp_radius
        ends, weights = (problem.start, problem.goal), (own_weights, cost.collision_weight)
        task = kernels.LineTask(*ends, problem.arms, *weights, *envelope)
        found = kernels.Evaluated.room(robots, count)
        # paths, and C2 … C4 (Eqs. 6–8)
        shape, is_lines = (robots, self.num_configurations + 2), collision.is_lines
        paths, outlines = np.empty((*shape, 2, count)), np.empty((*shape, 4, count))
        kernels.measure(populations, task, paths, outlines, found.criteria, found.own)
        # C1 (Eqs. 4, 5)
        if not is_lines:
            tested = [collision.tested(path) for path in paths]
            found.blocked[:] = [collision.with_obstacles(r, q) for r, q in enumerate(tested)]
            arms = zip(collision.arms, tested, strict=True)
            outlines = np.array([arm.outlines(q) for arm, q in arms])
        fits = outlines.shape[1] <= MOST_CONFIGURATIONS
        if not (fits and kernels.count_crossings(outlines, int(is_lines), task, found)):
            raise ValueError(REFUSED)
        return found

    def cost(self, problem: Problem, population: FloatArray) -> JudgementArrays:
        """Judge the individuals of the first robot, each by its cheapest collision-free team."""
        found, count = self.evaluated(problem, population), population.shape[2]
        costs = np.array([found.cost_of(found.team_of(i)) for i in range(count)])
        if self.answers_are_proven:
            ProvenTeams(self, problem).settle_each(population, found, costs)
        named = [found.terms_of(found.team_of(i)) for i in range(count)]
        terms = {name: np.array([own[name] for own in named]) for name in named[0]}
        return JudgementArrays(costs, np.isfinite(costs), self.queries(problem, count), terms)

    def queries(self, problem: Problem, count: int) -> int:
        """Return the configurations that evaluating populations of `count` asks for."""
        robots, substeps = len(problem.start), self.collision.collision_substeps
        tested = (self.num_configurations + 1) * substeps - 1
        return robots * (robots - 1) // 2 * count * count * tested

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return the team of an individual of the first robot as a flat solution."""
        found = self.evaluated(problem, population)
        team = found.team_of(individual)
        if self.answers_are_proven:
            team = ProvenTeams(self, problem).team_of(population, found, individual)
        return self.team_solution(problem, population, team)

    def team_solution(
        self, problem: Problem, population: FloatArray, team: np.ndarray
    ) -> FloatArray:
        """Return one individual of every population as a flat solution."""
        parts = []
        for r, individual in enumerate(team):
            path = [problem.start[r], population[r, :, individual], problem.goal[r]]
            parts.append(np.concatenate(path) / DEGREE)
        return np.concatenate(parts)

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the joint-space motion of a solution, configurations in equal times."""
        absolute = self._curve(problem, solution).q
        relative = absolute.reshape(len(absolute), -1, 2).copy()
        relative[:, :, 1] -= relative[:, :, 0]  # the models' joints turn against the link before
        return self._interpolated(relative.reshape(absolute.shape))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the criteria of every robot of one team, and the demands of the executed curve.

        These are the distance by which it leaves the range [0, π] of link angles, and the largest
        turn of a link per sampling step. C1 is against the team's other robots only.
        """
        paths = DEGREE * self._paths(problem, solution)
        ends = problem._replace(start=paths[:, 0], goal=paths[:, -1])
        genes = np.ascontiguousarray(paths[:, 1:-1].reshape(len(paths), -1, 1))
        terms = self.evaluated(ends, genes).terms_of(np.zeros(len(paths), dtype=np.int64))
        curve = self._curve(problem, solution)
        least, greatest = (joint_ranges(curve)[:, k].reshape(-1, 2) / DEGREE for k in range(2))
        turns = top_speeds(curve).reshape(-1, 2) / DEGREE
        for r in range(len(turns)):
            beyond = max(
                0.0, -float(least[r].min()), float(greatest[r].max()) - kernels.HALF_TURN / DEGREE
            )
            terms[f"out_of_range_robot_{r + 1}_deg"] = beyond
            terms[f"fastest_turn_robot_{r + 1}_deg"] = float(turns[r].max())
        return terms

    def cost_of_terms(self, terms: Mapping[str, float]) -> float:
        """Return the cost of the team."""
        return terms["team_cost"]

    def departures(self, problem: Problem, solution: FloatArray) -> list[str]:
        """Compare start and goal of every robot with the task's, and links with [0, π]."""
        paths, found = self._paths(problem, solution), []
        limits = np.array([[0.0, kernels.HALF_TURN / DEGREE]] * 2)
        for r, path in enumerate(paths):
            robot = f"robot {r + 1}"
            for end, k, wanted in (("start", 0, problem.start), ("goal", -1, problem.goal)):
                found += of_place(f"the {end} of {robot}", path[k], wanted[r] / DEGREE, "deg")
            links = [f"link {k} of {robot}" for k in (1, 2)]
            found += of_limits(links, path.T, limits, "deg")
        return found

    def notes(self, problem: Problem) -> list[str]:
        """Compare the chromosome's length with Eqs. 2 and 3, line by line."""
        lengths = [arm.lengths for arm in problem.collision.arms]
        task = lengths, problem.start, problem.goal
        return length_notes(self.speed_limit, *task, self.chromosome_length)

    def memory(self, problem: Problem) -> int:
        """Return the memory of all pairs of individuals, and of everybody's path and outlines."""
        robots, count = len(problem.start), self.ga.population_size
        copies = COPIES + 8 * self.collision.collision_substeps
        pairs = robots * (robots - 1) // 2 * PAIR_BYTES * count * count
        return pairs + 8 * copies * num_values(self.shape(problem)) * count

    def shape(self, problem: Problem) -> tuple[tuple[int, int], ...]:
        """Return the documented shape of a solution: per robot, (K + 2, 2)."""
        return ((self.num_configurations + 2, 2),) * len(problem.start)

    def _paths(self, problem: Problem, solution: FloatArray) -> FloatArray:
        return in_shape(solution, len(problem.start), self.num_configurations + 2, 2)

    def _curve(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the executed curve, in absolute link angles [rad]."""
        paths = DEGREE * self._paths(problem, solution)
        return self._interpolated(paths.transpose(1, 0, 2).reshape(paths.shape[1], -1))

    def _interpolated(self, q: FloatArray) -> Motion:
        q = np.ascontiguousarray(q)
        return clamped_cubic(q) if self.interpolation == "cubic" else Motion(q)
