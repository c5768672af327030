"""Settings of Curkovic et al. 2013 side by side: families, measures, claims, defects."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.curkovic import measures
from evoexp.report.figures import shares
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import comparisons
from evoexp.report.statistics.comparisons import Comparison, Family, FamilyComparison, Measure
from evoexp.report.statistics.inference import spread
from evoexp.report.statistics.judging import Judge

# says nothing about convergence
COLLIDES = "solved motion collides between its configurations (exact verdict)"
MUTATION = {"ga.mutation_rate", "ga.mutation_decay", "ga.mutation_direction"}
READINGS = {"one_sided": "Eq. 9 as printed", "symmetric": "Eq. 9 read as symmetric"}
NAMES = {"quantity": "defect", "having": "failing", "total": "solved"}  # of shares, of defects
SHORT = ("collide in between", "leave [0, π]", "too fast (Eq. 2)")  # names of `measures.Defects`


def families(results: Results) -> tuple[Family, ...]:
    """Return the families of a sweep.

    Conditions that differ in collision substeps are compared with their twins; if there are none,
    all conditions with the first one that reads Eq. 9 as they do.
    """
    conditions = results.with_data
    fewest = min(_substeps(c) for c in conditions)
    finer = [c for c in conditions if _substeps(c) > fewest]
    if finer:
        firsts = {_without_substeps(c): c for c in reversed(conditions) if _substeps(c) == fewest}
        pairs = ((firsts.get(_without_substeps(c)), c) for c in finer)
        twins = tuple((first, c) for first, c in pairs if first is not None)
        return (Family("each method, tested at its configurations only,", twins),)
    found = []
    for reading in dict.fromkeys(c.planner.ga.mutation_direction for c in conditions):
        same = [c for c in conditions if c.planner.ga.mutation_direction == reading]
        found.append(Family.of(same))
    return tuple(found)


def curved(results: Results) -> bool:
    """Return whether any motion is executed as a curve."""
    return any(c.planner.interpolation == "cubic" for c in results.with_data)


def sweep_measures(results: Results, threshold: float) -> list[Measure]:
    """Return the quantities that conditions are compared in."""
    to = f"to a team of cost ≤ {markdown.number(threshold)}"
    found = [
        Measure("best cost", comparisons.by_column("best_cost")),
        Measure(f"generations {to}", partial(measures.generations_to, threshold=threshold)),
        Measure(measures.CERTIFIED, measures.certified_cost),
    ]
    pairs = [pair for family in families(results) for pair in family.pairs]
    if any(len({c.planner.ga.population_size for c in pair}) > 1 for pair in pairs):
        effort = partial(measures.evaluations_to, threshold=threshold)
        found.append(Measure(f"evaluations {to}", effort))
    if len({_substeps(c) for c in results.with_data}) > 1 or curved(results):
        found.append(Measure(COLLIDES, measures.refuted))
    return found


def _substeps(condition: ConditionResults) -> int:
    return int(condition.planner.collision.collision_substeps)


def _without_substeps(condition: ConditionResults) -> str:
    planner: dict[str, Any] = condition.planner.canonical()
    return repr(planner | {"collision": planner["collision"] | {"collision_substeps": None}})


def of_sweep(
    judge: Judge, results: Results, compared: Sequence[FamilyComparison]
) -> Iterator[Claim]:
    """Judge the claims that a sweep can judge, chosen by the settings that differ."""
    settings = [c.planner.canonical() for c in results.with_data]
    flat = [
        {**{f"ga.{key}": value for key, value in one.pop("ga").items()}, **one} for one in settings
    ]
    varied = {key for key in flat[0] if any(one[key] != flat[0][key] for one in flat)}
    level = judge.settings.significance
    is_rate = varied <= MUTATION and varied & {"ga.mutation_rate", "ga.mutation_decay"}
    for one in _converging(compared):
        if varied == {"ga.hall_depth"}:
            first, *others = results.with_data
            own, *medians = (spread(one.measure.values(c)).median for c in (first, *others))
            best, median = min(zip(others, medians, strict=True), key=lambda pair: pair[1])
            evidence = (
                f"median {markdown.number(own)}; best of the others {best.label}: "
                f"{markdown.number(median)}; {_outcomes(first, one.rows, level)}"
            )
            hearing = judge.on("depth", depth=first.label, measure=one.measure.name)
            yield hearing.best(evidence, one.rows, own <= min(medians))
        elif is_rate and one.rows:
            first = one.family.pairs[0][0]
            reading = READINGS[first.planner.ga.mutation_direction]
            words = {"who": "", "measure": one.measure.name, "reading": reading}
            evidence = _outcomes(first, one.rows, level)
            yield judge.on("falling_rate", **words).better_than_all(evidence, one.rows)


def _converging(found: Sequence[FamilyComparison]) -> list[FamilyComparison]:
    """Return the comparisons in quantities that say how fast or how far a method converges."""
    return [one for one in found if one.measure.name != COLLIDES]


def _outcomes(first: ConditionResults, rows: Sequence[Comparison], significance: float) -> str:
    """List the conditions that the first is better than, worse than, or not told from."""
    words = {
        1: "is significantly better than",
        -1: "is significantly worse than",
        0: "cannot be told from",
    }
    parts = []
    for sign, word in words.items():
        named = [
            f"{row.quantity} (A12 {row.better.a12:.2f}, p = {markdown.p_value(row.p_adjusted)})"
            for row in rows
            if row.says(significance) == sign
        ]
        parts += [f"{word} {', '.join(named)}"] * bool(named)
    return f"{first.label} {'; '.join(parts)}"


def converging_rows(compared: Sequence[FamilyComparison]) -> dict[str, tuple[Comparison, ...]]:
    """Return the comparisons in how fast or how far a method converges, by quantity."""
    return comparisons.rows_by_name(_converging(compared))


def rates_table(results: Results, confidence: float) -> pd.DataFrame:
    """Return the shares of solved motions that have a defect; without curves only one varies."""
    shown = SHORT if curved(results) else SHORT[:1]
    rows = [
        (name, position, c.label, defect)
        for position, c in enumerate(results.with_data)
        for name, defect in zip(shown, measures.defects(c), strict=False)
    ]
    table = shares.shares_table(rows, {}, confidence).rename(columns=NAMES)
    order = ["defect", "position", "condition", "failing", "solved", "lower", "upper"]
    return table[order].assign(share=table["share"].fillna(0.0))


def draw_rates(table: pd.DataFrame) -> Figure:
    """Draw one panel per defect, one row per condition."""
    named = table.rename(columns={of_defects: of_shares for of_shares, of_defects in NAMES.items()})
    return shares.draw_shares(named.assign(printed=np.nan), "share of solved motions [%]")
