"""Curkovic et al. 2013, Fig. 5: Pareto fronts of the populations in an early generation."""

from functools import partial

import numpy as np

from evoexp.evolution.pareto import pareto_front
from evoexp.papers.curkovic import measures
from evoexp.papers.curkovic.figures import pareto_fronts
from evoexp.papers.curkovic.rules import PAPER
from evoexp.records import FloatArray, FrontRow
from evoexp.report import kit
from evoexp.report.kit import generic, markdown
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of fronts, or the generic page if no log holds a front."""
    if not measures.fits(results):
        return generic.page(results, settings)
    fronts = {c.label: _fronts(results, c) for c in results.with_data}
    drawn = [c for c in results.with_data if fronts[c.label].get(c.best_replicate)]
    if not drawn:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    populations = range(max(len(rows) for c in drawn for rows in fronts[c.label].values()))
    sizes = [(p, {c.label: _sizes(fronts[c.label], p) for c in drawn}) for p in populations]
    return PAPER.page(
        results,
        "fronts",
        base,
        quantities=(*(_quantity(results, p, of) for p, of in sizes), *base.quantities),
        checks=tuple(check for c in drawn for check in _checks(c, fronts[c.label])),
        drawings=(
            *(_drawing(results, c, fronts[c.label]) for c in drawn),
            generic.best_drawing(results),
        ),
    )


def read_fronts(
    results: kit.Results, condition: kit.ConditionResults, replicate: int
) -> list[FrontRow]:
    """Return the criteria of a finished replicate's populations, one record per population.

    Raises:
        CorruptLog: If the log cannot be trusted.
    """
    return read_log(
        RunDirectory(results.outputs, condition.condition.id).log_path(replicate)
    ).fronts


def _fronts(results: kit.Results, condition: kit.ConditionResults) -> dict[int, list[FrontRow]]:
    """Return the fronts of every finished replicate."""
    return {int(k): read_fronts(results, condition, int(k)) for k in condition.summaries.index}


def _size(front: FrontRow) -> int:
    return int(pareto_front(np.ascontiguousarray(front.criteria.T)).sum())


def _sizes(fronts: dict[int, list[FrontRow]], population: int) -> FloatArray:
    """Return the number of individuals on the front of a population, (replicates,)."""
    return np.array(
        [_size(rows[population]) for rows in fronts.values() if population < len(rows)],
        dtype=np.float64,
    )


def _quantity(results: kit.Results, population: int, sizes: dict[str, FloatArray]) -> kit.Quantity:
    spreads = {c.label: kit.spread(sizes.get(c.label, np.empty(0))) for c in results.with_data}
    return kit.Quantity(
        f"individuals on the front of robot {population + 1}'s population", "–", spreads
    )


def _checks(
    condition: kit.ConditionResults, fronts: dict[int, list[FrontRow]]
) -> list[tuple[str, str]]:
    ga = condition.planner.ga
    sizes = np.array([_size(front) for rows in fronts.values() for front in rows])
    larger, single = (
        markdown.share(int(np.count_nonzero(of)), len(sizes))
        for of in (sizes > ga.num_hall_teams, sizes == 1)
    )
    bound, costs = measures.lower_bound(condition), markdown.spread(condition.spread("best_cost"))
    return [
        (
            f"Fronts that are larger than the hall of fame may be ({ga.num_hall_teams} of "
            f"{ga.population_size}), and fronts of a single point",
            f"{larger} populations; {single}",
        ),
        (
            "That there are individuals on a front in an early phase (section 3) says little: "
            "every population has a front, a random one, too. What the early phase is worth: "
            "cost of the best collision-free team",
            f"{costs}; lower bound {markdown.number(bound)}",
        ),
    ]


def _drawing(
    results: kit.Results, condition: kit.ConditionResults, fronts: dict[int, list[FrontRow]]
) -> kit.Drawing:
    best, several = condition.best_replicate, len(results.with_data) > 1
    generation = fronts[best][0].generation
    suffix = f"_{results.position(condition.label) + 1}" if several else ""
    return PAPER.drawing(
        "fig_5_fronts",
        partial(pareto_fronts.fronts_table, fronts[best], best, condition.condition.length_unit),
        pareto_fronts.draw_fronts,
        (condition,),
        suffix=suffix,
        generation=generation,
        replicate=best,
    )
