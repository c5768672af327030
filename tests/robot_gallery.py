"""Robots of the package example-robot-data and of their makers' packages, and reaches they plan.

Used by the test of the former and by `scripts/update-gallery`, which writes the page of all.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import EvoexpError
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray, ReplicateSummary
from evoexp.robots.assembly import Assembly, Robot
from evoexp.robots.kinematics import frame_pose, local_pose
from evoexp.robots.urdf import ROBOT_DATA
from evoexp.testing import conditions

TRIES = 60  # random configurations, of which one must be free
DRAWS = 5  # of a start and a goal
REPLICATES = 5  # of which one must be certified
BALL = 0.2  # [-] radius of the obstacle: share of its distance from the ends
NO_OBSTACLE = "scenario.obstacles=[]"
STRIDE = 0.25  # [-] of a joint's range: how far from the start the goal is drawn
POSTURES = (
    *("scenario=urdf_reach", "planner=posture_es", "ga=corsepius", "objective=corsepius_reach"),
    *("collision=corsepius_spheres", "collision.inflation=0.05"),
    *("scenario.check_reach=false", "planner.edge_check=4"),
)
STRINGS = (
    *("scenario=urdf_two_arms", "planner=rana_puma", "ga=rana_puma", "objective=rana_puma"),
    "collision=urdf_two_arms",
)


class GalleryRobot(NamedTuple):
    """A robot, and the joints of one of its arms."""

    name: str  # of the robot
    path: str  # of its URDF in example-robot-data; of a maker's package that of its xacro or URDF
    joints: tuple[str, ...] = ()  # that move; none: all
    tool: str = ""  # frame of the tool, empty for the last one
    thickness: float = 0.06  # radius of the spheres by which `via_point_ga` tests its links [m]
    srdf: str = ""  # its SRDF in the package; empty: pairs of bodies are derived from samples alone
    repository: str = ""  # on GitHub, of its maker's package; empty: example-robot-data
    urdf: str = ""  # expanded from a maker's package

    @property
    def words(self) -> tuple[str, ...]:
        """Words of the command line that choose it."""
        found = ["robot=urdf", f"robot.path={self.urdf or f'{ROBOT_DATA}:{self.path}'}"]
        found += [f"robot.joints=[{','.join(self.joints)}]"] if self.joints else []
        found += [f"robot.srdf={ROBOT_DATA}:{self.srdf}"] if self.srdf else []
        return (*found, *([f"robot.tool_frame={self.tool}"] if self.tool else ()))


ALL = tuple(
    GalleryRobot(**row | {"joints": tuple(row.get("joints", ()))})
    for row in yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text())
)
ROBOTS = tuple(robot for robot in ALL if not robot.repository)
MAKERS = tuple(robot for robot in ALL if robot.repository)


class Reach(NamedTuple):
    """A reach of a robot, as a task of each planner."""

    postures: Condition  # for `posture_es`: to the point where the tool is at the goal
    strings: Condition  # for `via_point_ga`: to the goal's configuration
    q_start: FloatArray  # (nq,) start [deg, m]
    q_goal: FloatArray  # (nq,) goal


class PlannedReach(NamedTuple):
    """A reach, and the summaries of certified motions by both planners."""

    reach: Reach  # the reach
    postures: ReplicateSummary | None  # of `posture_es`; None: no motion was certified
    strings: ReplicateSummary | None  # of `via_point_ga`, likewise
    draws: int  # how many starts and goals were drawn


def planned_reach(robot: GalleryRobot) -> PlannedReach:
    """Draw starts and goals until both planners have certified motions, or `DRAWS` are drawn."""
    found, refusal = None, EvoexpError()
    for draw in range(DRAWS):
        try:
            reach = find_reach(robot, draw)
            found = PlannedReach(reach, plan(reach.postures), plan(reach.strings), draw + 1)
        except EvoexpError as error:
            refusal = error
            continue
        if found.postures is not None and found.strings is not None:
            break
    if found is None:
        raise refusal
    return found


def find_reach(robot: GalleryRobot, draw: int = 0) -> Reach:
    """Draw a start and a goal that are free of collision; `draw` is the seed."""
    built = _condition((*robot.words, *POSTURES, NO_OBSTACLE)).robot
    assert isinstance(built, Robot)
    assembly = built.build()
    units = np.where(assembly.table.slides, 1.0, DEGREE)
    model, rng = assembly.model, np.random.default_rng(draw)
    low, high = model.lowerPositionLimit / units, model.upperPositionLimit / units
    reach = np.minimum(high - low, np.where(assembly.table.slides, np.inf, 360.0))
    middle = np.clip(np.zeros(model.nq), low + 0.1 * reach, high - 0.1 * reach)
    start = _free(robot, assembly, middle, 0.25 * reach, rng, (low, high))
    goal = _free(robot, assembly, start, STRIDE * reach, rng, (low, high), at_least=0.3)
    lists = tuple(f"scenario.{n}=[{_listed(q)}]" for n, q in (("q_start", start), ("q_goal", goal)))
    ball = _ball(assembly, start, goal)
    strings = _condition(
        (*robot.words, *STRINGS, f"collision.sphere_radius={robot.thickness}", *lists, ball)
    )
    return Reach(_reaching(robot, assembly, start, goal, ball), strings, start, goal)


def plan(condition: Condition) -> ReplicateSummary | None:
    """Run replicates until one is solved and its motion certified; None: none of them is."""
    for index in range(REPLICATES):
        found = run_replicate(condition, index).summary
        if found.solved and found.certified:
            return found
    return None


def _ball(assembly: Assembly, start: FloatArray, goal: FloatArray) -> str:
    """Put a small ball where the tool is half way between two configurations [deg, m]."""
    middle = _tool_at(assembly, 0.5 * (start + goal))
    ends = [_tool_at(assembly, q) for q in (start, goal)]
    radius = BALL * min(float(np.sqrt(np.sum((middle - end) ** 2))) for end in ends)
    ball = f"shape: sphere, name: ball, center: {_listed(middle)}, radius: {radius:.6f}"
    return f"scenario.obstacles=[{{{ball}}}]"


def _tool_at(assembly: Assembly, q: FloatArray) -> FloatArray:
    """Return where the tool is at a configuration [deg, m], (3,)."""
    tool, units = assembly.tools[0], np.where(assembly.table.slides, 1.0, DEGREE)
    local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
    return frame_pose(assembly.table, tool.joint - 1, local, q * units)[9:]


def _free(
    robot: GalleryRobot,
    assembly: Assembly,
    around: FloatArray,
    spread: FloatArray,
    rng: np.random.Generator,
    limits: tuple[FloatArray, FloatArray],
    at_least: float = 0.0,
) -> FloatArray:
    """Draw configurations around one until the planner takes one as a start."""
    (low, high), refusal = limits, EvoexpError()
    inside = 0.02 * (high - low)
    for attempt in range(TRIES):
        drawn = rng.uniform(-1.0, 1.0, len(around)) * spread
        drawn += np.sign(drawn) * at_least * spread
        still = attempt == 0 and at_least == 0.0
        q = np.clip(around + (0.0 if still else 1.0) * drawn, low + inside, high - inside)
        try:
            _reaching(robot, assembly, q, q).prepare()
            return np.asarray(q)
        except EvoexpError as error:
            refusal = error
    raise refusal


def _reaching(
    robot: GalleryRobot,
    assembly: Assembly,
    start: FloatArray,
    goal: FloatArray,
    obstacles: str = NO_OBSTACLE,
) -> Condition:
    """Return the task to reach the point where the tool is at a configuration [deg, m]."""
    point = _tool_at(assembly, goal)
    phase = f"{{name: reach, goal: {{kind: point, point: {_listed(point)}}}}}"
    task = (f"scenario.q_start={_listed(start)}", f"scenario.phases=[{phase}]")
    return _condition((*robot.words, *POSTURES, obstacles, *task))


def _condition(words: Sequence[str]) -> Condition:
    (found,) = conditions(*words, budget="paper").values()
    return found


def _listed(values: FloatArray) -> str:
    return "[" + ",".join(f"{value:.6f}" for value in values) + "]"
