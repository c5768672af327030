"""The claims of Lavoie & Boudreau 2001 that sweeps over settings judge, and our own questions."""

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np

from evoexp.papers.lavoie import control_claims, measures
from evoexp.papers.lavoie.claims import percentages
from evoexp.papers.lavoie.measures import RefutedMotions
from evoexp.papers.lavoie.rules import RULES
from evoexp.report import kit
from evoexp.report.kit import judging, markdown

Group = tuple[kit.ConditionResults, ...]


def judge_sweep(
    results: kit.Results, settings: kit.ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[kit.Claim, ...]:
    """Judge the claims about the settings in which conditions differ."""
    judge = judging.judge(results, settings, RULES)
    return (
        *_success(judge, results, settings),
        *_precision(judge, results, settings),
        *_generations(judge, results, settings),
        *_coding(judge, results, settings),
        *_blindness(judge, results, settings, refuted),
        *control_claims.judge_controls(judge, results, settings),
        *_positions(judge, results, settings, refuted),
    )


def groups_but_for(results: kit.Results, *path: str) -> list[Group]:
    """Return groups of conditions that agree in all settings of the planner but one.

    Args:
        results: With data; controls are left out.
        path: Names that lead to the setting: "ga", "num_generations".
    """

    def key(condition: kit.ConditionResults) -> tuple[Any, ...]:
        part = planner = condition.planner.canonical()
        for name in path[:-1]:
            part[name] = part = dict(part[name])
        part.pop(path[-1], None)
        scene = condition.condition.robot, condition.condition.scenario
        return *(one.canonical() for one in scene), planner

    return [group for group in kit.grouped(results.main, key) if len(group) > 1]


def _success(
    judge: kit.Judge, results: kit.Results, settings: kit.ReportSettings
) -> list[kit.Claim]:
    """Judge the printed percentages by either reading of a success, each a family of tests."""
    by_reading: dict[str, list[kit.ConditionResults]] = {}
    for condition in itertools.chain(*groups_but_for(results, "success")):
        by_reading.setdefault(condition.planner.success, []).append(condition)
    families = (percentages(judge, own, settings.confidence) for own in by_reading.values())
    return list(itertools.chain(*families))


def _precision(
    judge: kit.Judge, results: kit.Results, settings: kit.ReportSettings
) -> Iterator[kit.Claim]:
    """Judge that smaller stopping values give smaller errors, step by step."""
    for group in groups_but_for(results, "stop_cost_sp2"):
        own = sorted(group, key=lambda c: -float(c.planner.stop_cost_sp2))
        steps = [(small, large) for large, small in itertools.pairwise(own)]
        rows = kit.compared(steps, measures.errors, settings, named=_against)
        medians = (f"{_median(c, measures.errors)} below {c.planner.stop_cost_sp2:g}" for c in own)
        told = "; ".join(f"{row.quantity}: {kit.evidence(row, 'smaller')}" for row in rows)
        where = f": at most {own[0].planner.ga.num_generations} generations"
        told = f"median errors: {', '.join(medians)}; step by step: {told}"
        yield judge.on("precision", where=where).better_than_all(told, rows)


def _generations(
    judge: kit.Judge, results: kit.Results, settings: kit.ReportSettings
) -> Iterator[kit.Claim]:
    """Judge that more generations are needed at the smallest stopping value."""
    level = settings.confidence
    least = min(c.planner.stop_cost_sp2 for c in results.main)
    for group in groups_but_for(results, "ga", "num_generations"):
        few, *_, many = sorted(group, key=lambda c: int(c.planner.ga.num_generations))
        if few.planner.stop_cost_sp2 > least:
            continue
        attempts = (f"{c.column('term_attempts').mean():.2f}" for c in (many, few))
        spent = (_median(c, measures.effort) for c in (many, few))
        one, two = kit.success(many), kit.success(few)
        told = (
            f"runs with a solution: {measures.text(one, level)} with at most "
            f"{many.planner.ga.num_generations} generations, {measures.text(two, level)} "
            f"with {few.planner.ga.num_generations}; {_fisher(one, two)}; mean "
            f"attempts {' and '.join(attempts)}, median evaluations {' and '.join(spent)}"
        )
        yield judge.on("generations", least=f"{least:g}").greater(told, one, two)


def _coding(
    judge: kit.Judge, results: kit.Results, settings: kit.ReportSettings
) -> Iterator[kit.Claim]:
    """Judge real against binary coding."""
    for group in groups_but_for(results, "ga"):
        coded = {c.planner.ga.component: c for c in group}
        if not {"real_genetic", "binary_genetic"} <= set(coded):
            continue
        pair = coded["real_genetic"], coded["binary_genetic"]
        for what, values, word in (
            ("position error", measures.errors, "smaller"),
            ("evaluations to a solution", measures.effort, "fewer"),
        ):
            row = next(iter(kit.compared([pair], values, settings)), None)
            where = f", judged by {what}: {_against(*pair)}"
            told = f"median {' against '.join(_median(c, values) for c in pair)}; {{}}"
            yield judge.on("coding", where=where).better(row, word, told)


def _blindness(
    judge: kit.Judge,
    results: kit.Results,
    settings: kit.ReportSettings,
    refuted: dict[str, RefutedMotions],
) -> Iterator[kit.Claim]:
    """Judge that the scene is not trivial: an arm that ignores obstacles meets them."""
    for group in groups_but_for(results, "collision", "blind"):
        seeing, blind = sorted(group, key=lambda c: bool(c.planner.collision.blind))
        one, two = refuted[blind.label].anywhere, refuted[seeing.label].anywhere
        hearing = judge.on("blind_collides", who=_against(blind, seeing))
        yield hearing.greater(_shares(one, two, settings), one, two)


def _positions(
    judge: kit.Judge,
    results: kit.Results,
    settings: kit.ReportSettings,
    refuted: dict[str, RefutedMotions],
) -> Iterator[kit.Claim]:
    """Judge that chords, and more positions with chords, leave fewer contacts between positions."""
    pairs: list[Group] = []  # (coarse, fine)
    least = min(int(c.planner.collision.num_positions) for c in results.main)
    for group in groups_but_for(results, "collision", "swept"):
        if group[0].planner.collision.num_positions == least:
            by_name = sorted(group, key=lambda c: str(c.planner.collision.swept), reverse=True)
            pairs.append(tuple(by_name))
    for group in groups_but_for(results, "collision", "num_positions"):
        if group[0].planner.collision.swept == "chords":
            coarse, *finer = sorted(group, key=lambda c: int(c.planner.collision.num_positions))
            pairs += [(coarse, fine) for fine in finer]
    # contacts of either condition, and the tests of all pairs as one family
    counts = [tuple(refuted[c.label].anywhere for c in pair) for pair in pairs]
    p_values = kit.holm([kit.fisher_exact(one, two) for one, two in counts])
    for (coarse, fine), (one, two), p in zip(pairs, counts, p_values, strict=True):
        told = f"{_shares(two, one, settings)}; adjusted (Holm) {markdown.p_value(p)}"
        yield judge.on("fewer_contacts", who=_against(fine, coarse)).greater(told, one, two, p)
    for (_, fine), (_, two) in zip(pairs, counts, strict=True):
        positions = fine.planner.collision.num_positions
        if positions > least:
            told = f"refuted: {measures.text(two, settings.confidence)}"
            hearing = judge.on("no_contacts", positions=positions, who=fine.label)
            runs = two.total - two.having, two.total, fine.solved
            yield hearing.every(told, *runs)


def _against(one: kit.ConditionResults, two: kit.ConditionResults) -> str:
    return f"{one.label} against {two.label}"


def _median(condition: kit.ConditionResults, values: kit.Values) -> str:
    value = float(np.median(values(condition)))
    return markdown.number(float(round(value)) if 1e3 < value < np.inf else value)


def _shares(one: kit.Proportion, two: kit.Proportion, settings: kit.ReportSettings) -> str:
    shares = " against ".join(measures.text(p, settings.confidence) for p in (one, two))
    return f"{shares}; {_fisher(one, two)}"


def _fisher(one: kit.Proportion, two: kit.Proportion) -> str:
    return f"Fisher's exact p = {markdown.p_value(kit.fisher_exact(one, two))}"
