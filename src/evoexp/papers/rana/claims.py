"""Evidence of the claim that evolution adds to its controls, which two pages judge."""

from collections.abc import Sequence

import numpy as np

from evoexp.papers.rana import motions
from evoexp.report import kit
from evoexp.report.kit import markdown

COST = kit.by_column("best_cost")


def evolution_told(
    condition: kit.ConditionResults,
    controls: Sequence[kit.ConditionResults],
    settings: kit.ReportSettings,
) -> tuple[str, list[kit.Comparison]]:
    """Return the evidence on what evolution adds to each control, and the comparisons of costs.

    The control of the lowest median cost comes first.
    """
    pairs = [(condition, control) for control in controls if control.done]
    rows = {row.quantity: row for row in kit.compared(pairs, COST, settings)}
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
            f"to {which}, evolution adds {markdown.number(-row.median_difference)} in the median "
            f"of pairs: its best cost is {kit.evidence(row, 'lower')}"
        )
    if not shown:
        told.append("no control beside it")
    return "; ".join(told), [rows[control.label] for control in shown]
