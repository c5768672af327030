"""What Curkovic et al. 2013 claim about settings, judged by sweeps over them."""

from collections.abc import Callable, Sequence

from evoexp.papers.curkovic.families import Tested
from evoexp.report import claims, judging, markdown
from evoexp.report.claims import Claim, Comparison
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import spread

HALL = {"ga.hall_depth", "ga.hall_memory", "ga.hall_frozen", "ga.num_elites"}
MUTATION = {"ga.mutation_rate", "ga.mutation_decay", "ga.mutation_direction"}
READINGS = {"one_sided": "Eq. 9 as printed", "symmetric": "Eq. 9 read as symmetric"}


def of_sweep(
    results: Results, settings: ReportSettings, found: Sequence[Tested]
) -> tuple[Claim, ...]:
    """Return the claims that a sweep can judge, told by what its conditions differ in."""
    judge: Callable[[Results, ReportSettings, Sequence[Tested]], list[Claim]]
    varied = _varied(results)
    if varied <= HALL and varied & {"ga.hall_frozen", "ga.num_elites"}:
        judge = _hall
    elif varied == {"ga.hall_depth"}:
        judge = _depth
    elif varied <= MUTATION and varied & {"ga.mutation_rate", "ga.mutation_decay"}:
        judge = _mutation
    else:
        return ()
    return tuple(judge(results, settings, [one for one in found if one.measure.converges]))


def _varied(results: Results) -> set[str]:
    """Return the settings of the planner in which conditions differ.

    Those of its algorithm one by one.
    """
    given = [c.planner.canonical() for c in results.with_data]
    flat = [
        {**{f"ga.{key}": value for key, value in one.pop("ga").items()}, **one} for one in given
    ]
    return {key for key in flat[0] if any(one[key] != flat[0][key] for one in flat)}


def _hall(results: Results, settings: ReportSettings, found: Sequence[Tested]) -> list[Claim]:
    reason, judged = judging.not_judged(results), []
    for c in results.with_data[1:]:
        ga = c.planner.ga
        if ga.hall_frozen:
            text, source = "A hall of fame that never changes slows convergence", "section 3"
        elif ga.hall_depth == 0.0 and ga.num_elites:
            text, source = (
                f"It is the hall, not just elitism ({ga.num_elites} elites)",
                "our question",
            )
        elif ga.hall_depth == 0.0:
            text, source = (
                "A hall of fame speeds convergence up, against neither hall nor elites",
                "section 3",
            )
        else:
            continue
        for one in found:
            row = next((row for row in one.rows if row.quantity == c.label), None)
            told = judging.evidence(row, "better") if row else "nothing to compare"
            evidence = f"{one.family.name} against {c.label}: {told}"
            verdict = claims.judge_better(reason, row, settings.significance)
            judged.append(
                judging.claim(
                    f"{text}, judged by {one.measure.name}", source, evidence, verdict, reason
                )
            )
    return judged


def _depth(results: Results, settings: ReportSettings, found: Sequence[Tested]) -> list[Claim]:
    reason, (first, *others) = judging.not_judged(results), results.with_data
    judged = []
    for one in found:
        own, *medians = (spread(one.measure.values(c)).median for c in (first, *others))
        verdict = claims.judge_best(reason, one.rows, own <= min(medians), settings.significance)
        best, median = min(zip(others, medians, strict=True), key=lambda pair: pair[1])
        evidence = (
            f"median {markdown.number(own)}; best of the others {best.label}: "
            f"{markdown.number(median)}; {_who(first, one.rows, settings.significance)} "
            "(reproduced: best median, one other at least significantly worse; contradicted: one "
            "significantly better)"
        )
        text = (
            f"A hall of at most {first.label} of the population is the best, judged by "
            f"{one.measure.name}"
        )
        judged.append(judging.claim(text, "section 3", evidence, verdict, reason))
    return judged


def _mutation(results: Results, settings: ReportSettings, found: Sequence[Tested]) -> list[Claim]:
    reason, judged = judging.not_judged(results), []
    for one in found:
        if not one.rows:
            continue
        first = one.family.pairs[0][0]
        verdict = claims.judge_better_than_all(reason, one.rows, settings.significance)
        rule = (
            "(reproduced: significantly better than each; contradicted: one significantly better)"
        )
        evidence = f"{_who(first, one.rows, settings.significance)} {rule}"
        reading = READINGS[first.planner.ga.mutation_direction]
        text = (
            "A rate that falls (Eq. 10) helps, against constant rates, judged by "
            f"{one.measure.name}; {reading}"
        )
        judged.append(judging.claim(text, "section 3, Eq. 10", evidence, verdict, reason))
    return judged


def _who(first: ConditionResults, rows: Sequence[Comparison], significance: float) -> str:
    """Say whom the first condition is better than, whom worse.

    And from whom it cannot be told apart.
    """
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
