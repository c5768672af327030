"""What the title of Chen & Zalzala 1995 promises.

A safe path and a docking configuration, as one motion.
"""

from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin

from evoexp.papers.chen import path_measures as measures
from evoexp.papers.chen.figures import missions
from evoexp.papers.chen.figures.missions import DOCKED, TRAVEL, Shown
from evoexp.records import FloatArray
from evoexp.report import markdown
from evoexp.report.page import Drawing, Page
from evoexp.report.pages import generic
from evoexp.report.proportions import Proportion
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

INTRODUCTION = (
    "Two searches, one motion: the placement search (section 3) chooses docking place and "
    "posture of the arm, the path search (section 2) a path over the floor to the node nearest "
    "to it. The platform drives along the path, on to the docking place, and the arm goes from "
    "its travel posture to the one that was chosen. The exact verdict is on the whole of it: "
    "platform and links against all obstacles, and against each other. The cost is E (Eq. 14) + "
    "C (Eq. 1)."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; the generic one where planners are others."""
    if not results.with_data or not all(hasattr(c.planner, "placement") for c in results.with_data):
        return generic.page(results, settings)
    row, column = partial(generic.quantity, results), generic.by_column
    return Page(
        title=f"Chen & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=(
            row("cost E + C", "–", column("best_cost")),
            row("path cost C", "–", column("term_path_cost")),
            row("length of the path D", "cell", column("term_distance")),
            row("mean unsafeness S", "–", column("term_unsafeness")),
            row("posture cost E", "–", column("term_posture_cost")),
            row("torque norm, squared", "–", column("term_torque_norm")),
            row("greatest torque", "–", column("term_torque_max")),
            row("from the last node to the docking place", "unit", column("term_last_leg")),
            row(
                "clearance of the bodies over the whole motion (exact)", "unit", column("clearance")
            ),
            row("evaluations", "–", column("evaluations")),
            row("CPU time of a run, exact verdict included", "s", column("cpu_s")),
            row("CPU time of its searches", "s", measures.search_seconds),
        ),
        checks=_checks(results, settings),
        drawings=(_drawing(results),),
    )


def _checks(results: Results, settings: ReportSettings) -> tuple[tuple[str, str], ...]:
    rows = []
    for c in results.with_data:
        found = c.verdicts
        share = markdown.percent(
            Proportion(found.certified, found.judged).interval(settings.confidence)
        )
        told = (
            f"{markdown.share(found.certified, found.judged)} ({share}) free of contact over the "
            "whole motion"
        )
        nearest = c.summaries["clearance_pair"].value_counts()
        told += (
            f"; {found.refuted} touch, {found.undecided} undecided; closest most often: "
            f"{nearest.index[0]}"
        )
        rows.append((f"{c.label}: exact verdicts", told))
        places = np.round(c.column("term_platform_x"), 3)
        spread = (
            f"between {places.min():g} and {places.max():g}, "
            f"{np.count_nonzero(places < _target(c)[0])} of {c.done}"
        )
        rows.append(
            (f"{c.label}: docking places X_p", f"{spread} on the near side of the end-effector")
        )
    return tuple(rows)


def _target(condition: ConditionResults) -> FloatArray:
    return np.array(condition.condition.scenario.docking.target)  # type: ignore[attr-defined]


def _drawing(results: Results) -> Drawing:
    shown = [_shown(c) for c in results.with_data]
    return Drawing(
        "mission",
        "Path and docking posture",
        "Per condition the run of median cost. Left: the floor, obstacles from centre to centre "
        "of their outermost nodes. Right: the platform at its docking place, the arm as it "
        "drives and as it docks, the force that acts.",
        partial(missions.missions_table, shown),
        missions.draw_missions,
        results.with_data,
    )


def _shown(condition: ConditionResults) -> Shown:
    replicate, prepared = measures.median_replicate(condition), condition.prepared
    scenario: Any = condition.condition.scenario
    robot: Any = condition.condition.robot
    q, model = (
        prepared.planner.motion(prepared.problem, condition.solutions[replicate]).q,
        prepared.problem.scene.model,
    )
    (x, _), (reach, above) = scenario.task_origin, scenario.docking.target
    postures = {
        name: _joints(model, own, robot.link_lengths[-1])
        for name, own in ((TRAVEL, q[-2]), (DOCKED, q[-1]))
    }
    verdict = condition.summaries.loc[replicate]
    word = "certified" if verdict["certified"] else "not certified"
    return Shown(
        f"{condition.label}, run {replicate}, {word}, clearance {verdict['clearance']:.3g}",
        condition.condition.length_unit,
        list(scenario.grid.obstacles),
        q[:-1, :2],
        postures,
        (robot.body_radius, robot.body_height),
        np.array([x + reach, robot.body_height + above]),
        scenario.docking.force,
    )


def _joints(model: pin.Model, q: FloatArray, last: float) -> FloatArray:
    """Return the arm's joints and its end (4, 2): x, and height.

    `last` is the length of its last link.
    """
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    points = [data.oMi[k].translation for k in range(3, model.njoints)]
    points.append(data.oMi[model.njoints - 1].act(np.array([last, 0.0, 0.0])))
    return np.array([[point[0], point[2]] for point in points])
