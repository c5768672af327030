"""Claims of Curkovic et al. 2013 about settings, judged by sweeps over them."""

from collections.abc import Callable, Sequence

from evoexp.papers.curkovic.families import FamilyComparison
from evoexp.papers.curkovic.rules import RULES
from evoexp.report import kit
from evoexp.report.kit import judging, markdown

MUTATION = {"ga.mutation_rate", "ga.mutation_decay", "ga.mutation_direction"}
READINGS = {"one_sided": "Eq. 9 as printed", "symmetric": "Eq. 9 read as symmetric"}


def of_sweep(
    results: kit.Results, settings: kit.ReportSettings, found: Sequence[FamilyComparison]
) -> tuple[kit.Claim, ...]:
    """Return the claims that a sweep can judge, chosen by the settings that differ."""
    claims_of: Callable[[kit.Judge, kit.Results, Sequence[FamilyComparison]], list[kit.Claim]]
    varied = _varied(results)
    if varied == {"ga.hall_depth"}:
        claims_of = _depth
    elif varied <= MUTATION and varied & {"ga.mutation_rate", "ga.mutation_decay"}:
        claims_of = _mutation
    else:
        return ()
    judge = judging.judge(results, settings, RULES)
    return tuple(claims_of(judge, results, [one for one in found if one.measure.converges]))


def _varied(results: kit.Results) -> set[str]:
    """Return the settings of the planner in which conditions differ, `ga.…` among them."""
    given = [c.planner.canonical() for c in results.with_data]
    flat = [
        {**{f"ga.{key}": value for key, value in one.pop("ga").items()}, **one} for one in given
    ]
    return {key for key in flat[0] if any(one[key] != flat[0][key] for one in flat)}


def _depth(
    judge: kit.Judge, results: kit.Results, found: Sequence[FamilyComparison]
) -> list[kit.Claim]:
    first, *others = results.with_data
    judged = []
    for one in found:
        own, *medians = (kit.spread(one.measure.values(c)).median for c in (first, *others))
        best, median = min(zip(others, medians, strict=True), key=lambda pair: pair[1])
        evidence = (
            f"median {markdown.number(own)}; best of the others {best.label}: "
            f"{markdown.number(median)}; {_outcomes(first, one.rows, judge.significance)}"
        )
        hearing = judge.on("depth", depth=first.label, measure=one.measure.name)
        judged.append(hearing.best(evidence, one.rows, own <= min(medians)))
    return judged


def _mutation(
    judge: kit.Judge, results: kit.Results, found: Sequence[FamilyComparison]
) -> list[kit.Claim]:
    judged = []
    for one in (one for one in found if one.rows):
        first = one.family.pairs[0][0]
        hearing = judge.on(
            "falling_rate",
            who="",
            measure=one.measure.name,
            reading=READINGS[first.planner.ga.mutation_direction],
        )
        evidence = _outcomes(first, one.rows, judge.significance)
        judged.append(hearing.better_than_all(evidence, one.rows))
    return judged


def _outcomes(
    first: kit.ConditionResults, rows: Sequence[kit.Comparison], significance: float
) -> str:
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
