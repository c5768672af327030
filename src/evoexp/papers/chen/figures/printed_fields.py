"""Chen & Zalzala 1995, Fig. 1: two numerical potential fields, and the slips of their print."""

import difflib
from collections.abc import Callable, Sequence
from importlib import resources
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.records import FloatArray
from evoexp.report.figures import Rows, groups, records, style, table_of
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.judging import Judge

BLOCKED = "*"
WRONG, MISSING, SURPLUS = "wrong", "missing", "surplus"
MARKED_SLIPS = {
    WRONG: "another number is printed (below, small)",
    MISSING: "nothing is printed for the node",
    SURPLUS: "a surplus token is printed here",
}
FRAMES: dict[str, dict[str, Any]] = {
    slip: {"fill": False, "edgecolor": colour, "linewidth": 1.4}
    for slip, colour in ((WRONG, "#CC3311"), (MISSING, "#EE7733"), (SURPLUS, "#0077BB"))
}

NUMBER: dict[str, Any] = {"ha": "center", "va": "center_baseline", "fontsize": 6.0}
SMALL = NUMBER | {"va": "center", "fontsize": 4.2}
PRINT = "chen_fig_1.txt"
NAMES = ("(a) potential toward the goal", "(b) potential of obstacles")
PLACE = "row {0.row} from the top, column {0.column}"
SLIPS = {
    WRONG: PLACE + ": {0.printed} for {0.computed}",
    MISSING: PLACE + ": {0.computed} is left out",
    SURPLUS: PLACE + ": a surplus {0.printed} before it",
}


def printed(name: str) -> list[list[list[str]]]:
    """Return the grids of an asset, each a list of rows of words.

    Empty lines stand between grids; lines that begin with `;` are comments.
    """
    text = resources.files("evoexp").joinpath("assets", name).read_text(encoding="utf-8")
    lines = (line for line in text.splitlines() if not line.startswith(";"))
    blocks = "\n".join(lines).split("\n\n")
    return [[row.split() for row in block.strip().splitlines()] for block in blocks]


def rows_of(values: FloatArray, blocked: np.ndarray, edge: str = BLOCKED) -> list[list[str]]:
    """Return a field (along x, along y) as rows of words from the top, as it would be printed.

    `blocked` nodes are printed as `*`, those with a free node beside them as `edge`.
    """
    free = np.pad(~blocked, 1)
    beside = free[:-2, 1:-1] | free[2:, 1:-1] | free[1:-1, :-2] | free[1:-1, 2:]
    numbers = np.vectorize(lambda v: f"{v:g}")(values)
    words = np.where(blocked, np.where(beside, edge, BLOCKED), numbers)
    return [[str(word) for word in row] for row in words.T[::-1]]


@table_of("field row column computed printed slip")
def compare(name: str, computed: Sequence[Sequence[str]], given: Sequence[Sequence[str]]) -> Rows:
    """Compare a computed grid with a printed one, cell by cell.

    A slip is empty, `wrong`, `missing` (nothing is printed for the cell) or `surplus` (printed
    before the column, and belongs to no cell).
    """
    for row, (own, theirs) in enumerate(zip(computed, given, strict=True)):
        opcodes = difflib.SequenceMatcher(None, theirs, own, autojunk=False).get_opcodes()
        for kind, i1, i2, j1, j2 in opcodes:
            both = min(i2 - i1, j2 - j1)
            slip = "" if kind == "equal" else WRONG
            for k in range(both):
                yield name, row, j1 + k, own[j1 + k], theirs[i1 + k], slip
            yield from ((name, row, j, own[j], "", MISSING) for j in range(j1 + both, j2))
            yield from ((name, row, j2, "", theirs[i], SURPLUS) for i in range(i1 + both, i2))


def draw_fields(table: pd.DataFrame) -> Figure:
    """Draw a grid per field: a shaded square with a number per node, frames around slips."""
    count = table["field"].nunique()
    figure = style.figure(7.2 * 0.5 * 1.12, style.WIDTH * (1.0 if count > 1 else 0.55))
    panels = figure.subplots(1, count, squeeze=False)[0]
    for axes, (name, rows) in zip(panels, groups(table, "field"), strict=True):
        height = int(rows["row"].max()) + 1
        width = int(rows.loc[rows["slip"] != SURPLUS, "column"].max()) + 1
        numbers = pd.to_numeric(rows["computed"], errors="coerce")
        shades = 0.97 - 0.32 * numbers / float(np.nanmax(numbers))
        for cell, shade in zip(records(rows), shades, strict=True):
            x, y = cell.column, height - 1 - cell.row
            if cell.slip:  # a token too many stands between two nodes
                wide, left = (0.24, x - 0.62) if cell.slip == SURPLUS else (0.92, x - 0.46)
                frame = Rectangle((left, y - 0.46), wide, 0.92, zorder=3, **FRAMES[cell.slip])
                axes.add_patch(frame)
            if cell.slip == SURPLUS:
                continue
            blocked = cell.computed == BLOCKED
            face, ink = (style.NEUTRAL, "white") if blocked else (str(shade), "black")
            square = Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=face, edgecolor="white", lw=0.5)
            axes.add_patch(square)
            # the number, lifted where a wrong one stands below
            wrong = cell.slip == WRONG
            axes.text(x, y + 0.12 * wrong, cell.computed, color=ink, **NUMBER)
            if wrong:
                axes.text(x, y - 0.27, cell.printed, color=FRAMES[WRONG]["edgecolor"], **SMALL)
        axes.grid(visible=False)
        axes.set(
            xlim=(-0.5, width - 0.3), ylim=(-0.5, height - 0.5), aspect="equal", title=str(name)
        )
        axes.set(xlabel="x [node]", xticks=range(0, width, 5))
        axes.set(ylabel="y [node]", yticks=range(0, height, 5))
    keys = [
        Rectangle((0, 0), 1, 1, label=text, **FRAMES[slip])
        for slip, text in MARKED_SLIPS.items()
        if (table["slip"] == slip).any()
    ]
    if keys:
        style.keys_below(figure, keys)
    return figure


def draw_maps(table: pd.DataFrame) -> Figure:
    """Draw fields as shaded maps: columns field, x, y, value (NaN where no path can be)."""
    figure, panels = style.panels(3.4, table["field"].nunique())
    for axes, (name, rows) in zip(panels, groups(table, "field"), strict=True):
        wide = rows.pivot_table(index="y", columns="x", values="value", dropna=False)
        image = wide.to_numpy(dtype=np.float64)
        look: dict[str, Any] = {"cmap": "viridis", "interpolation": "nearest", "origin": "lower"}
        bar = figure.colorbar(
            axes.imshow(image, **look), ax=axes, label="potential [–]", shrink=0.75
        )
        for axis in (axes.xaxis, axes.yaxis, bar.ax.yaxis):
            axis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
        axes.grid(visible=False)
        axes.set(title=str(name), xlabel="x [node]", ylabel="y [node]", facecolor=style.NEUTRAL)
    return figure


def _fields(condition: ConditionResults) -> tuple[np.ndarray, np.ndarray]:
    return condition.array("goal_field"), condition.array("unsafeness")


def nodes_table(condition: ConditionResults) -> pd.DataFrame:
    """Return all nodes of both fields beside the printed ones; see `compare`."""
    goal, unsafeness = _fields(condition)
    blocked, edge = np.isnan(goal), f"{condition.planner.collision.obstacle_potentials[0]:g}"
    computed = rows_of(goal, blocked), rows_of(unsafeness, blocked, edge)
    parts = map(compare, NAMES, computed, printed(PRINT))
    return pd.concat(parts, ignore_index=True)


def wave_front(judge: Judge, field: str, nodes: pd.DataFrame) -> Claim:
    """Judge that a field is printed as the wave front computes it."""
    total = int((nodes["slip"] != SURPLUS).sum())
    told = {slip or "same": int((nodes["slip"] == slip).sum()) for slip in ("", *MARKED_SLIPS)}
    hearing = judge.on("wave_front", part=field)
    holds = told["same"] >= hearing.rule.limits["share"] * total
    return hearing.own(told | {"total": total}, f"{total} nodes", holds)


def slips(nodes: pd.DataFrame) -> str:
    """Return the slips of a field in words."""
    found = records(nodes[nodes["slip"] != ""])
    told = "; ".join(
        (SLIPS[row.slip].format(row) + _alike(row, nodes)).replace("*", "\\*") for row in found
    )
    return told or "none"


def _alike(slip: Any, table: pd.DataFrame) -> str:
    """Name the equal neighbours of a number left out: it may be any of them that is missing."""
    if slip.slip != MISSING:
        return ""
    own = table[(table["row"] == slip.row) & (table["slip"] != SURPLUS)]
    words = own.sort_values("column")["computed"].to_list()
    first = last = int(slip.column)
    while first > 0 and words[first - 1] == slip.computed:
        first -= 1
    while last < len(words) - 1 and words[last + 1] == slip.computed:
        last += 1
    return f" (or any equal one of columns {first} to {last})" if first < last else ""


def map_table(condition: ConditionResults) -> pd.DataFrame:
    """Return both fields node by node: columns field, x, y, value (NaN: an obstacle)."""
    goal, unsafeness = _fields(condition)
    x, y = (axis.ravel() for axis in np.indices(goal.shape))
    fields = zip(NAMES, (goal, np.where(np.isnan(goal), np.nan, unsafeness)), strict=True)
    parts = [{"field": name, "x": x, "y": y, "value": values.ravel()} for name, values in fields]
    return pd.concat(map(pd.DataFrame, parts), ignore_index=True)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # the references that hold potential fields, and those of the printed map
    "field_references": lambda results: tuple(
        c for c in results.references if isinstance(c.planner, GridPathGa)
    ),
    "printed_fields": lambda field_references: [
        c for c in field_references if _fields(c)[0].shape == (16, 16)
    ],
    # name and nodes of every field
    "single_fields": lambda printed_fields: [
        (str(name), rows) for c in printed_fields for name, rows in groups(nodes_table(c), "field")
    ],
    # numbers of nodes along both axes, as stems have them
    "map_shape": lambda condition: "_".join(map(str, _fields(condition)[0].shape)),
}
