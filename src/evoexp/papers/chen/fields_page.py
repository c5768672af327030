"""Chen & Zalzala 1995, Fig. 1.

Two numerical potential fields, every node's number, and the slips of the print.
"""

from functools import partial

import numpy as np
import pandas as pd

from evoexp.papers.chen.figures import field_grids
from evoexp.papers.chen.printed_grids import MISSING, SURPLUS, WRONG, compare, printed, rows_of
from evoexp.report import claims
from evoexp.report.claims import Claim
from evoexp.report.judging import claim, not_judged
from evoexp.report.page import Drawing, Page
from evoexp.report.pages import generic
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

PRINT = "chen_fig_1.txt"
NAMES = ("(a) potential toward the goal", "(b) potential of obstacles")
INTRODUCTION = (
    "Wave fronts over a grid (section 2.1): from the goal, whose potential is 0, and from "
    "obstacles and the boundary, which is a ring of nodes outside the grid. The potential of "
    "obstacles is what the paper calls the unsafeness of a node. Obstacles of Fig. 1 are taken "
    "from both printed grids together; all other numbers are computed."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; the generic one where nothing has potential fields."""
    shown = [
        c
        for c in results.with_data
        if c.is_reference and hasattr(c.planner.collision, "goal_potentials")
    ]
    if not shown:
        return generic.page(results, settings)
    of_print = [c for c in shown if _fields(c)[0].shape == (16, 16)]
    tables = {c.label: _compared(c) for c in of_print}
    return Page(
        title=f"Chen & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        claims=tuple(one for table in tables.values() for one in _claims(results, table)),
        checks=tuple(row for table in tables.values() for row in _slips(table)),
        drawings=(*(_numbers(c, tables[c.label]) for c in of_print), *(_map(c) for c in shown)),
    )


def _fields(condition: ConditionResults) -> tuple[np.ndarray, np.ndarray]:
    return condition.array("goal_field"), condition.array("unsafeness")


def _compared(condition: ConditionResults) -> pd.DataFrame:
    """Return all nodes of both fields beside the printed ones."""
    goal, unsafeness = _fields(condition)
    blocked, edge = np.isnan(goal), f"{condition.planner.collision.obstacle_potentials[0]:g}"
    computed = rows_of(goal, blocked), rows_of(unsafeness, blocked, edge)
    given = printed(PRINT)
    return pd.concat(
        [
            compare(name, *both)
            for name, both in zip(NAMES, zip(computed, given, strict=True), strict=True)
        ],
        ignore_index=True,
    )


def _claims(results: Results, table: pd.DataFrame) -> list[Claim]:
    why, found = not_judged(results), []
    for name, of in zip(NAMES, (table[table["field"] == n] for n in NAMES), strict=True):
        cells = of[of["slip"] != SURPLUS]
        same = int((cells["slip"] == "").sum())
        told = (
            f"{same} of {len(cells)} nodes as printed; {_count(of, WRONG)} with another number, "
            f"{_count(of, MISSING)} left out, {_count(of, SURPLUS)} tokens too many (reproduced: "
            "every node that is printed, but for single slips of the print: at most one in a "
            "hundred)"
        )
        verdict = claims.REPRODUCED if same >= 0.99 * len(cells) else claims.CONTRADICTED
        found.append(
            claim(
                f"The wave front gives Fig. 1{name}",
                "Fig. 1",
                told,
                claims.NOT_JUDGED if why else verdict,
                why,
            )
        )
    return found


def _count(table: pd.DataFrame, slip: str) -> int:
    return int((table["slip"] == slip).sum())


def _slips(table: pd.DataFrame) -> list[tuple[str, str]]:
    rows = []
    for name in NAMES:
        own = table[(table["field"] == name) & (table["slip"] != "")]
        texts = []
        for row, column, computed, given, slip in own[
            ["row", "column", "computed", "printed", "slip"]
        ].itertuples(index=False):
            place = f"row {row} from the top, column {column}"
            texts.append(
                {
                    WRONG: f"{place}: {given} for {computed}",
                    MISSING: f"{place}: {computed} is left out",
                    SURPLUS: f"{place}: a {given} too many before it",
                }[slip]
            )
        rows.append(
            (
                f"Slips of the print, Fig. 1{name} (counted from 0)",
                "; ".join(texts).replace("*", "\\*") or "none",
            )
        )
    return rows


def _numbers(condition: ConditionResults, table: pd.DataFrame) -> Drawing:
    return Drawing(
        "fig_1_fields",
        "Fig. 1: two numerical potential fields",
        "Number of every node as the wave fronts give it; black: obstacles (in (b) those with a "
        "free node beside them have o₀ = 10, as printed). Framed: where the print differs.",
        lambda: table,
        field_grids.draw_fields,
        (condition,),
    )


def _map(condition: ConditionResults) -> Drawing:
    return Drawing(
        f"fields_{'_'.join(map(str, _fields(condition)[0].shape))}",
        f"{condition.label}: the fields as maps",
        "Dark grey: obstacles. The potential of the goal is not followed downhill: it weighs "
        "draws of random walks.",
        partial(_map_table, condition),
        field_grids.draw_maps,
        (condition,),
    )


def _map_table(condition: ConditionResults) -> pd.DataFrame:
    goal, unsafeness = _fields(condition)
    x, y = np.indices(goal.shape)
    closed = np.where(np.isnan(goal), np.nan, unsafeness)
    parts = [
        pd.DataFrame({"field": name, "x": x.ravel(), "y": y.ravel(), "value": values.ravel()})
        for name, values in zip(NAMES, (goal, closed), strict=True)
    ]
    return pd.concat(parts, ignore_index=True)
