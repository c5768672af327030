"""Curkovic et al. 2013, Fig. 5: Pareto fronts of the populations in an early generation."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.evolution.pareto import pareto_front
from evoexp.papers.curkovic import measures
from evoexp.papers.curkovic.rules import PAPER
from evoexp.records import FloatArray, FrontRow
from evoexp.report import kit
from evoexp.report.kit import generic, groups, markdown, marks, rounded, style
from evoexp.store.log_reader import read_log

CRITERIA = ("c1", "c2", "c3", "c4")
MARKERS = ("o", "^", "s", "D")  # of populations
DOMINATED, FRONT = style.ARM_COLOURS[:2]  # blue and red, as the paper draws them


def fronts_table(fronts: Sequence[FrontRow], replicate: int, length_unit: str) -> pd.DataFrame:
    """Return the criteria of every individual of every population."""
    parts = [
        pd.DataFrame(
            {
                "generation": front.generation,
                "population": front.population,
                "individual": np.arange(len(front.criteria)),
                **dict(zip(CRITERIA, front.criteria.T, strict=True)),
                "non_dominated": pareto_front(np.ascontiguousarray(front.criteria.T)),
            }
        )
        for front in fronts
    ]
    return rounded(pd.concat(parts, ignore_index=True)).assign(
        replicate=replicate, length_unit=length_unit
    )


def draw_fronts(table: pd.DataFrame) -> Figure:
    """Draw all pairs of criteria; each population has its marker, each front its colour."""
    unit = table["length_unit"].iloc[0]
    words = "C₁ [collisions]", f"C₂ path [{unit}]", "C₃ rotation [rad]", f"C₄ unevenness [{unit}]"
    names = dict(zip(CRITERIA, words, strict=True))
    figure = style.figure(4.9)
    panels = figure.subplots(2, 3)
    for axes, (x, y) in zip(panels.ravel(), combinations(CRITERIA, 2), strict=True):
        for (front, population), rows in groups(table, ["non_dominated", "population"]):
            look = (
                {"color": FRONT, "alpha": 0.85, "zorder": 3}
                if front
                else {"color": DOMINATED, "alpha": 0.45}
            )
            marker = MARKERS[int(population) % len(MARKERS)]
            axes.plot(
                rows[x], rows[y], marker, markersize=3.6 if front else 3.2, mec="none", **look
            )
        axes.set(xlabel=names[x], ylabel=names[y])
        axes.yaxis.set_major_locator(style.few_ticks())
        if x == CRITERIA[0]:
            axes.set_xscale("symlog", linthresh=1.0)  # most have no collision, a few have many
            axes.set_xlim(left=-0.2)
        else:
            axes.xaxis.set_major_locator(style.few_ticks())
    keys = [
        marks.point_key(
            f"robot {population + 1}: {int((rows['non_dominated'] == front).sum())} {word}",
            MARKERS[int(population) % len(MARKERS)],
            4,
            color=colour,
        )
        for population, rows in groups(table, "population")
        for front, colour, word in ((True, FRONT, "non-dominated"), (False, DOMINATED, "dominated"))
    ]
    style.keys_below(figure, keys)
    return figure


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of fronts, or the generic page if no log holds a front."""
    if not measures.fits(results):
        return generic.page(results, settings)
    fronts = {
        c.label: {int(k): read_log(c.run.log_path(int(k))).fronts for k in c.summaries.index}
        for c in results.with_data
    }
    drawn = [c for c in results.with_data if fronts[c.label].get(c.best_replicate)]
    if not drawn:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    populations = range(max(len(rows) for c in drawn for rows in fronts[c.label].values()))
    sizes = (
        kit.Quantity(
            f"individuals on the front of robot {population + 1}'s population",
            "–",
            {c.label: kit.spread(_sizes(fronts[c.label], population)) for c in results.with_data},
        )
        for population in populations
    )
    return PAPER.page(
        results,
        "fronts",
        base,
        quantities=(*sizes, *base.quantities),
        checks=tuple(check for c in drawn for check in _checks(c, fronts[c.label])),
        drawings=(
            *(_drawing(results, c, fronts[c.label]) for c in drawn),
            generic.best_drawing(results),
        ),
    )


def _size(front: FrontRow) -> int:
    return int(pareto_front(np.ascontiguousarray(front.criteria.T)).sum())


def _sizes(fronts: dict[int, list[FrontRow]], population: int) -> FloatArray:
    """Return the number of individuals on the front of a population, (replicates,)."""
    return np.array(
        [_size(rows[population]) for rows in fronts.values() if population < len(rows)],
        dtype=np.float64,
    )


def _checks(
    condition: kit.ConditionResults, fronts: dict[int, list[FrontRow]]
) -> tuple[tuple[str, str], ...]:
    ga = condition.planner.ga
    sizes = np.array([_size(front) for rows in fronts.values() for front in rows])
    larger, single = (
        markdown.share(int(np.count_nonzero(of)), len(sizes))
        for of in (sizes > ga.num_hall_teams, sizes == 1)
    )
    return PAPER.checks(
        "fronts",
        ga=ga,
        larger=larger,
        single=single,
        costs=markdown.spread(condition.spread("best_cost")),
        bound=markdown.number(measures.lower_bound(condition)),
    )


def _drawing(
    results: kit.Results, condition: kit.ConditionResults, fronts: dict[int, list[FrontRow]]
) -> kit.Drawing:
    best, several = condition.best_replicate, len(results.with_data) > 1
    generation = fronts[best][0].generation
    suffix = f"_{results.position(condition.label) + 1}" if several else ""
    return PAPER.drawing(
        "fig_5_fronts",
        (fronts_table, draw_fronts),
        (condition,),
        fronts[best],
        best,
        condition.condition.length_unit,
        suffix=suffix,
        generation=generation,
        replicate=best,
    )
