"""Pareto fronts of populations, criterion against criterion (Curkovic et al. 2013, Fig. 5)."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.evolution.pareto import pareto_front
from evoexp.papers import marks
from evoexp.records import FrontRow
from evoexp.report.kit import groups, rounded, style

CRITERIA = ("c1", "c2", "c3", "c4")
MARKERS = ("o", "^", "s", "D")  # of populations
DOMINATED, FRONT = style.ARM_COLOURS[:2]  # blue and red, as the paper draws them


def fronts_table(fronts: Sequence[FrontRow], replicate: int, length_unit: str) -> pd.DataFrame:
    """Return the criteria of every individual of every population.

    Returns:
        Columns replicate, generation, population, individual, c1 [collisions], c2 [length unit], c3
        [rad], c4 [length unit], non_dominated (in its own population), length_unit.
    """
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
