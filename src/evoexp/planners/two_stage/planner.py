"""A mission in two stages: a docking place and posture, then a safe path to it.

Chen & Zalzala 1995. The first stage is the placement search of section 3, the second the path
search of section 2, whose goal is the node nearest to the docking place of the first. The motion
follows the path from node to node, goes on to the docking place itself, and then turns the arm from
the travel posture to the posture of the first stage.

A solution is flat: θ1, θ2 [deg], then the coordinates of the path's nodes. Its cost is E (Eq. 14) +
C (Eq. 1). In the first stage there is no path: the cost of the plan is inf, the individuals cost E.
"""

from collections.abc import Callable, Generator, Iterator
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.evolution.cost_statistics import CostStatistics
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion
from evoexp.planners.gathering import Run
from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.planners.grid_path_ga.planner import Problem as PathProblem
from evoexp.planners.placement_ga.planner import PlacementGa
from evoexp.planners.placement_ga.planner import Problem as PlacementProblem
from evoexp.planners.planner import Candidate, Judgement, Keeper, PlannerDefaults
from evoexp.planners.proofs import Acceptance, Proofs
from evoexp.records import FloatArray, Standing, Stretch
from evoexp.records import Generation as Record
from evoexp.robots.floor_manipulator import NUM_JOINTS, FloorManipulator
from evoexp.scenarios.mission import Mission
from evoexp.validation import Component

ANGLES = 2
POSTURE = ("theta_1_deg", "theta_2_deg", "theta_3_deg", "platform_x", "torque_norm", "torque_max")
PATH = ("distance", "unsafeness", "num_nodes")


class Problem(NamedTuple):
    """Robot and scenario, prepared for both stages.

    Attributes:
        robot: The description; parts of it solve the stages.
        scenario: The mission.
        placement: Problem of the first stage.
        path: Problem of the second one, with the goal of the grid.
        scene: All bodies, for the exact verdict on the motion.
        security_margin: Clearance that the task requires [length unit].
    """

    robot: FloorManipulator
    scenario: Mission
    placement: PlacementProblem
    path: PathProblem
    scene: Scene
    security_margin: float


class TwoStage(PlannerDefaults, Component):
    """The placement search, then the path search.

    Attributes:
        placement: The planner of the first stage.
        path: The planner of the second one.
        acceptance: Which missions are an answer: those that both stages accept (`model`), or those
            of them whose whole motion, driving and docking, the exact certifier proves
            (`certified`, `margin`). Moves over the grid that it refutes are forbidden then.
    """

    component: ClassVar[str] = "two_stage"

    placement: PlacementGa
    path: GridPathGa
    acceptance: Acceptance = "model"

    def prepare(self, robot: FloorManipulator, scenario: Mission) -> Problem:
        """Prepare both stages.

        Raises:
            SettingError: If one of them cannot be solved, or the grid is not of a floor.
        """
        if len(scenario.grid.size) != 2:
            raise SettingError(
                "scenario.grid.size", "of a floor, two numbers", list(scenario.grid.size)
            )
        placement = self.placement.prepare(robot.arm(), scenario.docking)
        path = self._driving.prepare(robot.platform(), scenario.grid)
        bodies = scene(robot.build(), scenario.grid.bodies(), self_pairs=True)
        return Problem(robot, scenario, placement, path, bodies, scenario.grid.security_margin)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Record]:
        """Yield the generations of both stages; their indices go on counting."""
        if self.answers_are_proven:
            return self._generations(problem, rng)
        return Run(partial(self._generations, problem, rng), partial(self._stretches, problem, rng))

    def _generations(self, problem: Problem, rng: np.random.Generator) -> Iterator[Record]:
        keeper = Keeper()
        docked = yield from self._place(problem, rng, keeper)
        yield from self._drive(problem, rng, keeper, docked)

    def _stretches(
        self, problem: Problem, rng: np.random.Generator, read_clock: Callable[[], float]
    ) -> Iterator[Stretch]:
        """Yield the same generations, many at a time."""
        no_path, docked = dict.fromkeys(PATH, 0.0) | {"sub_path": 1.0}, None
        start = problem.scenario.grid.start
        for stretch in self.placement.evolve(problem.placement, rng).stretches(read_clock):
            standings = [
                Standing(
                    place,
                    np.concatenate([angles, start]),
                    np.inf,
                    self._posture_terms(problem, angles) | no_path,
                    False,
                )
                for place, angles, *_ in stretch.standings
            ]
            docked, evaluations = stretch.standings[-1], stretch.evaluations[-1]
            first = stretch.first + len(stretch.lowest)
            lowest = [np.inf] * len(stretch.lowest)
            yield stretch._replace(standings=standings, lowest=lowest, population=None)
        assert docked is not None, "a search has an initial population"
        posture = self._posture_terms(problem, docked.best) | {"sub_path": 2.0}
        path_problem = self._path_problem(problem, docked.best)
        for stretch in self.path.evolve(path_problem, rng).stretches(read_clock):
            standings = [
                Standing(
                    place,
                    np.concatenate([docked.best, nodes]),
                    docked.cost + cost,
                    posture | {name: terms[name] for name in PATH},
                    docked.solved and solved,
                )
                for place, nodes, cost, terms, solved in stretch.standings
            ]
            yield stretch._replace(
                first=first + stretch.first,
                standings=standings,
                lowest=[docked.cost + cost for cost in stretch.lowest],
                evaluations=[evaluations + count for count in stretch.evaluations],
            )

    def _place(
        self, problem: Problem, rng: np.random.Generator, keeper: Keeper
    ) -> Generator[Record, None, Record]:
        """Search the docking posture; return the placement search's last generation."""
        no_path, angles = dict.fromkeys(PATH, 0.0) | {"sub_path": 1.0}, np.empty(0)
        for last in self.placement.evolve(problem.placement, rng):
            if last.best is not angles:
                angles, terms = last.best, self._posture_terms(problem, last.best) | no_path
                plan = np.concatenate([angles, problem.scenario.grid.start])
                keeper.keep(np.inf, Candidate(plan, terms, False))
            yield _recorded(keeper, last, self.placement.num_evaluations(last.index), np.inf)
        return last

    def _drive(
        self, problem: Problem, rng: np.random.Generator, keeper: Keeper, docked: Record
    ) -> Iterator[Record]:
        """Search the path to the docking place that was found."""
        posture = self._posture_terms(problem, docked.best) | {"sub_path": 2.0}
        path_problem, nodes = self._path_problem(problem, docked.best), np.empty(0)
        proofs = Proofs(self, problem) if self.answers_are_proven else None
        for found in self._driving.evolve(path_problem, rng):
            if found.best is not nodes:
                nodes, terms = found.best, posture | {name: found.terms[name] for name in PATH}
                plan = np.concatenate([docked.best, nodes])
                cost, solved = docked.best_cost + found.best_cost, docked.solved and found.solved
                if proofs is not None and not (solved and proofs.is_proven(plan)):
                    cost, solved = np.inf, False
                if proofs is None or solved or not keeper.best.solved:
                    keeper.keep(cost, Candidate(plan, terms, solved))
            lowest = docked.best_cost + found.best_cost_in_generation
            yield _recorded(keeper, found, self.path.num_evaluations(found.index), lowest)

    def _path_problem(self, problem: Problem, angles: FloatArray) -> PathProblem:
        """Return the second stage's problem, its goal the node nearest to the docking place."""
        grid = problem.scenario.grid
        node = tuple(int(np.floor(value + 0.5)) for value in self.docking_place(problem, angles))
        if node == grid.goal:
            return problem.path
        return self._driving.prepare(
            problem.robot.platform(), type(grid)(**(dict(grid) | {"goal": node}))
        )

    @property
    def _driving(self) -> GridPathGa:
        """The planner of the path, which may be asked for proofs of its moves."""
        if not self.answers_are_proven:
            return self.path
        return self.path.model_copy(update={"acceptance": self.acceptance})

    def docking_place(self, problem: Problem, angles: FloatArray) -> FloatArray:
        """Return the platform's place on the floor (2,) in a posture (θ1, θ2) [length unit]."""
        x, y = problem.scenario.task_origin
        return np.array([x + self.placement.evaluate(problem.placement, angles)["platform_x"], y])

    def _posture_terms(self, problem: Problem, angles: FloatArray) -> dict[str, float]:
        terms = self.placement.evaluate(problem.placement, angles)
        named = {name: float(terms[name]) for name in POSTURE}
        return named | {"posture_cost": float(terms["cost"])}

    @property
    def num_generations(self) -> int:
        """Generations of both stages, at most, of which one is the second initial population."""
        return self.placement.num_generations + 1 + self.path.num_generations

    def num_evaluations(self, index: int) -> int:
        """Return the evaluations of a generation of one of the stages."""
        first = self.placement.num_generations + 1
        return (
            self.placement.num_evaluations(index)
            if index < first
            else self.path.num_evaluations(index - first)
        )

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Refuse: there are two populations, one per stage."""
        raise _no_population()

    def cost(self, problem: Problem, population: FloatArray) -> Judgement:
        """Refuse: there are two populations, one per stage."""
        raise _no_population()

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Refuse: there are two populations, one per stage."""
        raise _no_population()

    def motion(self, problem: Problem, solution: FloatArray) -> Motion | None:
        """Return the motion, (nodes + 2, 5) in equal times; None without a feasible posture."""
        angles, nodes = self._parts(solution)
        posture = self.placement.motion(problem.placement, angles)
        if posture is None:
            return None
        place = np.vstack([nodes, *[self.docking_place(problem, angles)] * 2])
        q = np.empty((len(place), NUM_JOINTS))
        q[:, :2], q[:, 2:] = place, DEGREE * np.array(problem.scenario.travel_posture)
        q[-1, 2:] = posture.q[0, 1:]
        return Motion(q)

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the terms of posture and path, the last leg to the docking place, and the cost.

        Raises:
            SettingError: If there is no path, or it leaves the grid.
        """
        angles, nodes = self._parts(solution)
        path = self.path.evaluate(self._path_problem(problem, angles), nodes.ravel())
        posture = self._posture_terms(problem, angles)
        leg = self.docking_place(problem, angles) - nodes[-1]
        both = {"last_leg": float(np.sqrt((leg * leg).sum())), "path_cost": path.pop("cost")}
        return posture | path | both | {"cost": posture["posture_cost"] + both["path_cost"]}

    def departures(self, problem: Problem, solution: FloatArray) -> list[str]:
        """Return the departures of posture and path; without a posture the path has no goal."""
        angles, nodes = self._parts(solution)
        found = self.placement.departures(problem.placement, angles)
        if self.placement.motion(problem.placement, angles) is None:
            return found
        path = self.path.departures(self._path_problem(problem, angles), nodes.ravel())
        return [*found, *path]

    def prior_queries(self, problem: Problem) -> int:
        """Return the nodes of the floor's map."""
        return self.path.prior_queries(problem.path)

    def memory(self, problem: Problem) -> int:
        """Return the memory of both stages."""
        path = self.path.memory(problem.path)
        return self.placement.memory(problem.placement) + path

    def shape(self, problem: Problem) -> tuple[Any, ...]:
        """Return the documented shape of a solution: θ1 and θ2, then nodes, all in pairs."""
        return (..., (ANGLES,))

    def _parts(self, solution: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return θ1 and θ2, and the nodes (nodes, 2)."""
        return solution[:ANGLES], solution[ANGLES:].reshape(-1, 2)


def _no_population() -> SettingError:
    return SettingError("planner", "one with a single population", TwoStage.component)


def _recorded(keeper: Keeper, found: Record, evaluations: int, lowest: float) -> Record:
    """Return the mission's record of a stage's generation, whose best plan costs `lowest`."""
    return keeper.record(
        CostStatistics(0, found.mean_cost, found.std_cost),
        found.costs[None, :],
        found.population,
        lowest=lowest,
        num_feasible=found.num_feasible,
        evaluations=evaluations,
        collision_queries=0,
    )
