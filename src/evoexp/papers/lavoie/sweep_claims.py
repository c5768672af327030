"""What sweeps over the settings of Lavoie & Boudreau 2001 say of their claims.

And of our questions.
"""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from evoexp.papers.lavoie import measures
from evoexp.papers.lavoie.claims import percentages
from evoexp.papers.lavoie.measures import Refuted
from evoexp.records import FloatArray
from evoexp.report import claims, markdown
from evoexp.report.claims import Claim, Comparison, judge_greater
from evoexp.report.judging import claim, evidence, not_judged
from evoexp.report.pages import generic
from evoexp.report.proportions import Proportion, fisher_exact
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import holm

QUESTION = "our question"
Group = list[ConditionResults]


def of_sweep(
    results: Results, settings: ReportSettings, refuted: dict[str, Refuted]
) -> tuple[Claim, ...]:
    """Return the claims that the conditions can judge.

    None where they differ in nothing that a claim is about.
    """
    return (
        *_success(results, settings),
        *_precision(results, settings),
        *_generations(results, settings),
        *_coding(results, settings),
        *_blindness(results, settings, refuted),
        *_chance(results, settings),
        *_positions(results, settings, refuted),
    )


def groups_but_for(results: Results, *path: str) -> list[Group]:
    """Return the conditions that agree in all but one setting of the planner, two or more each.

    Args:
        results: With data; controls are left out.
        path: Names that lead to the setting: "ga", "num_generations".
    """
    found: dict[str, Group] = {}
    for c in results.main:
        planner: dict[str, Any] = c.planner.canonical()
        part = planner
        for name in path[:-1]:
            part[name] = dict(part[name])
            part = part[name]
        part.pop(path[-1], None)
        key = repr((c.condition.robot.canonical(), c.condition.scenario.canonical(), planner))
        found.setdefault(key, []).append(c)
    return [group for group in found.values() if len(group) > 1]


def _success(results: Results, settings: ReportSettings) -> list[Claim]:
    """Judge the printed percentages by either reading of a success."""
    why = not_judged(results)
    conditions = [c for group in groups_but_for(results, "success") for c in group]
    return [one for c in conditions for one in percentages(why, c, settings)]


def _precision(results: Results, settings: ReportSettings) -> list[Claim]:
    """Judge that smaller stopping values give smaller errors, step by step."""
    why, judged = not_judged(results), []
    for group in groups_but_for(results, "stop_cost_sp2"):
        own = sorted(group, key=lambda c: -float(c.planner.stop_cost_sp2))
        rows = [
            _compared(small, large, measures.errors, settings)
            for large, small in itertools.pairwise(own)
        ]
        kept = claims.adjusted([row for row in rows if row is not None])
        medians = (f"{_median(c, measures.errors)} below {c.planner.stop_cost_sp2:g}" for c in own)
        told = f"median errors: {', '.join(medians)}; " + "; ".join(
            f"{row.quantity}: {evidence(row, 'smaller')}" for row in kept
        )
        told += " (reproduced: every step to a smaller value is significantly better)"
        verdict = claims.judge_better_than_all(why, kept, settings.significance)
        most = own[0].planner.ga.num_generations
        text = f"A smaller stopping value gives a better precision: at most {most} generations"
        judged.append(claim(text, "section 6", told, verdict, why))
    return judged


def _generations(results: Results, settings: ReportSettings) -> list[Claim]:
    """Judge that more generations are needed at the smallest stopping value."""
    why, judged, level = not_judged(results), [], settings.confidence
    least = min(c.planner.stop_cost_sp2 for c in results.main)
    for group in groups_but_for(results, "ga", "num_generations"):
        few, *_, many = sorted(group, key=lambda c: int(c.planner.ga.num_generations))
        if few.planner.stop_cost_sp2 > least:
            continue
        one, two = (Proportion(c.solved, c.done) for c in (many, few))
        attempts = (f"{c.column('term_attempts').mean():.2f}" for c in (many, few))
        spent = (_median(c, measures.effort) for c in (many, few))
        told = (
            f"runs with a solution: {measures.text(one, level)} with at most "
            f"{many.planner.ga.num_generations} generations, {measures.text(two, level)} with "
            f"{few.planner.ga.num_generations}; {_fisher(one, two)}; mean attempts "
            f"{' and '.join(attempts)}, median evaluations {' and '.join(spent)}"
        )
        text = f"More generations find more solutions where the search stops below {least:g}"
        judged.append(
            claim(text, "section 6", told, judge_greater(why, one, two, settings.significance), why)
        )
    return judged


def _coding(results: Results, settings: ReportSettings) -> list[Claim]:
    """Judge real against binary coding."""
    why, judged = not_judged(results), []
    for group in groups_but_for(results, "ga"):
        coded = {c.planner.ga.component: c for c in group}
        if not {"real_genetic", "binary_genetic"} <= set(coded):
            continue
        real, binary = coded["real_genetic"], coded["binary_genetic"]
        for what, values, word in (
            ("position error", measures.errors, "smaller"),
            ("evaluations to a solution", measures.effort, "fewer"),
        ):
            row = _compared(real, binary, values, settings)
            told = f"median {_median(real, values)} against {_median(binary, values)}"
            told += f"; {evidence(row, word)}" if row else ""
            verdict = claims.judge_better(why, row, settings.significance)
            text = (
                f"Real coding performs better than binary coding, judged by {what}: {real.label} "
                f"against {binary.label}"
            )
            judged.append(claim(text, "section 2", told, verdict, why))
    return judged


def _blindness(
    results: Results, settings: ReportSettings, refuted: dict[str, Refuted]
) -> list[Claim]:
    """Judge that the scene is not trivial: an arm that ignores obstacles meets them."""
    why, judged = not_judged(results), []
    for group in groups_but_for(results, "collision", "blind"):
        seeing, blind = sorted(group, key=lambda c: bool(c.planner.collision.blind))
        one, two = refuted[blind.label].anywhere, refuted[seeing.label].anywhere
        text = f"An arm that ignores obstacles collides: {blind.label} against {seeing.label}"
        verdict = judge_greater(why, one, two, settings.significance)
        judged.append(claim(text, QUESTION, _shares(one, two, settings), verdict, why))
    return judged


def _chance(results: Results, settings: ReportSettings) -> list[Claim]:
    """Judge evolution against random search."""
    why, judged = not_judged(results), []
    for control in (c for c in results.with_data if c.is_control):
        for own in (c for c in results.with_data if not c.is_control and _wrapped_by(control, c)):
            one, two = (Proportion(c.solved, c.done) for c in (own, control))
            spent = (f"{c.spread('evaluations').median:.0f}" for c in (own, control))
            told = (
                f"runs with a solution: {_shares(one, two, settings)}; median evaluations "
                f"{' against '.join(spent)}"
            )
            text = f"Evolution finds what chance does not: {own.label} against {control.label}"
            verdict = judge_greater(why, one, two, settings.significance)
            judged.append(claim(text, QUESTION, told, verdict, why))
    return judged


def _positions(
    results: Results, settings: ReportSettings, refuted: dict[str, Refuted]
) -> list[Claim]:
    """Judge what swept chords, and more positions with chords.

    Do to contacts between tested positions.
    """
    why, pairs = not_judged(results), []
    counts = sorted({int(c.planner.collision.num_positions) for c in results.main})
    for group in groups_but_for(results, "collision", "swept"):
        if group[0].planner.collision.num_positions == counts[0]:
            pairs.append(
                tuple(sorted(group, key=lambda c: str(c.planner.collision.swept), reverse=True))
            )
    for group in groups_but_for(results, "collision", "num_positions"):
        if group[0].planner.collision.swept == "chords":
            coarse, *finer = sorted(group, key=lambda c: int(c.planner.collision.num_positions))
            pairs += [(coarse, fine) for fine in finer]
    found = [tuple(refuted[c.label].anywhere for c in pair) for pair in pairs]
    p_values = holm([fisher_exact(one, two) for one, two in found])
    judged = []
    for (coarse, fine), (one, two), p in zip(pairs, found, p_values, strict=True):
        told = f"{_shares(two, one, settings)}; adjusted (Holm) {markdown.p_value(p)}"
        text = f"Fewer accepted motions touch an obstacle: {fine.label} against {coarse.label}"
        verdict = judge_greater(why, one, two, settings.significance, p)
        judged.append(claim(text, QUESTION, told, verdict, why))
    for _, fine in pairs:
        two = refuted[fine.label].anywhere
        if fine.planner.collision.num_positions > counts[0]:
            told = f"refuted: {measures.text(two, settings.confidence)} (reproduced: none)"
            verdict = claims.judge_all(why, two.total - two.having, two.total, fine.solved)
            text = (
                f"M = {fine.planner.collision.num_positions} removes contacts altogether: "
                f"{fine.label}"
            )
            judged.append(claim(text, QUESTION, told, verdict, why))
    return judged


def _wrapped_by(control: ConditionResults, other: ConditionResults) -> bool:
    """Whether a control stands beside this very planner, in the same scene."""
    same_scene = (control.condition.robot, control.condition.scenario) == (
        other.condition.robot,
        other.condition.scenario,
    )
    return same_scene and control.planner == other.planner


def _compared(
    better: ConditionResults,
    other: ConditionResults,
    values: Callable[[ConditionResults], FloatArray],
    settings: ReportSettings,
) -> Comparison | None:
    name = f"{better.label} against {other.label}"
    return generic.compare_on_common_seeds(better, other, name, True, values, settings)


def _median(condition: ConditionResults, values: Callable[[ConditionResults], FloatArray]) -> str:
    value = float(np.median(values(condition)))
    return markdown.number(float(round(value)) if 1e3 < value < np.inf else value)


def _shares(one: Proportion, two: Proportion, settings: ReportSettings) -> str:
    return (
        f"{' against '.join(measures.text(p, settings.confidence) for p in (one, two))}; "
        f"{_fisher(one, two)}"
    )


def _fisher(one: Proportion, two: Proportion) -> str:
    return f"Fisher's exact p = {markdown.p_value(fisher_exact(one, two))}"
