"""Claims of Curkovic et al. 2013 about settings, judged by sweeps over them."""

from collections.abc import Callable, Sequence

from evoexp.papers.curkovic.families import FamilyComparison
from evoexp.report.kit import (
    Claim,
    Comparison,
    ConditionResults,
    Judge,
    ReportSettings,
    Results,
    judging,
    markdown,
    spread,
    verdicts,
)

HALL = {"ga.hall_depth", "ga.hall_memory", "ga.hall_frozen", "ga.num_elites"}
MUTATION = {"ga.mutation_rate", "ga.mutation_decay", "ga.mutation_direction"}
READINGS = {"one_sided": "Eq. 9 as printed", "symmetric": "Eq. 9 read as symmetric"}


def of_sweep(
    results: Results, settings: ReportSettings, found: Sequence[FamilyComparison]
) -> tuple[Claim, ...]:
    """Return the claims that a sweep can judge, chosen by the settings that differ."""
    claims_of: Callable[[Judge, Results, Sequence[FamilyComparison]], list[Claim]]
    varied = _varied(results)
    if varied <= HALL and varied & {"ga.hall_frozen", "ga.num_elites"}:
        claims_of = _hall
    elif varied == {"ga.hall_depth"}:
        claims_of = _depth
    elif varied <= MUTATION and varied & {"ga.mutation_rate", "ga.mutation_decay"}:
        claims_of = _mutation
    else:
        return ()
    judge = judging.judge(results, settings)
    return tuple(claims_of(judge, results, [one for one in found if one.measure.converges]))


def _varied(results: Results) -> set[str]:
    """Return the settings of the planner in which conditions differ, `ga.…` among them."""
    given = [c.planner.canonical() for c in results.with_data]
    flat = [
        {**{f"ga.{key}": value for key, value in one.pop("ga").items()}, **one} for one in given
    ]
    return {key for key in flat[0] if any(one[key] != flat[0][key] for one in flat)}


def _hall(judge: Judge, results: Results, found: Sequence[FamilyComparison]) -> list[Claim]:
    judged = []
    for c in results.with_data[1:]:
        ga, source = c.planner.ga, "section 3"
        if ga.hall_frozen:
            text = "A hall of fame that never changes slows convergence"
        elif ga.hall_depth == 0.0 and ga.num_elites:
            text, source = (
                f"It is the hall, not just elitism ({ga.num_elites} elites)",
                "our question",
            )
        elif ga.hall_depth == 0.0:
            text = "A hall of fame speeds convergence up, against neither hall nor elites"
        else:
            continue
        for one in found:
            row = next((row for row in one.rows if row.quantity == c.label), None)
            told = f"{one.family.name} against {c.label}: {{}}"
            claim = f"{text}, judged by {one.measure.name}"
            judged.append(judge.better(claim, source, row, "better", told))
    return judged


def _depth(judge: Judge, results: Results, found: Sequence[FamilyComparison]) -> list[Claim]:
    first, *others = results.with_data
    judged = []
    for one in found:
        own, *medians = (spread(one.measure.values(c)).median for c in (first, *others))
        best, median = min(zip(others, medians, strict=True), key=lambda pair: pair[1])
        evidence = (
            f"median {markdown.number(own)}; best of the others {best.label}: "
            f"{markdown.number(median)}; {_outcomes(first, one.rows, judge.significance)} "
            "(reproduced: best median, one other at least significantly worse; contradicted: one "
            "significantly better)"
        )
        text = (
            f"A hall of at most {first.label} of the population is the best, judged by "
            f"{one.measure.name}"
        )
        verdict = verdicts.judge_best(one.rows, own <= min(medians), judge.significance)
        judged.append(judge.claim(text, "section 3", evidence, verdict))
    return judged


def _mutation(judge: Judge, results: Results, found: Sequence[FamilyComparison]) -> list[Claim]:
    judged = []
    for one in (one for one in found if one.rows):
        first = one.family.pairs[0][0]
        evidence = (
            f"{_outcomes(first, one.rows, judge.significance)} "
            "(reproduced: significantly better than each; contradicted: one significantly better)"
        )
        text = (
            "A rate that falls (Eq. 10) helps, against constant rates, judged by "
            f"{one.measure.name}; {READINGS[first.planner.ga.mutation_direction]}"
        )
        judged.append(judge.better_than_all(text, "section 3, Eq. 10", evidence, one.rows))
    return judged


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
