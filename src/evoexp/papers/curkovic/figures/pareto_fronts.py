"""Curkovic et al. 2013, Fig. 5: Pareto fronts of the populations in an early generation."""

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.evolution.succession import pareto_front
from evoexp.records import FloatArray, FrontRow
from evoexp.report.figures import groups, rounded, style
from evoexp.report.pages.page_parts import Quantity
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import spread
from evoexp.store.log_reader import read_log

CRITERIA = ("c1", "c2", "c3", "c4")
MARKERS = ("o", "^", "s", "D")  # of populations
DOMINATED, FRONT = style.ARM_COLOURS[:2]  # blue and red, as the paper draws them


def fronts_table(fronts: Sequence[FrontRow], replicate: int, length_unit: str) -> pd.DataFrame:
    """Return the criteria of every individual of every population."""
    parts = []
    for front in fronts:
        columns: dict[str, Any] = {"generation": front.generation, "population": front.population}
        columns |= {"individual": np.arange(len(front.criteria))}
        columns |= dict(zip(CRITERIA, front.criteria.T, strict=True))
        columns |= {"non_dominated": pareto_front(np.ascontiguousarray(front.criteria.T))}
        parts.append(pd.DataFrame(columns))
    table = rounded(pd.concat(parts, ignore_index=True))
    return table.assign(replicate=replicate, length_unit=length_unit)


def draw_fronts(table: pd.DataFrame) -> Figure:
    """Draw all pairs of criteria; each population has its marker, each front its colour."""
    unit = table["length_unit"].iloc[0]
    words = "C₁ [collisions]", f"C₂ path [{unit}]", "C₃ rotation [rad]", f"C₄ unevenness [{unit}]"
    names = dict(zip(CRITERIA, words, strict=True))
    figure, panels = style.panels(2.3, 6, 3, 0.3)
    for axes, (x, y) in zip(panels, combinations(CRITERIA, 2), strict=True):
        for (front, population), rows in groups(table, ["non_dominated", "population"]):
            colour, word = (FRONT, "non-dominated") if front else (DOMINATED, "dominated")
            look: dict[str, Any] = {"alpha": 0.85 if front else 0.45, "ms": 3.4, "mec": "none"}
            label = f"robot {population + 1}: {len(rows)} {word}"
            marker = MARKERS[int(population) % len(MARKERS)]
            axes.plot(rows[x], rows[y], marker, color=colour, label=label, **look)
        axes.set(xlabel=names[x], ylabel=names[y])
        axes.yaxis.set_major_locator(style.few_ticks())
        if x == CRITERIA[0]:
            axes.set_xscale("symlog", linthresh=1.0)  # most have no collision, a few have many
            axes.set_xlim(left=-0.2)
        else:
            axes.xaxis.set_major_locator(style.few_ticks())
    style.legend_below(figure, panels[:1], 4)
    return figure


Fronts = dict[int, list[FrontRow]]  # replicate → front of each population


def fronts(condition: ConditionResults) -> Fronts:
    """Return the fronts that the logs of a condition hold."""
    return {
        int(k): read_log(condition.run.log_path(int(k))).fronts for k in condition.summaries.index
    }


def front_conditions(results: Results) -> list[tuple[ConditionResults, str]]:
    """Return the conditions whose fronts are drawn, each with the end of its figure's stem."""
    several = len(results.with_data) > 1
    return [
        (c, f"_{results.position(c.label) + 1}" if several else "")
        for c in results.with_data
        if fronts(c).get(c.best_replicate)
    ]


def front_sizes(results: Results) -> Iterator[Quantity]:
    """Yield the rows of the sizes of fronts, population by population."""
    found = {c.label: fronts(c) for c in results.with_data}
    most = max(len(rows) for own in found.values() for rows in own.values())
    for population in range(most):
        name = f"individuals on the front of robot {population + 1}'s population"
        sizes = {label: spread(_sizes(own, population)) for label, own in found.items()}
        yield Quantity(name, "–", sizes)


def _sizes(fronts: Fronts, population: int | None = None) -> FloatArray:
    """Return the numbers of individuals on the fronts of a population, or of all, (fronts,)."""
    sizes = [
        float(pareto_front(np.ascontiguousarray(front.criteria.T)).sum())
        for rows in fronts.values()
        for number, front in enumerate(rows)
        if population in (None, number)
    ]
    return np.array(sizes)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "best_fronts": lambda condition, fronts: fronts[condition.best_replicate],
    # fronts that are larger than the hall of fame may be, and those of a single point
    "large_fronts": lambda condition, fronts: counted(
        _sizes(fronts) > condition.planner.ga.num_hall_teams
    ),
    "single_fronts": lambda fronts: counted(_sizes(fronts) == 1),
}
