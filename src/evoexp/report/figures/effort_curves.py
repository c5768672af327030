"""Planners compared: shares of targets, best lengths, performance profiles, mean ranks.

Runs of one problem are no independent evidence that a planner is good elsewhere, so for profiles
(Dolan and Moré 2002) and mean ranks (Demšar 2006) each problem gives a planner one number only.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from evoexp.records import FloatArray
from evoexp.report.figures import Parts, Rows, groups, marks, style, table_of
from evoexp.report.figures.marks import name_curves
from evoexp.report.results.planner_runs import PlannerRuns
from evoexp.report.statistics.inference import expected_effort, quantile, quantiles

POINTS = 200  # along the axis of effort
MAX_PANELS = 24  # problems that have a panel of their own
BEFORE = 0.8  # times the effort of the first proven answer is where curves begin
PER_LINE = 3  # panels side by side

END = 1.15  # times the largest finite ratio is where a performance profile ends
LINE = 0.24  # [inch] between names of planners
BAR = 0.09  # [inch] between bars that join planners
ABOVE = 0.62  # [inch] of the bar of the critical difference and the axis' numbers

NOTE: dict[str, Any] = {"ha": "center", "va": "center", "color": style.NEUTRAL, "fontsize": 7.5}


@table_of("planner collision_queries share targets")
def share_table(runs: Sequence[PlannerRuns], axis: FloatArray | None = None) -> Rows:
    """Return the share of (problem, target, run) that each planner has reached, over effort."""
    reached: dict[str, list[float]] = {}
    for own in runs:
        for longest in own.problem.targets:
            reached.setdefault(own.planner, []).extend(own.efforts(longest).tolist())
    axis = _axis(runs) if axis is None else axis
    for planner, efforts in reached.items():
        shares = [float(np.mean(np.array(efforts) <= x)) for x in axis]
        yield planner, axis, shares, len(efforts)


def _axis(runs: Sequence[PlannerRuns]) -> FloatArray:
    """Return efforts from a little before the first proven answer of all to the longest run."""
    first = [own.efforts().min() for own in runs]
    most = max(1.0, *(float(own.spent.max()) for own in runs))
    least = min([value for value in first if 0.0 < value < np.inf], default=most / 10.0)
    return np.geomspace(BEFORE * least, most, POINTS)


@table_of()
def problem_share_table(runs: Sequence[PlannerRuns]) -> Parts:
    """Return the share of (target, run) that each planner has reached, problem by problem."""
    axis = _axis(runs)
    for name in problem_order(runs):
        table = share_table([own for own in runs if own.problem.name == name], axis)
        yield {"problem": name, **table}


@table_of("planner collision_queries median lower upper")
def length_table(runs: Sequence[PlannerRuns]) -> Rows:
    """Return median and quartiles over runs of the best proven length so far, of one problem."""
    for own in runs:
        table, most = own.table, max(float(own.spent.max()), 2.0)
        least = float(table["collision_queries"].min()) if len(table) else 0.5 * most
        axis = np.geomspace(max(least, 1.0), most, POINTS // 2)
        early = (table[table["collision_queries"] <= x] for x in axis)
        best = np.array([own._replace(table=part).best_lengths for part in early])  # (points, runs)
        yield own.planner, axis, *quantiles(best, (0.5, 0.25, 0.75))


def problem_order(runs: Iterable[PlannerRuns]) -> list[str]:
    """Return the names of the problems, each once, in order."""
    return list(dict.fromkeys(own.problem.name for own in runs))


def draw_shares(table: pd.DataFrame) -> Figure:
    """Draw the shares of targets reached."""
    figure, (axes,) = style.panels(3.6)
    _draw_share_curves(axes, table, list(table["planner"].unique()))
    axes.set(xlabel="collision queries", ylabel="share of targets")
    name_curves(figure, axes, 4)
    return figure


def draw_shares_by_problem(table: pd.DataFrame) -> Figure:
    """Draw the shares of targets reached in one panel per problem."""
    planners = list(table["planner"].unique())
    shown = list(groups(table, "problem", in_order=False))[:MAX_PANELS]
    figure, panels = style.panels(1.9, len(shown), PER_LINE, 0.4)
    for axes, (problem, own) in zip(panels, shown, strict=True):
        _draw_share_curves(axes, own, planners)
        axes.set_title(style.shortened(problem, 34), fontweight="normal")
        if not (own["share"].astype(float) > 0.0).any():
            axes.text(0.5, 0.5, "no proven answer", transform=axes.transAxes, **NOTE)
        axes.tick_params(labelleft=style.begins_line(axes))
        axes.set_ylabel("share reached" if style.begins_line(axes) else "")
        axes.set_xlabel("collision queries")
    style.legend_below(figure, panels, 4)
    return figure


def _draw_share_curves(axes: Axes, table: pd.DataFrame, planners: Sequence[str]) -> None:
    """Draw the curves; the name of one that was run on fewer problems tells on how many targets."""
    most = int(table["targets"].max())
    counts = table.groupby("planner")["targets"].first()
    names = {name: f"{name} ({n} of {most})" for name, n in counts.items() if n < most}
    draw_steps(axes, table, "collision_queries", "share", planners, names)
    axes.set(ylim=(0.0, 1.02))


def draw_lengths(table: pd.DataFrame) -> Figure:
    """Draw the best proven length so far of one problem."""
    figure, (axes,) = style.panels(3.6)
    table, planners = table.replace([np.inf], np.nan), list(table["planner"].unique())
    for k, (_, band) in enumerate(groups(table, "planner", in_order=False)):
        x, low, high = (band[name] for name in ("collision_queries", "lower", "upper"))
        marks.band(axes, x, low, high, style.curve_look(k)["color"], step="post")
    draw_steps(axes, table, "collision_queries", "median", planners)
    axes.set(xlabel="collision queries", ylabel="best proven length so far [rad, m]")
    name_curves(figure, axes, 4)
    return figure


def draw_steps(
    axes: Axes,
    table: pd.DataFrame,
    across: str,
    up: str,
    planners: Sequence[str],
    names: Mapping[Any, str] | None = None,
) -> None:
    """Draw a curve over a logarithmic axis for each planner that a table has."""
    for k, planner in enumerate(planners):
        curve = table[table["planner"] == planner]
        if len(curve):
            x, y = curve[across].astype(float), curve[up].astype(float)
            label = (names or {}).get(planner, planner)
            axes.step(x, y, where="post", label=label, **style.curve_look(k))
    first, last = float(table[across].min()), float(table[across].max())
    style.log_axis(axes, first, max(last, 1.01 * first))


MIN_PLANNERS = 3  # of a critical-difference diagram: two are compared by a test of pairs
MIN_PROBLEMS = 5  # of it: with fewer, Friedman's test can hardly reject anything


class Friedman(NamedTuple):
    """Friedman's test whether some planner ranks differently from the others."""

    statistic: float  # χ², corrected for ties
    p_value: float  # of the χ² distribution


class Standing(NamedTuple):
    """How planners stand on the problems that all of them were run on."""

    planners: tuple[str, ...]  # their names
    problems: tuple[str, ...]  # names of the problems
    left_out: tuple[str, ...]  # problems that some of these planners was not run on
    # Planners run on less than half of the problems that two planners were run on
    outsiders: tuple[str, ...]
    # Expected running time to a proven answer, (problems, planners) [collision queries]
    efforts: FloatArray
    # Median of the best proven lengths, (problems, planners); inf: half have none
    lengths: FloatArray

    @property
    def can_be_profiled(self) -> bool:
        """Whether there are planners and problems enough for a performance profile."""
        return len(self.planners) > 1 and len(self.problems) > 1

    @property
    def can_be_tested(self) -> bool:
        """Whether there are planners and problems enough for a critical-difference diagram."""
        return len(self.planners) >= MIN_PLANNERS and len(self.problems) >= MIN_PROBLEMS

    @property
    def mean_ranks(self) -> FloatArray:
        """Mean over problems of ranks by median length, (planners,); 1 is best, ties averaged."""
        return np.asarray(stats.rankdata(self.lengths, axis=1).mean(axis=0))


def standing(runs: Sequence[PlannerRuns]) -> Standing:
    """Return how planners stand, each problem counted once."""
    every = tuple(dict.fromkeys(own.planner for own in runs))
    problems = problem_order(runs)
    cells: dict[tuple[str, str], list[PlannerRuns]] = {}
    for own in runs:
        cells.setdefault((own.problem.name, own.planner), []).append(own)
    contested = [name for name in problems if sum((name, each) in cells for each in every) > 1]
    planners = tuple(
        each
        for each in every
        if 2 * sum((name, each) in cells for name in contested) >= len(contested)
    )
    common = tuple(name for name in problems if all((name, each) in cells for each in planners))

    def matrix(value: Callable[[Sequence[PlannerRuns]], float]) -> FloatArray:
        rows = [[value(cells[name, each]) for each in planners] for name in common]
        return np.array(rows, dtype=np.float64).reshape(len(common), len(planners))

    def effort(same: Sequence[PlannerRuns]) -> float:
        spent, reached = zip(*(own.first_reached() for own in same), strict=True)
        return expected_effort(np.concatenate(spent), np.concatenate(reached))

    def length(same: Sequence[PlannerRuns]) -> float:
        return quantile(np.concatenate([own.best_lengths for own in same]), 0.5)

    left_out = tuple(name for name in problems if name not in common)
    outsiders = tuple(each for each in every if each not in planners)
    return Standing(planners, common, left_out, outsiders, matrix(effort), matrix(length))


def effort_ratios(efforts: FloatArray) -> FloatArray:
    """Return each effort (problems, planners) over its problem's least (Dolan and Moré, Eq. 2.1).

    Never solved are infinite ones, also where no planner solves the problem.
    """
    best = efforts.min(axis=1, keepdims=True)
    ratios = np.full(efforts.shape, np.inf)
    np.divide(efforts, best, out=ratios, where=np.isfinite(efforts) & (best > 0.0))
    return np.where(efforts == best, np.where(np.isfinite(best), 1.0, np.inf), ratios)


def friedman(lengths: FloatArray) -> Friedman:
    """Test whether three planners or more rank alike (Friedman 1937), (problems, planners)."""
    if (lengths == lengths[:, :1]).all():  # nothing but ties
        return Friedman(0.0, 1.0)
    found = stats.friedmanchisquare(*lengths.T)
    return Friedman(float(found.statistic), float(found.pvalue))


def critical_difference(num_planners: int, num_problems: int, significance: float) -> float:
    """Return the difference of mean ranks that Nemenyi's test calls significant (Demšar 2006)."""
    q = float(stats.studentized_range.ppf(1.0 - significance, num_planners, np.inf)) / np.sqrt(2.0)
    return float(q * np.sqrt(num_planners * (num_planners + 1) / (6.0 * num_problems)))


def alike(mean_ranks: Sequence[float], difference: float) -> list[tuple[int, int]]:
    """Return (first, last) of the groups of ascending ranks that do not differ significantly."""
    groups: list[tuple[int, int]] = []
    for first, low in enumerate(mean_ranks):
        last = max(k for k, rank in enumerate(mean_ranks) if rank - low < difference)
        if last > first and (not groups or last > groups[-1][1]):
            groups.append((first, last))
    return groups


@table_of("planner ratio share problems")
def profiles_table(found: Standing) -> Rows:
    """Return the performance profile of each planner, at every ratio at which one rises."""
    ratios = effort_ratios(found.efforts)
    steps = np.unique(np.append(ratios[np.isfinite(ratios)], 1.0))
    axis = np.append(steps, max(END * steps[-1], 2.0))
    for planner, own in zip(found.planners, ratios.T, strict=True):
        for x in axis:
            yield planner, x, np.count_nonzero(own <= x) / len(own), len(own)


def draw_profiles(table: pd.DataFrame) -> Figure:
    """Draw performance profiles."""
    figure, (axes,) = style.panels(3.4)
    draw_steps(axes, table, "ratio", "share", list(table["planner"].unique()))
    count = int(table["problems"].iloc[0])
    axes.set(ylim=(0.0, 1.02), ylabel=f"share of {count} problems")
    axes.set_xlabel("expected running time to a proven answer, times that of the best planner [–]")
    name_curves(figure, axes, 3)
    return figure


def critical_difference_table(found: Standing, significance: float) -> pd.DataFrame:
    """Return mean ranks, best first, with the critical difference."""
    table = pd.DataFrame({"planner": found.planners, "mean_rank": found.mean_ranks})
    sizes = len(found.planners), len(found.problems)
    table["problems"] = sizes[1]
    table["friedman_p"] = friedman(found.lengths).p_value
    table["critical_difference"] = critical_difference(*sizes, significance)
    return table.sort_values("mean_rank", kind="stable", ignore_index=True)


def draw_critical_difference(table: pd.DataFrame) -> Figure:
    """Draw mean ranks on a line; a bar joins planners that do not differ significantly."""
    ranks, difference = table["mean_rank"].tolist(), float(table["critical_difference"].iloc[0])
    groups, count = alike(ranks, difference), len(ranks)
    left = (count + 1) // 2  # planners named on the left
    foot = BAR * (len(groups) + 1) + LINE * left  # [inch] below the axis
    figure = style.figure(ABOVE + foot)
    axes = figure.add_subplot()
    axes.set(xlim=(1.0 - 0.45 * (count - 1), count + 0.45 * (count - 1)), ylim=(-foot, ABOVE))
    axes.axis("off")
    # the axis of mean ranks, and the critical difference above it
    is_narrow = figure.get_figwidth() < style.WIDTH
    words: dict[str, Any] = {"fontsize": 6.0 if is_narrow else 7.5}  # [pt]
    line: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 1.0}
    axes.plot([1.0, count], [0.0, 0.0], **line)
    for tick in range(1, count + 1):
        axes.plot([tick, tick], [0.0, 0.06], **line)
        if tick % 2 or not is_narrow:
            axes.text(tick, 0.09, str(tick), ha="center", va="bottom", **words)
    axes.text(count + 0.06 * (count - 1), 0.0, "mean rank\n(1 is best)", va="center", **words)
    axes.plot([1.0, 1.0 + difference], [0.4, 0.4], **line)
    for end in (1.0, 1.0 + difference):
        axes.plot([end, end], [0.36, 0.44], **line)
    text = f"critical difference {difference:.2f}"
    axes.text(1.0 + 0.5 * difference, 0.45, text, ha="center", va="bottom", **words)
    # bars that join planners, and their names
    for k, (first, last) in enumerate(groups):
        ends = ranks[first] - 0.008 * count, ranks[last] + 0.008 * count
        y = -BAR * (k + 1)
        axes.plot(ends, [y, y], color=style.NEUTRAL, linewidth=3.5, solid_capstyle="butt")
    for k, (planner, rank) in enumerate(zip(table["planner"], ranks, strict=True)):
        on_left = k < left
        y = -BAR * (len(groups) + 1) - LINE * ((k if on_left else count - 1 - k) + 0.5)
        end = 1.0 - 0.06 * (count - 1) if on_left else count + 0.06 * (count - 1)
        axes.plot([rank, rank, end], [0.0, y, y], color=style.NEUTRAL, linewidth=0.8)
        name = style.shortened(str(planner), 26)
        text = f"{name}  {rank:.2f} " if on_left else f" {rank:.2f}  {name}"
        axes.text(end, y, text, ha="right" if on_left else "left", va="center")
    return figure
