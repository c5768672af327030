"""Pictures of the motions that any planner found: scene, stages, joints, covers."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from evoexp.playback.recording import Heading, NoMotion, Recording, record
from evoexp.records import FloatArray
from evoexp.report.figures import motion_scenes, motion_tables
from evoexp.report.page_parts import Drawing, PlayedRun
from evoexp.report.results import ConditionResults, Results

MOST = 4  # conditions whose motions are shown, those with the least best cost


class ShownMotion(NamedTuple):
    """The best motion of a condition."""

    condition: ConditionResults  # the condition
    recording: Recording  # the motion of its best replicate

    @property
    def title(self) -> str:
        """Label, replicate and verdict, as one line."""
        verdict = {True: "certified", False: "refuted", None: "undecided"}
        return f"{self.condition.label}: {verdict[self.recording.verdict.certified]}"

    @property
    def run(self) -> PlayedRun:
        """The run, to be played beside a figure."""
        return PlayedRun(self.condition, self.recording.heading.replicate)


def best_motions(results: Results) -> list[ShownMotion]:
    """Return the best motions of the conditions that have one, at most `MOST`, best ones first."""
    found: list[ShownMotion] = []
    for condition in sorted(results.with_data, key=_best_cost):
        if len(found) == MOST:
            break
        replicate = condition.best_replicate
        heading = Heading(condition.label, replicate)
        try:
            motion = record(condition.condition, condition.solutions[replicate], heading)
        except NoMotion:
            continue
        found.append(ShownMotion(condition, motion))
    return sorted(found, key=lambda each: results.with_data.index(each.condition))


def drawings(shown: Sequence[ShownMotion]) -> tuple[Drawing, ...]:
    """Return the figures of motions; none without motions."""
    if not shown:
        return ()
    best = min(shown, key=lambda each: _best_cost(each.condition))
    found = [
        *scene_drawing(shown),
        Drawing(
            "stages",
            "The motion, stage by stage",
            f"The best replicate of {best.condition.label}.",
            partial(motion_tables.stages_table, best.recording),
            motion_scenes.draw_stages,
            (best.condition,),
        ),
        Drawing(
            "joints",
            "Joints over the motion",
            "Each joint between its limits (dashed) over the same motion.",
            partial(motion_tables.joints_table, best.recording, _limits(best)),
            motion_scenes.draw_joints,
            (best.condition,),
        ),
    ]
    return (*found, *_cover_drawing(shown))


def scene_drawing(shown: Sequence[ShownMotion]) -> tuple[Drawing, ...]:
    """Return the figure of robots and scenes, with the motions to be played; none without any."""
    if not shown:
        return ()
    titled = [(each.title, each.recording) for each in shown]
    conditions = tuple(each.condition for each in shown)
    found = Drawing(
        "scene",
        "Robot, scene and way",
        "The best replicate of each condition: exact bodies at start and goal, and the way of "
        "each tool. Meshes are drawn by their convex hulls.",
        partial(motion_tables.scenes_table, titled),
        motion_scenes.draw_scenes,
        conditions,
        tuple(each.run for each in shown),
    )
    return (found,)


def notes(shown: Sequence[ShownMotion]) -> tuple[tuple[str, str], ...]:
    """Return (conditions, note): the notes on the conditions whose motions are shown."""
    labels: dict[str, list[str]] = {}
    for each in shown:
        for note in each.condition.condition.notes():
            own = labels.setdefault(note, [])
            if each.condition.label not in own:
                own.append(each.condition.label)
    return tuple((", ".join(own), note) for note, own in labels.items())


def _cover_drawing(shown: Sequence[ShownMotion]) -> tuple[Drawing, ...]:
    """Return the figure of bodies beside covers: one row per robot that has covers."""
    rows, conditions = [], []
    seen: list[object] = []
    for each in shown:
        planner, problem = each.condition.prepared
        covers = tuple(planner.covers(problem))
        robot = each.condition.condition.robot
        key = (robot, len(covers))
        if covers and key not in seen:
            seen.append(key)
            rows.append((each.condition.label, each.recording, covers))
            conditions.append(each.condition)
    if not rows:
        return ()
    return (
        Drawing(
            "covers",
            "Bodies and covers",
            "The exact bodies, which verdicts are about, beside the spheres and capsules that the "
            "search tests in their place.",
            partial(motion_tables.covers_table, rows),
            motion_scenes.draw_covers,
            tuple(conditions),
        ),
    )


def _limits(shown: ShownMotion) -> FloatArray:
    """Return the limits of the robot's joints, (nq, 2), infinite where there is none."""
    model = shown.recording.parts[0].scene.model
    limits = np.array([model.lowerPositionLimit, model.upperPositionLimit], dtype=np.float64).T
    return np.where(np.abs(limits) < 1e6, limits, np.copysign(np.inf, limits))


def _best_cost(condition: ConditionResults) -> float:
    cost = float(condition.summaries["best_cost"].astype("float64").min())
    return cost if np.isfinite(cost) else np.inf
