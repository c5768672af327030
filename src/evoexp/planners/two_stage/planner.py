"""A mission in two stages: a docking place and posture, then a safe path to it.

Chen & Zalzala 1995: the placement search of section 3, then the path search of section 2 to the
node nearest to the docking place. The motion follows the path, goes on to the docking place itself,
and turns the arm from the travel posture to that of the first stage.

A solution is flat: θ1, θ2 [deg], then the coordinates of the path's nodes. Its cost is E (Eq. 14) +
C (Eq. 1). In the first stage the cost of the plan is inf, the individuals cost E.
"""

from collections.abc import Generator, Iterator
from typing import Any, ClassVar, NamedTuple, NoReturn

import numpy as np

from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError, demand
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion
from evoexp.planners.answers import Acceptance, Proofs
from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.planners.grid_path_ga.planner import Problem as PathProblem
from evoexp.planners.placement_ga.planner import PlacementGa
from evoexp.planners.placement_ga.planner import Problem as PlacementProblem
from evoexp.planners.planner import PlannerDefaults
from evoexp.records import Best, Block, FloatArray
from evoexp.robots.arms import ARM_JOINTS, FloorManipulator
from evoexp.scenarios.motion_tasks import Mission
from evoexp.validation import Component

ANGLES = 2
POSTURE = ("theta_1_deg", "theta_2_deg", "theta_3_deg", "platform_x", "torque_norm", "torque_max")
PATH = ("distance", "unsafeness", "num_nodes")


class Problem(NamedTuple):
    """Robot and scenario, prepared for both stages."""

    robot: FloorManipulator  # the description; parts of it solve the stages
    scenario: Mission  # the mission
    placement: PlacementProblem  # problem of the first stage
    path: PathProblem  # problem of the second one, with the goal of the grid
    scene: Scene  # all bodies, for the exact verdict on the motion
    security_margin: float  # clearance that the task requires [length unit]


class TwoStage(PlannerDefaults, Component):
    """The placement search, then the path search."""

    placement: PlacementGa  # the planner of the first stage
    path: GridPathGa  # the planner of the second one
    # which missions are an answer: all that both stages accept (`model`), or only missions
    # whose whole motion, driving and docking, the exact certifier also proves (`certified`,
    # `margin`). Refuted moves over the grid are then forbidden
    acceptance: Acceptance = "model"

    def prepare(self, robot: FloorManipulator, scenario: Mission) -> Problem:
        """Prepare both stages."""
        must = "two numbers, the size of a floor"
        demand(len(scenario.grid.size) == 2, "scenario.grid.size", must, list(scenario.grid.size))
        placement = self.placement.prepare(robot.arm(), scenario.docking)
        path = self._driving.prepare(robot.platform(), scenario.grid)
        bodies = scene(robot.build(), scenario.grid.bodies(), self_pairs=True)
        return Problem(robot, scenario, placement, path, bodies, scenario.grid.security_margin)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the generations of both stages; their indices go on counting."""
        docked = yield from self._place(problem, rng)
        yield from self._drive(problem, rng, docked)

    def _place(self, problem: Problem, rng: np.random.Generator) -> Generator[Block, None, Block]:
        no_path, start = dict.fromkeys(PATH, 0.0) | {"sub_path": 1.0}, problem.scenario.grid.start
        for block in self.placement.evolve(problem.placement, rng):
            bests = []
            for place, angles, *_ in block.bests:
                plan, terms = np.concatenate([angles, start]), self._posture_terms(problem, angles)
                bests.append(Best(place, plan, np.inf, terms | no_path, False))
            lowest = [np.inf] * block.num_generations
            yield block._replace(bests=bests, lowest=lowest, costs=block.costs[:, None])
        return block

    def _drive(self, problem: Problem, rng: np.random.Generator, placed: Block) -> Iterator[Block]:
        docked = placed.bests[-1]
        posture = self._posture_terms(problem, docked.solution) | {"sub_path": 2.0}
        path_problem = self._path_problem(problem, docked.solution)
        proofs = Proofs(self, problem) if self.answers_are_proven else None
        best: Best | None = None
        nodes = np.empty(0)
        for block in self._driving.evolve(path_problem, rng):
            bests = dict[int, Best]() if best is None else {0: best}
            for path in block.bests:
                if path.solution is nodes:
                    continue
                nodes, cost = path.solution, docked.cost + path.cost
                plan = np.concatenate([docked.solution, nodes])
                solved = docked.solved and path.solved
                if proofs is not None and not (solved and proofs.is_proven(plan)):
                    cost, solved = np.inf, False
                if proofs is None or best is None or solved or not best.solved:
                    terms = posture | {name: path.terms[name] for name in PATH}
                    best = bests[path.place] = Best(path.place, plan, cost, terms, solved)
            assert best is not None, "a block begins with a best path"
            best = best._replace(place=0)
            yield block._replace(
                first=placed.first + placed.num_generations + block.first,
                bests=[*bests.values()],
                lowest=[docked.cost + cost for cost in block.lowest],
                evaluations=[placed.evaluations[-1] + count for count in block.evaluations],
                costs=block.costs[:, None],
            )

    def _path_problem(self, problem: Problem, angles: FloatArray) -> PathProblem:
        """Return the second stage's problem, its goal the node nearest to the docking place."""
        grid = problem.scenario.grid
        node = tuple(int(np.floor(value + 0.5)) for value in self.docking_place(problem, angles))
        if node == grid.goal:
            return problem.path
        task = type(grid)(**(dict(grid) | {"goal": node}))
        return self._driving.prepare(problem.robot.platform(), task)

    @property
    def _driving(self) -> GridPathGa:
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
        if index < first:
            return self.placement.num_evaluations(index)
        return self.path.num_evaluations(index - first)

    def _refused(self, problem: Problem, *arguments: Any) -> NoReturn:
        """Refuse: there are two populations, one per stage."""
        raise SettingError("planner", "one with a single population", self.component)

    sample: ClassVar[Any] = _refused
    cost: ClassVar[Any] = _refused
    solution: ClassVar[Any] = _refused

    def motion(self, problem: Problem, solution: FloatArray) -> Motion | None:
        """Return the motion, (nodes + 2, 5) in equal times; None without a feasible posture."""
        angles, nodes = self._parts(solution)
        posture = self.placement.motion(problem.placement, angles)
        if posture is None:
            return None
        place = np.vstack([nodes, *[self.docking_place(problem, angles)] * 2])
        q = np.empty((len(place), 2 + ARM_JOINTS))
        q[:, :2], q[:, 2:] = place, DEGREE * np.array(problem.scenario.travel_posture)
        q[-1, 2:] = posture.q[0, 1:]
        return Motion(q)

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the terms of posture and path, the last leg to the docking place, and the cost."""
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
