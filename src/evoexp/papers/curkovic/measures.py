"""Measures of Curkovic et al. 2013: executed motions, effort to a threshold, known defects."""

import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.planar.planar_arms import Arm
from evoexp.condition import Prepared
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion, cubic_motion, top_speeds
from evoexp.planners.coevolution.planner import Problem
from evoexp.records import BoolArray, FloatArray
from evoexp.report.pages.page_parts import PlayedRun
from evoexp.report.results import motion_geometry
from evoexp.report.results.run_measures import counted, search_seconds, solved, summed, touches
from evoexp.report.results.stored_results import ConditionResults, Results, wrapped
from evoexp.report.statistics import inference
from evoexp.report.statistics.inference import quantile
from evoexp.report.statistics.judging import Rules

TOOL_SAMPLES = 20  # per segment, where end-effectors' distances from other robots are measured
ROUNDING = 1e-9  # [deg] a curve may leave the range by this much and still touch its end
EARLY = 30  # generation that the paper's Fig. 5 calls an early phase
INSTANTS = 100  # of a segment, at which the paper's model looks for contacts of whole motions
CERTIFIED = "best cost, a refuted motion counting as worse than any"


def fits(results: Results) -> bool:
    """Return whether there are results, and all of co-evolving robots."""
    problems = [c.prepared.problem for c in results.with_data]
    return bool(problems) and all(isinstance(problem, Problem) for problem in problems)


def enveloped(condition: ConditionResults) -> bool:
    """Return whether the search tests more of the robots than their lines."""
    collision = condition.planner.collision
    return bool(collision.half_width > 0.0 or collision.tcp_radius > 0.0)


def kinds(
    condition: ConditionResults, radius_conditions: Sequence[ConditionResults]
) -> dict[str, bool]:
    """Name the kind of a scene: `many` robots, one `still`, two of `thick` or `crossing` bodies.

    Figs. 8 and 9 (`fig_8`) show two robots of one radius; `other` are motions of no figure.
    """
    problem = condition.problem(Problem)
    many, all_move = len(problem.start) > 2, bool(problem.moving.all())
    two, thick = all_move and not many, enveloped(condition)
    found = {"many": many, "still": not (many or all_move), "fig_8": two and not radius_conditions}
    found |= {"thick": two and thick, "crossing": two and not thick}
    return found | {"other": not (found["still"] or found["fig_8"])}


def expected_time(condition: ConditionResults, threshold: float) -> FloatArray:
    """Return the expected running time to a cost at the median price of an evaluation, (1,) [s]."""
    price = quantile(search_seconds(condition) / condition.column("evaluations"), 0.5)
    return np.array([expected_evaluations(condition, threshold) * price])


def lower_bound(condition: ConditionResults) -> float:
    """Return a lower bound of a team's cost: straight paths, least turns, no unevenness."""
    problem, objective = condition.problem(Problem), condition.planner.objective
    robots, total = arms(condition.prepared), 0.0
    for arm, start, goal in zip(robots, problem.start, problem.goal, strict=True):
        first, last = (arm.outlines(q.reshape(1, 2, 1))[0, 2:4, 0] for q in (start, goal))
        path = float(np.sqrt(np.sum((last - first) ** 2)))
        turns = float(np.sum(np.abs(goal - start)))
        total += objective.path_weight * path + objective.rotation_weight * turns
    return total


def generations_to(condition: ConditionResults, threshold: float) -> FloatArray:
    """Return each run's first generation with a team at or below a cost, (done,); inf: none."""
    return _least(condition, "index", "best_cost", threshold)


def evaluations_to(condition: ConditionResults, threshold: float) -> FloatArray:
    """Return each run's evaluations to a team at or below a cost, (done,); inf: none."""
    return _least(condition, "evaluations", "best_cost", threshold)


def expected_evaluations(condition: ConditionResults, threshold: float) -> float:
    """Return the expected running time to a team at or below a cost, in evaluations."""
    first = evaluations_to(condition, threshold)
    reached = np.isfinite(first)
    return inference.expected_effort(
        np.where(reached, first, condition.column("evaluations")), reached
    )


def refuted(condition: ConditionResults) -> FloatArray:
    """Return 1 for each run whose solved motion the exact verdict refutes, else 0, (done,).

    NaN where nothing is solved.
    """
    return np.where(solved(condition), touches(condition), np.nan)


def free_by_envelope(condition: ConditionResults) -> BoolArray:
    """Return whether each run's motion is free by the paper's own model between instants, (done,).

    The exact verdict judges links that are round at their ends and so reach a little further.
    """
    planner = condition.planner
    fine = planner.collision.model_copy(update={"collision_substeps": INSTANTS})
    fine_planner = planner.model_copy(update={"collision": fine})
    planner, problem = condition.condition._replace(planner=fine_planner).prepare()
    return np.array(
        [
            planner.evaluate(problem, condition.solutions[int(k)])["team_collisions"] == 0.0
            for k in condition.summaries.index
        ]
    )


def hit_when_stopped(condition: ConditionResults) -> BoolArray:
    """Return whether a robot may be hit if it stops while the others go on, (done,).

    Each robot of each run's motion stops at each of its configurations but the last.
    """
    planner, problem = condition.prepared
    shape = len(problem.start), planner.num_configurations + 2, 2
    stops = list(itertools.product(range(shape[0]), range(shape[1] - 1)))
    found = []
    for solution in condition.solutions.values():
        teams = np.tile(solution.reshape(shape), (len(stops), 1, 1, 1))
        for team, (robot, instant) in zip(teams, stops, strict=True):
            team[robot, instant:] = team[robot, instant]
        hits = (planner.evaluate(problem, team.ravel())["team_collisions"] for team in teams)
        found.append(any(hit > 0.0 for hit in hits))
    return np.array(found)


tip_path = summed("term_tip_path_robot_")  # C2 [m], over the robots
rotation = summed("term_rotation_robot_")  # C3 [rad]
unevenness = summed("term_tip_unevenness_robot_")  # C4 [m]


def certified_cost(condition: ConditionResults) -> FloatArray:
    """Return each run's best cost, (done,); inf where the exact verdict refutes its motion."""
    return np.where(refuted(condition) == 1.0, np.inf, condition.column("best_cost"))


def exemplar(condition: ConditionResults) -> int:
    """Return the replicate of lowest cost that is not refuted; if all are, of lowest cost."""
    costs = certified_cost(condition)
    if not np.isfinite(costs).any():
        return condition.best_replicate
    return int(condition.summaries.index[int(np.argmin(costs))])


def near_best(condition: ConditionResults, results: Results, rules: Rules) -> BoolArray:
    """Return whether each run's cost is near the best one known of its scene, (done,).

    The best one of all runs of the experiment: nobody knows the optimum.
    """
    scene = condition.robot, condition.scenario
    beside = [c for c in results.with_data if (c.robot, c.scenario) == scene]
    known = min(float(c.column("best_cost").min()) for c in beside)
    most = 1.0 + 0.01 * rules["near_optimal"].limits["near_percent"]
    return np.asarray(condition.column("best_cost") <= most * known)


def cost_at_equal_effort(condition: ConditionResults, results: Results) -> FloatArray:
    """Return the cost of each run's best team after as many evaluations as the shortest run has.

    Shape (done,); inf where it has no team by then.
    """
    budget = min(float(c.column("evaluations").min()) for c in results.with_data)
    return _least(condition, "best_cost", "evaluations", budget)


def _least(condition: ConditionResults, column: str, within: str, most: float) -> FloatArray:
    """Return a column's least value in the generations within a bound, (done,); inf: in none."""
    rows = condition.generations
    least = rows[rows[within] <= most].groupby("replicate")[column].min()
    return least.reindex(condition.summaries.index).fillna(np.inf).to_numpy(np.float64)


def cost_spread(condition: ConditionResults) -> FloatArray:
    """Return how far each run's best cost is from the median of all, (done,): Brown & Forsythe."""
    costs = condition.column("best_cost")
    return np.asarray(np.abs(costs - np.median(costs)))


def elbow_changes(condition: ConditionResults) -> FloatArray:
    """Return how often elbows change sides from a configuration to the next, (done,).

    Summed over the robots: the angle of the second link against the first changes its sign.
    """
    changes = []
    for solution in condition.solutions.values():
        elbows = motion_geometry.configurations(condition.prepared, solution)[1::2]
        changes.append(float(np.count_nonzero(np.diff(np.sign(elbows), axis=1))))
    return np.array(changes)


def leaves_range(condition: ConditionResults) -> BoolArray:
    """Return whether each run's executed curve leaves the range of a joint, (done,)."""
    beyond = [condition.column(str(c)) for c in condition.summaries if "out_of_range" in str(c)]
    return np.asarray(np.max([np.zeros(condition.done), *beyond], axis=0) > ROUNDING)


def times_over_limit(condition: ConditionResults) -> FloatArray:
    """Return each run's greatest speed of a link over its limit by Eq. 2, (done,) [-]."""
    solutions = (condition.solutions[int(k)] for k in condition.summaries.index)
    return np.array([over_limit(condition.prepared, solution) for solution in solutions])


def over_limit(prepared: Prepared, solution: FloatArray) -> float:
    """Return the greatest speed of any link during a motion, over its limit by Eq. 2 [-]."""
    turns = top_speeds(executed(prepared, solution)).reshape(-1, 2) / DEGREE
    return float(np.max(turns / speed_limits(prepared)))


class SampledMotion(NamedTuple):
    """A motion at many instants."""

    instants: FloatArray  # (samples,), whole numbers are the configurations
    links: FloatArray  # (samples, robots, 2) absolute link angles from +x [deg]
    # (samples, robots, 2) their turns per instant, at the right of each instant [deg]
    speeds: FloatArray

    @property
    def q(self) -> FloatArray:
        """(nq, samples) joint angles, of second links against the first [deg]."""
        relative = self.links.copy()
        relative[:, :, 1] -= relative[:, :, 0]
        return np.ascontiguousarray(relative.reshape(len(relative), -1).T)


def arms(prepared: Prepared) -> tuple[Arm, ...]:
    """Return base and link lengths of every robot."""
    return tuple(Arm((x, y), (one, two)) for x, y, one, two in prepared.problem.arms.tolist())


def executed(prepared: Prepared, solution: FloatArray) -> Motion:
    """Return the motion that a solution executes, in absolute link angles [rad].

    Straight lines or cubic curves lead from configuration to configuration, robot by robot.
    """
    polynomials = prepared.planner.motion(prepared.problem, solution).polynomials.copy()
    polynomials[..., 1::2] += polynomials[..., ::2]  # joints turn against the link before
    return cubic_motion(polynomials)


def sampled(prepared: Prepared, solution: FloatArray, samples: int) -> SampledMotion:
    """Sample the motion that a solution executes, so often per segment."""
    motion = executed(prepared, solution)
    segments = motion.num_segments
    instants = np.arange(segments * samples + 1) / samples
    before = np.minimum(instants.astype(np.int64), segments - 1)
    u = (instants - before)[:, None]
    c0, c1, c2, c3 = motion.polynomials[before].transpose(1, 0, 2)
    shape = (len(instants), -1, 2)
    angles, speeds = c0 + u * (c1 + u * (c2 + u * c3)), c1 + u * (2.0 * c2 + 3.0 * u * c3)
    return SampledMotion(instants, angles.reshape(shape) / DEGREE, speeds.reshape(shape) / DEGREE)


def speed_limits(prepared: Prepared) -> FloatArray:
    """Return how far links may turn per sampling step (Eq. 2), (robots, 2) [deg]."""
    limit = wrapped(prepared.planner).speed_limit
    return np.array([limit.greatest_steps(arm.lengths) for arm in arms(prepared)])


def straight(prepared: Prepared) -> FloatArray:
    """Return the solution whose link angles go straight from start to goal, flat [deg]."""
    planner, problem = prepared
    ends = problem.start.ravel(), problem.goal.ravel()
    return motion_geometry.straight_line(planner.shape(problem), *ends) / DEGREE


def tool_distance(condition: ConditionResults) -> FloatArray:
    """Return how near any end-effector comes to a link of another robot, (done,) [length unit].

    Links and end-effectors have no thickness here.
    """
    found, assembly = [], condition.prepared.problem.assembly
    for k in condition.summaries.index:
        motion = sampled(condition.prepared, condition.solutions[int(k)], TOOL_SAMPLES)
        places = motion_geometry.joint_positions(assembly, motion.q)
        links = [(robot, start, end) for robot, link, start, end in places if link < 2]
        tips = {robot: end for robot, _, end in links}
        distances = (
            to_segment(tip, start, end)
            for (robot, tip), (other, start, end) in itertools.product(tips.items(), links)
            if robot != other
        )
        found.append(min(distances))
    return np.array(found)


def to_segment(points: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the least distance of points from segments, row by row; each (rows, 2 or 3)."""
    along = end - start
    share = np.clip(((points - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    return float(np.sqrt(((points - start - share[:, None] * along) ** 2).sum(axis=1)).min())


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # cost of each run's best team at generation 30, (done,); inf: it has none
    "early_cost": lambda condition: _least(condition, "best_cost", "index", EARLY),
    "too_fast": lambda condition: times_over_limit(condition) > 1.0,  # by Eq. 2, (done,)
    "touching": lambda condition: touches(condition)[solved(condition)],  # of the solved motions
    # solved motions that fail: bodies collide between the configurations, the executed curve
    # leaves the range of a joint, a link is faster than Eq. 2 allows
    "refuted_motions": lambda touching: counted(touching),
    "leaving_motions": lambda condition: counted(leaves_range(condition)[solved(condition)]),
    "fast_motions": lambda condition, too_fast: counted(too_fast[solved(condition)]),
    # expected running time to a cost in whole evaluations, (1,)
    "expected_effort": lambda condition, threshold: np.rint(
        [expected_evaluations(condition, threshold)]
    ),
    "bound": lambda first: lower_bound(first),  # in the first condition's scene
    "threshold": lambda bound, settings: settings.threshold_ratio * bound,  # of effort
    "one_scene": lambda results: len({(c.robot, c.scenario) for c in results.with_data}) == 1,
    "exemplar_run": lambda condition: (PlayedRun(condition, exemplar(condition)),),
    # runs whose first generation holds a collision-free team
    "free_at_first": lambda condition: int(
        (condition.column("first_feasible_generation") == 0).sum()
    ),
}
