"""The page of ablations: the first condition against each other one; checks of cross-over."""

from collections.abc import Sequence

import numpy as np

from evoexp.papers.rana import measures, motions
from evoexp.papers.rana.rules import PAPER, RULES
from evoexp.planners.via_point_ga.planner import ViaPointGa
from evoexp.records import FloatArray, generations
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown, run_measures, sweep_figures

GENERATIONS = (0, 10, 50)  # whose pairs of strings are looked at
PAIRS = 2000  # drawn of each generation
COST, EVENNESS = "best cost", "unevenness of the best, C3 + C4"
CLEARANCE = "clearance of the bodies over the whole motion"
COMPARED = (
    kit.Measure(COST, kit.by_column("best_cost")),
    kit.Measure(EVENNESS, measures.unevenness, "deg"),
    kit.Measure(CLEARANCE, kit.by_column("clearance"), "length", lower_is_better=False),
    kit.Measure(measures.FIRST_FREE, run_measures.first_feasible, "generation"),
)
DRAWN = {COST: COST, EVENNESS: "unevenness C3 + C4", CLEARANCE: "clearance"}  # names in figures
PARTS = ("no redistribution", "no relaxation (δ = 0)", "neither")  # of the claim


def checks(
    results: kit.Results, costs: Sequence[kit.Comparison], evenness: Sequence[kit.Comparison]
) -> list[tuple[str, str]]:
    """Return the checks of an experiment whose conditions change the cross-over."""
    first, *others = results.with_data
    if not isinstance(first.planner, ViaPointGa) or first.is_control:
        return []
    both = {"best cost": costs, "unevenness C3 + C4": evenness}
    found = [
        row
        for other in others
        if _changed(first, other, "crossover_reading")
        for row in PAPER.checks("reading", first=first, other=other, told=_difference(other, both))
    ]
    distances = [c for c in others if _changed(first, c, "crossover_distance")]
    if not distances:
        return found
    told = "; ".join(f"{c.label}: {_difference(c, {'best cost': costs})}" for c in distances)
    apart = ", ".join(
        f"{100 * share:.1f} % in generation {generation}"
        for generation, share in kept_apart(first).items()
    )
    limit = f"{first.planner.crossover_distance:g}°"
    return [*found, *PAPER.checks("distance", limit=limit, apart=apart, told=told)]


def kept_apart(condition: kit.ConditionResults) -> dict[int, float]:
    """Return the share of pairs that are too far apart to be crossed, by generation.

    The first replicate is run again for some generations; sites and pairs are drawn at random.
    """
    planner, problem = condition.planner, motions.problem(condition)
    draw = np.random.Generator(np.random.PCG64(0))
    found = {}
    for generation in generations(planner.evolve(problem, condition.condition.rng(0))):
        if generation.index in GENERATIONS:
            strings = generation.population[:, :, : planner.ga.population_size]
            found[generation.index] = _share_apart(
                strings, problem.arm_slices, planner.crossover_distance, draw
            )
        if generation.index >= max(GENERATIONS):
            break
    return found


def _share_apart(
    strings: FloatArray, arm_slices: np.ndarray, distance: float, rng: np.random.Generator
) -> float:
    """Return the share of pairs of strings (nq, N + 1, individuals) [deg] that are not crossed.

    They are not closer than the distance [deg] at the site of an arm at least.
    """
    num_points, individuals = strings.shape[1:]
    if num_points < 3 or individuals < 2:
        return 0.0
    one = rng.integers(individuals, size=PAIRS)
    two = (one + rng.integers(1, individuals, size=PAIRS)) % individuals
    apart = np.zeros(PAIRS, dtype=bool)
    for first, stop in arm_slices:
        site = rng.integers(1, num_points - 1, size=PAIRS)  # 1 … N − 1
        gap = strings[first:stop, site, one] - strings[first:stop, site, two]
        apart |= np.linalg.norm(gap, axis=0) >= distance
    return float(np.mean(apart))


def _difference(other: kit.ConditionResults, tables: dict[str, Sequence[kit.Comparison]]) -> str:
    """Return the differences of the first condition from another one in words."""
    told = [
        f"the median of {name} differs by {markdown.number(row.median_difference)}, "
        f"p = {markdown.p_value(row.better.p_value)}"
        for name, rows in tables.items()
        for row in rows
        if row.quantity == other.label
    ]
    return "; ".join(told) or "nothing to compare"


def _changed(first: kit.ConditionResults, other: kit.ConditionResults, name: str) -> bool:
    """Return whether this setting, and no other, differs from the first condition's."""
    if other.is_control or not isinstance(other.planner, ViaPointGa):
        return False
    value = getattr(first.planner, name)
    same = bool(other.planner.model_copy(update={name: value}) == first.planner)
    return same and bool(getattr(other.planner, name) != value)


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of ablations, or the generic page if there is nothing to compare."""
    if len(results.with_data) < 2:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    unit = results.with_data[0].condition.length_unit or "–"
    first = results.with_data[0]
    found = kit.compare_families([kit.Family.of(results.with_data)], COMPARED, settings)
    tables = kit.rows_by_name(found)
    shown = [one for one in COMPARED if one.name in DRAWN and tables[one.name]]
    units = {one.name: unit if one.unit == "length" else one.unit for one in COMPARED}
    cost, _, *effort = base.quantities
    own = [kit.quantity(results, one.name, units[one.name], one.values) for one in COMPARED[1:]]
    return PAPER.page(
        results,
        "operators",
        base,
        title=f"{results.experiment or 'stored runs'}: {first.label} against each other condition",
        quantities=(cost, *own, *effort),
        claims=tuple(operator_claims(results, judging.judge(results, settings, RULES))),
        checks=tuple(checks(results, tables[COST], tables[EVENNESS])),
        comparisons=kit.headed(found),
        drawings=(
            sweep_figures.values_drawing(
                results, {f"{DRAWN[one.name]} [{units[one.name]}]": one.values for one in shown}
            ),
            *sweep_figures.effects_drawings(
                results, settings, {DRAWN[one.name]: tables[one.name] for one in shown}, first.label
            ),
            generic.best_drawing(results),
        ),
    )


def operator_claims(
    results: kit.Results, judge: kit.Judge, who: str = "", first: str = ""
) -> list[kit.Claim]:
    """Judge the paper's claim about relaxation and redistribution, part by part that was run.

    `who` begins each claim; `first` is the label of the printed setting, or else the first one.
    """
    named = {condition.label: condition for condition in results.with_data}
    printed = named.get(first or next(iter(named), ""))
    if printed is None:
        return []
    others = [other for other in named.values() if other is not printed]
    found = kit.compare_families([kit.Family.of([printed, *others])], COMPARED[:2], judge.settings)
    rows = {one.measure.name: {row.quantity: row for row in one.rows} for one in found}
    parts = [other for other in others if other.label in PARTS]
    counts = {c.label: refuted(c) for c in (printed, *parts)}
    own = counts[printed.label]
    p_values = kit.holm([kit.fisher_exact(own, counts[part.label]) for part in parts])
    claims = []
    for part, p_value in zip(parts, p_values, strict=True):
        other = counts[part.label]
        says = [by[part.label].says(judge.significance) for by in rows.values() if part.label in by]
        says.append(judging.greater(other, own, p_value, judge.significance))
        told = (
            f"{_told(rows[COST].get(part.label), COST, '–')}; "
            f"{_told(rows[EVENNESS].get(part.label), EVENNESS, 'deg', (printed, part))}; "
            f"refuted motions {markdown.share(own.having, own.total)} with, "
            f"{markdown.share(other.having, other.total)} without, p = {markdown.p_value(p_value)}"
        )
        hearing = judge.on("operators_improve", who=who, without=part.label)
        claims.append(hearing.own(told, printed.done, improves(says)))
    return claims


def improves(says: list[int]) -> bool | None:
    """Return whether a part improves the search; None: nobody can say, or it is a trade.

    Each quantity says 1 if it is significantly better with the part, −1 if worse, else 0.
    """
    better, worse = 1 in says, -1 in says
    return None if better == worse else better


def refuted(condition: kit.ConditionResults) -> kit.Proportion:
    """Count the motions whose bodies touch."""
    counts = condition.verdicts
    return kit.Proportion(counts.refuted, counts.judged)


def _told(
    row: kit.Comparison | None,
    name: str,
    unit: str,
    pair: tuple[kit.ConditionResults, kit.ConditionResults] | None = None,
) -> str:
    """Return a comparison in words, with the medians of both where the pair is given."""
    if row is None:
        return f"{name}: nothing to compare"
    shown = "" if unit == "–" else f" {unit}"
    medians = ""
    if pair is not None:
        with_it, without = (markdown.number(float(np.median(measures.unevenness(c)))) for c in pair)
        medians = f"{with_it}{shown} with, {without}{shown} without, "
    difference = markdown.number(row.median_difference)
    return (
        f"{name}: {medians}difference of medians {difference}{shown}, {kit.evidence(row, 'lower')}"
    )
