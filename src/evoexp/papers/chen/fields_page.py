"""Chen & Zalzala 1995, Fig. 1: two numerical potential fields, and the slips of their print."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from evoexp.papers.chen.figures import field_grids
from evoexp.papers.chen.rules import PAPER, RULES
from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.report import kit
from evoexp.report.kit import generic, judging

PRINT = "chen_fig_1.txt"
NAMES = ("(a) potential toward the goal", "(b) potential of obstacles")
PLACE = "row {0.row} from the top, column {0.column}"
SLIPS = {
    field_grids.WRONG: PLACE + ": {0.printed} for {0.computed}",
    field_grids.MISSING: PLACE + ": {0.computed} is left out",
    field_grids.SURPLUS: PLACE + ": a {0.printed} too many before it",
}


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the potential fields, or the generic page if there are none."""
    shown = [c for c in results.references if isinstance(c.planner, GridPathGa)]
    if not shown:
        return generic.page(results, settings)
    tables = {c.label: _compared(c) for c in shown if _fields(c)[0].shape == (16, 16)}
    judge, compared = judging.judge(results, settings, RULES), tables.values()
    numbers = (_numbers(c, tables[c.label]) for c in shown if c.label in tables)
    return PAPER.page(
        results,
        "fields",
        claims=tuple(
            _claim(judge, *own) for table in compared for own in kit.groups(table, "field")
        ),
        checks=tuple(_slips(*own) for table in compared for own in kit.groups(table, "field")),
        drawings=(*numbers, *map(_map, shown)),
    )


def _fields(condition: kit.ConditionResults) -> tuple[np.ndarray, np.ndarray]:
    return condition.array("goal_field"), condition.array("unsafeness")


def _compared(condition: kit.ConditionResults) -> pd.DataFrame:
    """Return all nodes of both fields beside the printed ones; see `field_grids.compare`."""
    goal, unsafeness = _fields(condition)
    blocked, edge = np.isnan(goal), f"{condition.planner.collision.obstacle_potentials[0]:g}"
    computed = field_grids.rows_of(goal, blocked), field_grids.rows_of(unsafeness, blocked, edge)
    parts = map(field_grids.compare, NAMES, computed, field_grids.printed(PRINT))
    return pd.concat(parts, ignore_index=True)


def _claim(judge: kit.Judge, name: str, table: pd.DataFrame) -> kit.Claim:
    """Judge that a field is printed as the wave front computes it."""
    total = int((table["slip"] != field_grids.SURPLUS).sum())
    same, wrong, missing, surplus = (
        int((table["slip"] == slip).sum())
        for slip in ("", field_grids.WRONG, field_grids.MISSING, field_grids.SURPLUS)
    )
    evidence = (
        f"{same} of {total} nodes as printed; {wrong} with another number, {missing} left out, "
        f"{surplus} tokens too many"
    )
    hearing = judge.on("wave_front", part=name)
    return hearing.own(evidence, f"{total} nodes", same >= hearing.rule.limits["share"] * total)


def _slips(name: str, table: pd.DataFrame) -> tuple[str, str]:
    """Return the row of checks on a field: its slips in words."""
    slips = kit.records(table[table["slip"] != ""])
    told = "; ".join(
        (SLIPS[row.slip].format(row) + _alike(row, table)).replace("*", "\\*") for row in slips
    )
    return f"Slips of the print, Fig. 1{name} (counted from 0)", told or "none"


def _alike(slip: Any, table: pd.DataFrame) -> str:
    """Name the equal neighbours of a number left out: it may be any of them that is missing."""
    if slip.slip != field_grids.MISSING:
        return ""
    own = table[(table["row"] == slip.row) & (table["slip"] != field_grids.SURPLUS)]
    words = own.sort_values("column")["computed"].to_list()
    first = last = int(slip.column)
    while first > 0 and words[first - 1] == slip.computed:
        first -= 1
    while last < len(words) - 1 and words[last + 1] == slip.computed:
        last += 1
    return f" (or any equal one of columns {first} to {last})" if first < last else ""


def _numbers(condition: kit.ConditionResults, table: pd.DataFrame) -> kit.Drawing:
    return PAPER.drawing(
        "fig_1_fields", partial(_compared_table, table), field_grids.draw_fields, (condition,)
    )


def _compared_table(table: pd.DataFrame) -> pd.DataFrame:
    """Return the compared fields: columns as of `field_grids.compare`."""
    return table


def _map(condition: kit.ConditionResults) -> kit.Drawing:
    return PAPER.drawing(
        "fields_map",
        partial(_map_table, condition),
        field_grids.draw_maps,
        (condition,),
        shape="_".join(map(str, _fields(condition)[0].shape)),
        label=condition.label,
    )


def _map_table(condition: kit.ConditionResults) -> pd.DataFrame:
    """Return both fields node by node: columns field, x, y, value (NaN: an obstacle)."""
    goal, unsafeness = _fields(condition)
    x, y = (axis.ravel() for axis in np.indices(goal.shape))
    fields = zip(NAMES, (goal, np.where(np.isnan(goal), np.nan, unsafeness)), strict=True)
    parts = [{"field": name, "x": x, "y": y, "value": values.ravel()} for name, values in fields]
    return pd.concat(map(pd.DataFrame, parts), ignore_index=True)
