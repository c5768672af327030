"""Quantities of single runs that several pages compare, and what evolution adds to its controls."""

from collections.abc import Sequence

import numpy as np

from evoexp.papers.rana import motions
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import ConditionResults, markdown

UNEVENNESS = "term_unevenness_arm_"
FIRST_FREE = "first generation with a collision-free individual (∞: none in the whole run)"
COST = kit.by_column("best_cost")


def unevenness(condition: ConditionResults) -> FloatArray:
    """Return C3 + C4 + … of each run's best: sums of |step − mean step| (Eqs. 4, 5), (done,) [deg].

    NaN where the planner has no such terms.
    """
    columns = [name for name in condition.summaries if str(name).startswith(UNEVENNESS)]
    if not columns:
        return np.full(condition.done, np.nan)
    return np.asarray(np.sum([condition.column(str(name)) for name in columns], axis=0))


def evolution_told(
    judge: kit.Judge, condition: kit.ConditionResults, controls: Sequence[kit.ConditionResults]
) -> tuple[str, list[kit.Comparison]]:
    """Return the evidence on what evolution adds to each control, and the comparisons of costs.

    The control of the lowest median cost comes first.
    """
    pairs = [(condition, control) for control in controls if control.done]
    rows = {row.quantity: row for row in kit.compared(pairs, COST, judge.settings)}
    shown = [control for control in controls if control.label in rows]
    shown.sort(key=lambda control: float(np.median(COST(control))))
    fitness = " · ".join(
        f"{c.label} {markdown.spread(c.spread('term_fitness'))}" for c in (condition, *shown)
    )
    straight = condition.evaluate(motions.straight_line(condition))["fitness"]
    told = [f"fitness F: {fitness} · straight line {markdown.number(straight)}"]
    for place, control in enumerate(shown):
        row = rows[control.label]
        which = f"the best control, {control.label}" if place == 0 else control.label
        told.append(
            f"to {which}, evolution adds {markdown.number(-row.median_difference)} to the median: "
            f"its best cost is {kit.evidence(row, 'lower')}"
        )
    if not shown:
        told.append("no control beside it")
    return "; ".join(told), [rows[control.label] for control in shown]
