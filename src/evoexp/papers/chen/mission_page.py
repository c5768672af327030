"""Chen & Zalzala 1995, both searches joined: a safe path and a docking posture as one motion."""

from functools import partial

import numpy as np

from evoexp.papers.chen.figures import missions
from evoexp.papers.chen.rules import PAPER
from evoexp.planners.two_stage.planner import TwoStage
from evoexp.report import kit
from evoexp.report.kit import generic, markdown, run_measures


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the missions, or the generic page if another planner was run."""
    found = results.with_data
    if not kit.planned_by(results, TwoStage):
        return generic.page(results, settings)
    row, column = partial(generic.quantity, results), kit.by_column
    clearance = "clearance of the bodies over the whole motion (exact)"
    drawing = PAPER.drawing(
        "mission",
        partial(missions.missions_table, found),
        missions.draw_missions,
        found,
        tuple(
            kit.PlayedRun(c, run_measures.median_replicate(c, column("best_cost")(c)))
            for c in found
        ),
    )
    return PAPER.page(
        results,
        "mission",
        quantities=(
            row("cost E + C", "–", column("best_cost")),
            row("path cost C", "–", column("term_path_cost")),
            row("length of the path D", "cell", column("term_distance")),
            row("mean unsafeness S", "–", column("term_unsafeness")),
            row("posture cost E", "–", column("term_posture_cost")),
            row("torque norm, squared", "–", column("term_torque_norm")),
            row("greatest torque", "–", column("term_torque_max")),
            row("from the last node to the docking place", "unit", column("term_last_leg")),
            row(clearance, "unit", column("clearance")),
            row("evaluations", "–", column("evaluations")),
            row("CPU time of a run, exact verdict included", "s", column("cpu_s")),
            row("CPU time of its searches", "s", run_measures.search_seconds),
        ),
        checks=tuple(row for c in found for row in _checks(c, settings)),
        drawings=(drawing,),
    )


def _checks(
    condition: kit.ConditionResults, settings: kit.ReportSettings
) -> tuple[tuple[str, str], ...]:
    """Return the rows on a condition's exact verdicts and on its docking places."""
    label, found, scenario = condition.label, condition.verdicts, condition.condition.scenario
    free = kit.Proportion(found.certified, found.judged)
    nearest = condition.summaries["clearance_pair"].value_counts()
    places = np.round(condition.column("term_platform_x"), 3)
    near = np.count_nonzero(places < scenario.docking.target[0])  # type: ignore[attr-defined]
    verdicts = (
        f"{markdown.share(*free)} ({markdown.percent(free.interval(settings.confidence))}) free "
        f"of contact over the whole motion; {found.refuted} touch, {found.undecided} undecided; "
        f"closest most often: {nearest.index[0]}"
    )
    spread = (
        f"between {places.min():g} and {places.max():g}, {near} of {condition.done} on the near "
        "side of the end-effector"
    )
    return (f"{label}: exact verdicts", verdicts), (f"{label}: docking places X_p", spread)
