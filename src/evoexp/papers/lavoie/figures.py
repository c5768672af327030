"""Figures of Lavoie & Boudreau 2001: motions (Figs. 1, 2), errors below x (Fig. 3), stopping."""

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from evoexp.numeric.elementary import DEGREE
from evoexp.papers import trails
from evoexp.papers.lavoie import measures
from evoexp.papers.lavoie.measures import Percentage
from evoexp.planners.reaching_tasks import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import Rows, groups, marks, records, style, table_of
from evoexp.report.figures.effort_curves import BEFORE, draw_steps
from evoexp.report.pages import markdown
from evoexp.report.results import motion_geometry
from evoexp.report.results.run_measures import median_replicate, num_joints, solved, touches
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import Proportion, spread

ELLIPSE, BOX, TARGET = "ellipse", "box", "target"
LINK, TOUCHING, CONTACT = "link", "touching", "contact"
NO_SIZE = (np.nan,) * 3
MOST_POSTURES = 10  # of a sub-path that are drawn
TARGETS = ("via point", "goal point")
AROUND = 0.3  # [-] of the box by which a view of it is wider than box and targets
MARKERS = {"via point": "P", "goal point": "*"}
INSIDE: dict[str, Any] = {"linestyle": (0, (3, 2)), "linewidth": 0.9}
TOUCH: dict[str, Any] = {"linewidth": 1.4, "linestyle": (0, (3, 1.5))}
# names of the start and of both ends, and where they stand beside the tip: off its markers [pt]
PLACES: tuple[tuple[str, tuple[int, int], Literal["left", "right"]], ...] = (
    ("start", (-4, 5), "right"),
    ("A", (-3, -12), "right"),
    ("B", (8, 5), "left"),
)
FOUND, PRINTED = "found", "printed"
ERROR, EFFORT = "position error", "evaluations"
BESIDE = 0.012  # [-] of the axis by which series are set apart


class ShownMotion(NamedTuple):
    """The scene of one panel, and the motion in it."""

    title: str  # title of the panel
    condition: ConditionResults  # the condition whose scene is drawn
    # the replicate whose solution is drawn; None: the start posture only
    replicate: int | None = None
    # (instant, bodies) of the first contact on each sub-path that has one
    contacts: Sequence[tuple[float, str]] = ()


def _shown(condition: ConditionResults, among: np.ndarray) -> ShownMotion:
    """Return the run of median error among some, (done,), as it is drawn."""
    errors = measures.errors(condition)
    replicate = median_replicate(condition, errors, among)
    verdict = motion_geometry.refuted(condition).get(replicate)
    contacts = measures.contacts(condition, replicate, verdict) if verdict else []
    error = float(errors[condition.summaries.index.get_loc(replicate)])
    title = f"{condition.label}: run {replicate}, error {markdown.number(error)}"
    return ShownMotion(title, condition, replicate, contacts)


@table_of(
    "panel title element name sub_path instant link x y x_end y_end semi_a semi_b angle_deg "
    "length_unit",
    is_rounded=True,
)
def reaching_table(shown: Sequence[ShownMotion]) -> Rows:
    """Return scenes, postures and contacts."""
    for panel, one in enumerate(shown):
        scenario, unit = one.condition.scenario, one.condition.length_unit
        table = scenario.obstacle_table()
        angles = np.degrees(np.arctan2(table.rotation[:, 3], table.rotation[:, 0]))
        ellipses = zip(table.center[:, :2], table.size[:, :2], angles, strict=True)
        targets = zip(TARGETS, (scenario.via_point, scenario.goal_point), strict=True)
        left, right, bottom, top = scenario.box
        scene: list[tuple[Any, ...]] = [
            *(
                (ELLIPSE, f"obstacle_{k}", *center, *center, *size, float(angle))
                for k, (center, size, angle) in enumerate(ellipses, 1)
            ),
            (BOX, "box", left, bottom, right, top, *NO_SIZE),
            *((TARGET, name, *point, *point, *NO_SIZE) for name, point in targets),
        ]
        rows = [(element, name, 0, np.nan, -1, *rest) for element, name, *rest in scene]
        yield from ((panel, one.title, *row, unit) for row in (*rows, *_postures(one)))


def draw_reaching(table: pd.DataFrame) -> Figure:
    """Draw every scene with its postures, and below each motion a close view of its box."""
    panels = [rows for _, rows in groups(table, "panel")]
    sizes = [np.subtract(*reversed(trails.room(rows))) for rows in panels]
    ratios = [wide / high for wide, high in sizes]
    moving = bool((table["sub_path"] > 0).any())
    height = min(4.6, 6.1 / sum(ratios))
    figure = style.figure(height + (3.6 if moving else 0.0) + 1.0)
    places = figure.subplots(1 + moving, len(panels), squeeze=False, width_ratios=ratios)
    for views, rows in zip(places.T, panels, strict=True):
        for axes in views:
            style.operational_axes(axes, rows["length_unit"].iloc[0])
            _draw_scene(axes, rows)
            _draw_postures(axes, rows)
        shown = rows[rows["element"].isin([BOX, TARGET])]
        limits = trails.room(rows), trails.room(shown, share=AROUND)
        titles = rows["title"].iloc[0], "around the box"
        for axes, title, (low, high) in zip(views, titles, limits, strict=False):
            axes.set(title=title, xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    style.legend_below(figure, places.flat, 3)
    return figure


def _postures(one: ShownMotion) -> Rows:
    """Yield the links at the start, at tested positions of both sub-paths, and where they touch."""
    c = one.condition
    if one.replicate is None:
        yield from _links(one, LINK, np.zeros(1), c.problem(Problem).start[:, None])
        return
    tested = int(c.planner.collision.num_positions)
    steps = np.arange(0, tested, -(-tested // MOST_POSTURES))[1:] / tested
    instants = np.concatenate([[0.0], steps, [1.0], 1.0 + steps, [2.0]])
    motion, solution = c.motion(one.replicate), c.solutions[one.replicate]
    yield from _links(one, LINK, instants, np.column_stack([motion.at(float(t)) for t in instants]))
    for instant, pair in one.contacts:
        place = motion_geometry.contact(c.prepared, solution, instant, pair)
        yield (CONTACT, pair, 1 + int(instant >= 1.0), instant, -1, *place, *place, *NO_SIZE)
        yield from _links(one, TOUCHING, np.array([instant]), motion.at(instant)[:, None])


def _links(one: ShownMotion, element: str, instants: FloatArray, q: FloatArray) -> Rows:
    """Yield the links at some instants, q (nq, instants) [rad]."""
    assembly = one.condition.problem(Problem).assembly
    for _, link, start, end in motion_geometry.joint_positions(assembly, q / DEGREE):
        for k, t in enumerate(instants):
            ends = *start[k, :2], *end[k, :2]
            yield element, "arm", int(np.ceil(t)), t, link, *ends, *NO_SIZE


def _draw_scene(axes: Axes, rows: pd.DataFrame) -> None:
    for row in records(rows[rows["element"] == ELLIPSE]):
        size = 2 * row.semi_a, 2 * row.semi_b
        look: dict[str, Any] = {"facecolor": style.FAINT, "lw": 0, "zorder": 2, "label": "ellipses"}
        axes.add_patch(Ellipse((row.x, row.y), *size, angle=row.angle_deg, **look))
    for row in records(rows[rows["element"] == BOX]):
        x = [row.x, row.x_end, row.x_end, row.x, row.x]
        y = [row.y, row.y, row.y_end, row.y_end, row.y]
        axes.plot(x, y, color=style.FAINT, label="inside of the box", zorder=1, **INSIDE)
    for row in records(rows[rows["element"] == TARGET]):
        point: dict[str, Any] = {"color": "black", "mec": "white", "mew": 0.8, "zorder": 8}
        axes.plot(row.x, row.y, MARKERS[row.name], ms=10, label=row.name, **point)


def _draw_postures(axes: Axes, rows: pd.DataFrame) -> None:
    links, touching, contacts = (
        rows[rows["element"] == element] for element in (LINK, TOUCHING, CONTACT)
    )
    for sub_path, own in groups(links, "sub_path"):
        end, colour = own[own["instant"] == own["instant"].max()], style.NEUTRAL
        name, place, side = PLACES[sub_path]
        if sub_path == 0:
            trails.draw_chain(axes, end, colour, label="start posture")
            trails.draw_base(axes, end)
        else:
            colour = style.arm_colour(sub_path - 1)
            trails.draw_trail(axes, own, colour, label=f"SP{sub_path}, to posture {name}")
        look: dict[str, Any] = {"ha": side, "zorder": 10, "color": colour}
        tip = end[["x_end", "y_end"]].iloc[-1]
        marks.write(axes, name, tip, place, path_effects=marks.HALO, **look)
    for _, posture in groups(touching, "instant"):
        label = "posture in contact, never tested"
        trails.draw_chain(axes, posture, style.FORBIDDEN, joints=False, label=label, **TOUCH)
    if len(contacts):
        cross: dict[str, Any] = {"linestyle": "none", "label": "first contact of a sub-path"}
        marks.contact(axes, contacts["x"], contacts["y"], 9, zorder=9, **cross)


@table_of("series position condition error having total share lower upper length_unit")
def distribution_table(
    results: Results,
    errors: Values,
    printed: Callable[[ConditionResults], Sequence[Percentage]],
    confidence: float,
) -> Rows:
    """Return P(error < x) of every condition at each error that occurs, and the printed points."""
    unit = results.with_data[0].length_unit
    for c in results.with_data:
        values = errors(c)
        steps, counts = np.unique(values[np.isfinite(values)], return_counts=True)
        totals = zip([0.0, *steps], [0, *np.cumsum(counts)], strict=True)
        points = [(FOUND, x, Proportion(int(count), len(values))) for x, count in totals]
        points += [(PRINTED, one.bound, one.proportion) for one in printed(c)]
        for series, x, share in points:
            given = series, results.position(c.label), c.label, x
            yield *given, *share, share.share, *share.interval(confidence), unit


def draw_distribution(table: pd.DataFrame) -> Figure:
    """Draw steps with bands: over the whole range, and where the printed points are."""
    figure, (whole, close) = style.panels(3.9, 2)
    printed, found = (table[table["series"] == series] for series in (PRINTED, FOUND))
    greatest = max(2.1, 1.05 * float(table["error"].max()))
    for axes in (whole, close):
        for (position, condition), rows in groups(found, ["position", "condition"]):
            colour = style.condition_colour(int(position))
            rows = pd.concat([rows, rows.iloc[[-1]].assign(error=greatest)], ignore_index=True)
            x, label = rows["error"], f"{condition} (n = {int(rows['total'].iloc[0])})"
            marks.band(axes, x, rows["lower"], rows["upper"], colour, alpha=0.22, step="post")
            axes.step(x, rows["share"], where="post", color=colour, label=label)
        # the printed points with the intervals of the paper's own sample
        for (position, condition), rows in groups(printed, ["position", "condition"]):
            colour, x = style.condition_colour(int(position)), rows["error"]
            name = f"printed, {condition} (their n = {int(rows['total'].iloc[0])})"
            axes.vlines(x, rows["lower"], rows["upper"], color=colour, linewidth=1.0, zorder=4)
            marks.hollow(axes, x, rows["share"], "D", colour, 5, label=name, mew=1.4, zorder=5)
        axes.set(xlim=(0.0, greatest), ylabel="P(position error < x)")
        axes.set_xlabel(f"x [{table['length_unit'].iloc[0]}]")
    whole.set(ylim=(-0.02, 1.03), title="a  whole range")
    low = min([0.93, *printed["lower"]])
    near = low - 0.1 * (1.0 - low), 1.0 + 0.1 * (1.0 - low)
    close.set(ylim=near, title="b  where the printed percentages are")
    for row in records(printed):  # to the left of points on the right
        side, offset = ("right", -6) if row.error > 0.7 * greatest else ("left", 7)
        words: dict[str, Any] = {"color": style.condition_colour(row.position), "fontsize": 7.5}
        words |= {"ha": side, "path_effects": marks.HALO, "zorder": 6}
        place = offset, 4 if row.position else -10
        marks.write(close, f"{100 * row.share:.1f} %", (row.error, row.share), place, **words)
    style.legend_below(figure, [whole], 2)
    return figure


@table_of("quantity num_generations stop_cost condition median lower upper solved done length_unit")
def stopping_table(results: Results, errors: Values, effort: Values) -> Rows:
    """Return precision and effort of every condition by its stopping value and its generations."""
    unit = results.with_data[0].length_unit
    for name, values in ((ERROR, errors), (EFFORT, effort)):
        for c in results.with_data:
            given = name, c.planner.ga.num_generations, c.planner.stop_cost_sp2, c.label
            yield *given, *spread(values(c))[:3], c.solved, c.done, unit


def draw_stopping(table: pd.DataFrame) -> Figure:
    """Draw medians with quartiles of error and effort, one series per limit of generations."""
    figure, panels = style.panels(3.2, 2)
    count = table["num_generations"].nunique()
    apart = BESIDE * float(np.ptp(table["stop_cost"]) or 1.0)
    labels = {
        ERROR: ("a  precision", f"position error [{table['length_unit'].iloc[0]}]"),
        EFFORT: ("b  effort", "evaluations to a solution [-]"),
    }
    for axes, (quantity, (title, label)) in zip(panels, labels.items(), strict=True):
        own = table[table["quantity"] == quantity].replace(np.inf, np.nan)
        for k, (generations, rows) in enumerate(groups(own, "num_generations")):
            rows = rows.sort_values("stop_cost")
            x = rows["stop_cost"] + apart * (2 * k - count + 1)
            solved, done = rows[["solved", "done"]].sum()
            name = f"at most {generations} generations ({solved} of {done} runs with a solution)"
            colour, without_end = style.condition_colour(k), rows["upper"].isna()
            axes.vlines(x, rows["lower"], rows["upper"], color=colour, linewidth=1.2)
            axes.plot(x[without_end], rows["lower"][without_end], "^", color=colour, ms=6)
            axes.plot(x, rows["median"], "o-", label=name, color=colour, ms=4.5, lw=1.0)
        axes.set(ylim=(0.0, None), ylabel=label, title=title)
        axes.set_xlabel("stopping value of SP2 (objective) [-]")
        axes.set_xticks(sorted(table["stop_cost"].unique()))
        axes.invert_xaxis()
        style.shorten_thousands(axes.yaxis)
    style.legend_below(figure, [panels[0]], 2)
    return figure


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # its solved run of median error among those that touch an obstacle
    "refuted_solutions": lambda conditions: [
        _shown(c, rows) for c in conditions for rows in (solved(c) & touches(c),) if rows.any()
    ],
    # the start posture of every condition, and its solved run of median error
    "starts": lambda conditions: [ShownMotion(c.label, c) for c in conditions],
    "solutions": lambda conditions: [_shown(c, solved(c)) for c in conditions if solved(c).any()],
}


@table_of("joints planner evaluations share runs")
def anytime_table(results: Results, effort: Values) -> Rows:
    """Return the share of runs that have a solution after so many evaluations, per condition."""
    conditions = [c for c in results.evolved if c.done]
    begin = BEFORE * min(float(effort(c).min()) for c in conditions)
    for c in conditions:
        efforts = np.sort(effort(c)[np.isfinite(effort(c))])
        steps = [(begin, 0), *((x, n + 1) for n, x in enumerate(efforts))]
        steps.append((float(c.column("evaluations").max()), len(efforts)))
        yield from ((num_joints(c), c.label, x, n / c.done, c.done) for x, n in steps)


def draw_anytime(table: pd.DataFrame) -> Figure:
    """Draw the shares as steps, in a panel per arm; labels begin with the arm's name."""
    arms = list(groups(table, "joints"))
    figure, panels = style.panels(3.6, len(arms))
    for axes, (joints, rows) in zip(panels, arms, strict=True):
        labels = list(rows["planner"].unique())
        names = {label: label.partition(", ")[2] or "as printed" for label in labels}
        draw_steps(axes, rows, "evaluations", "share", labels, names if len(arms) > 1 else {})
        axes.set(xlabel="evaluations", ylim=(0.0, 1.02))
        axes.set_title(f"{joints} joints")
    panels[0].set_ylabel("share of runs with a solution")
    style.legend_below(figure, panels, 4)
    return figure
