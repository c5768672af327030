"""Arms reaching into a box of ellipses.

Start postures and solutions (Lavoie & Boudreau 2001, Figs. 1 and 2).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch, Rectangle
from matplotlib.patheffects import withStroke

from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.report import body_contacts, motion_geometry, style
from evoexp.report.results import ConditionResults
from evoexp.report.rows import groups, records, rounded

ELLIPSE, BOX, TARGET, LINK, TOUCHING, CONTACT = (
    "ellipse",
    "box",
    "target",
    "link",
    "touching",
    "contact",
)
NAMES = [
    "element",
    "name",
    "sub_path",
    "instant",
    "link",
    "x",
    "y",
    "x_end",
    "y_end",
    "semi_a",
    "semi_b",
    "angle_deg",
]
MOST_POSTURES = 10  # of a sub-path that are drawn
TARGETS = ("via point", "goal point")
AROUND = 0.35  # [-] of the box by which a view of it is wider than box and targets
MARKERS = {"via point": "P", "goal point": "*"}
NEUTRAL_LINE: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 2.6}


class Shown(NamedTuple):
    """What one panel shows.

    Attributes:
        title: Of the panel.
        condition: Whose scene.
        replicate: Whose solution; None: the start posture only.
        contacts: (instant, bodies) of its first contacts.
    """

    title: str
    condition: ConditionResults
    replicate: int | None = None
    contacts: Sequence[tuple[float, str]] = ()


def reaching_table(shown: Sequence[Shown]) -> pd.DataFrame:
    """Return scenes, postures and contacts.

    Returns:
        Columns panel, title, element, name, sub_path (0: the start posture), instant (of the
        motion: 1 at posture A, 2 at posture B), link, x, y, x_end, y_end (an ellipse: its centre in
        x, y; a box: its corners), semi_a, semi_b, angle_deg, length_unit.
    """
    parts = []
    for panel, one in enumerate(shown):
        rows = [*_scene(one.condition), *_postures(one), *_contacts(one)]
        table = pd.DataFrame(
            [(panel, one.title, *row) for row in rows], columns=["panel", "title", *NAMES]
        )
        parts.append(table.assign(length_unit=one.condition.condition.length_unit))
    return rounded(pd.concat(parts, ignore_index=True))


def draw_reaching(table: pd.DataFrame) -> Figure:
    """Draw every scene with its postures, and below, where anything moves.

    What is around the box.
    """
    panels = [rows for _, rows in groups(table, "panel")]
    ratios = [x / y for x, y in map(_span, panels)]
    moving = bool((table["sub_path"] > 0).any())
    height = min(4.6, 6.1 / sum(ratios))
    figure = style.figure(height + (3.6 if moving else 0.0) + 1.0)
    places = figure.subplots(1 + moving, len(panels), squeeze=False, width_ratios=ratios)
    for k, rows in enumerate(panels):
        for axes in places[:, k]:
            style.operational_axes(axes, rows["length_unit"].iloc[0])
            _draw_scene(axes, rows)
            _draw_postures(
                axes, rows[rows["element"].isin([LINK, TOUCHING])], near=axes is not places[0, k]
            )
            contacts = rows[rows["element"] == CONTACT]
            axes.plot(
                contacts["x"],
                contacts["y"],
                "X",
                color=style.FORBIDDEN,
                mec="white",
                ms=9,
                zorder=9,
            )
        places[0, k].set_title(rows["title"].iloc[0])
        places[0, k].margins(0.06)
        if moving:
            _near_the_box(places[1, k], rows)
    figure.legend(handles=_legend(table), loc="outside lower center", ncols=3)
    return figure


def _scene(condition: ConditionResults) -> list[tuple[Any, ...]]:
    """Return the rows of what stands around."""
    scenario: Any = condition.condition.scenario
    table, nan, rows = scenario.obstacle_table(), np.nan, []
    for k, (center, rotation, size) in enumerate(
        zip(table.center, table.rotation, table.size, strict=True)
    ):
        angle = float(np.degrees(np.arctan2(rotation[3], rotation[0])))
        rows.append(
            (
                ELLIPSE,
                f"obstacle_{k + 1}",
                0,
                nan,
                -1,
                *center[:2],
                *center[:2],
                size[0],
                size[1],
                angle,
            )
        )
    left, right, bottom, top = scenario.box
    rows.append((BOX, "box", 0, nan, -1, left, bottom, right, top, nan, nan, nan))
    for name, point in zip(TARGETS, (scenario.via_point, scenario.goal_point), strict=True):
        rows.append((TARGET, name, 0, nan, -1, *point, *point, nan, nan, nan))
    return rows


def _postures(one: Shown) -> list[tuple[Any, ...]]:
    """Return the links at the start, and at tested positions of both sub-paths."""
    prepared = one.condition.prepared
    instants = np.zeros(1)
    q: FloatArray = np.asarray(prepared.problem.start)[:, None]
    if one.replicate is not None:
        tested = int(one.condition.planner.collision.num_positions)
        steps = np.arange(0, tested, -(-tested // MOST_POSTURES))[1:] / tested
        instants = np.concatenate([[0.0], steps, [1.0], 1.0 + steps, [2.0]])
        motion = prepared.planner.motion(prepared.problem, one.condition.solutions[one.replicate])
        q = np.column_stack([motion.at(float(t)) for t in instants])
    return _links(one, LINK, instants, q)


def _links(one: Shown, element: str, instants: FloatArray, q: FloatArray) -> list[tuple[Any, ...]]:
    """Return the links at some instants, q (nq, instants) [rad]."""
    rows = []
    for _, link, start, end in motion_geometry.joint_positions(
        one.condition.prepared.problem.assembly, q / DEGREE
    ):
        for k, t in enumerate(instants):
            places = *start[k, :2], *end[k, :2]
            rows.append((element, "arm", int(np.ceil(t)), t, link, *places, np.nan, np.nan, np.nan))
    return rows


def _contacts(one: Shown) -> list[tuple[Any, ...]]:
    """Return where bodies touch, and the postures at which they do."""
    rows = []
    for instant, pair in one.contacts:
        assert one.replicate is not None, "only motions touch"
        prepared, solution = one.condition.prepared, one.condition.solutions[one.replicate]
        x, y = body_contacts.contact(prepared, solution, instant, pair)
        rows.append(
            (
                CONTACT,
                pair,
                1 + int(instant >= 1.0),
                instant,
                -1,
                x,
                y,
                x,
                y,
                np.nan,
                np.nan,
                np.nan,
            )
        )
        q = prepared.planner.motion(prepared.problem, solution).at(instant)
        rows += _links(one, TOUCHING, np.array([instant]), q[:, None])
    return rows


def _span(rows: pd.DataFrame) -> tuple[float, float]:
    x, y = (rows[[name, f"{name}_end"]].to_numpy() for name in "xy")
    return float(np.ptp(x)), float(np.ptp(y))


def _draw_scene(axes: Axes, rows: pd.DataFrame) -> None:
    for row in records(rows[rows["element"] == ELLIPSE]):
        axes.add_patch(
            Ellipse(
                (row.x, row.y),
                2 * row.semi_a,
                2 * row.semi_b,
                angle=row.angle_deg,
                facecolor=style.FAINT,
                lw=0,
                zorder=2,
            )
        )
    for row in records(rows[rows["element"] == BOX]):
        look: dict[str, Any] = {
            "fill": False,
            "edgecolor": style.FAINT,
            "linestyle": (0, (3, 2)),
            "linewidth": 0.9,
        }
        axes.add_patch(
            Rectangle((row.x, row.y), row.x_end - row.x, row.y_end - row.y, zorder=1, **look)
        )
    for row in records(rows[rows["element"] == TARGET]):
        size = 8 if row.name == "via point" else 11
        axes.plot(
            row.x, row.y, MARKERS[row.name], color="black", mec="white", mew=0.8, ms=size, zorder=8
        )


def _near_the_box(axes: Axes, rows: pd.DataFrame) -> None:
    """Show what is around box and targets only."""
    shown = rows[rows["element"].isin([BOX, TARGET])]
    limits = []
    for name in "xy":
        values = shown[[name, f"{name}_end"]].to_numpy()
        pad = AROUND * float(np.ptp(values))
        limits.append((float(values.min()) - pad, float(values.max()) + pad))
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])
    axes.set_title("around the box", fontweight="normal")


def _draw_postures(axes: Axes, links: pd.DataFrame, near: bool) -> None:
    """Draw the start in black, each sub-path in a colour of its own, its end strong.

    Names from far only.
    """
    for (element, sub_path, instant), rows in groups(links, ["element", "sub_path", "instant"]):
        x, y = ([*rows[name], rows[f"{name}_end"].iloc[-1]] for name in "xy")
        if element == TOUCHING:
            axes.plot(x, y, color=style.FORBIDDEN, linewidth=1.4, linestyle=(0, (3, 1.5)), zorder=6)
        elif sub_path == 0:
            axes.plot(x, y, **NEUTRAL_LINE, zorder=5)
        else:
            colour, share = _colour(sub_path), instant - (sub_path - 1)
            look: dict[str, Any] = (
                {"linewidth": 2.6, "zorder": 6} if share == 1.0 else {"linewidth": 1.0, "zorder": 3}
            )
            axes.plot(x, y, color=colour, alpha=1.0 if share == 1.0 else 0.15 + 0.5 * share, **look)
            axes.plot(x[-1], y[-1], ".", color=colour, markersize=4, zorder=7)
        if element == LINK and instant == sub_path:
            _draw_joints(axes, x, y, sub_path, named=not near)
    base = links[links["link"] == 0].iloc[0]
    axes.plot(base["x"], base["y"], "s", color=style.NEUTRAL, markersize=7, zorder=4)


def _draw_joints(axes: Axes, x: list[float], y: list[float], sub_path: int, named: bool) -> None:
    """Draw the joints of a posture at the end of a sub-path, and its name."""
    colour = style.NEUTRAL if sub_path == 0 else _colour(sub_path)
    axes.plot(x[:-1], y[:-1], "o", color="white", mec=colour, ms=3.6, mew=0.9, zorder=7)
    if named:
        halo = [withStroke(linewidth=2.0, foreground="white")]
        place: dict[str, Any] = {
            "xytext": (-4, 5),
            "textcoords": "offset points",
            "ha": "right",
            "fontsize": 8,
        }
        name = ("start", "A", "B")[sub_path]
        axes.annotate(name, (x[-1], y[-1]), color=colour, zorder=10, path_effects=halo, **place)


def _colour(sub_path: int) -> str:
    return style.arm_colour(sub_path - 1)


def _legend(table: pd.DataFrame) -> list[Any]:
    handles: list[Any] = [
        Line2D([], [], **NEUTRAL_LINE, marker="o", mfc="white", ms=4, label="start posture")
    ]
    for sub_path in sorted(set(table.loc[table["element"] == LINK, "sub_path"]) - {0}):
        name = f"SP{sub_path}, to posture {'AB'[sub_path - 1]}"
        handles.append(Line2D([], [], color=_colour(sub_path), linewidth=2.6, label=name))
    handles.append(Patch(facecolor=style.FAINT, label="ellipses"))
    handles.append(
        Line2D(
            [],
            [],
            color=style.FAINT,
            linestyle=(0, (3, 2)),
            linewidth=0.9,
            label="inside of the box",
        )
    )
    for name in TARGETS:
        handles.append(
            Line2D(
                [],
                [],
                linestyle="none",
                marker=MARKERS[name],
                color="black",
                mec="white",
                ms=9,
                label=name,
            )
        )
    if (table["element"] == CONTACT).any():
        look: dict[str, Any] = {
            "color": style.FORBIDDEN,
            "linewidth": 1.4,
            "linestyle": (0, (3, 1.5)),
        }
        handles.append(Line2D([], [], label="posture in contact, never tested", **look))
        label = "first contact of a sub-path"
        handles.append(
            Line2D(
                [],
                [],
                linestyle="none",
                marker="X",
                color=style.FORBIDDEN,
                mec="white",
                ms=9,
                label=label,
            )
        )
    return handles
