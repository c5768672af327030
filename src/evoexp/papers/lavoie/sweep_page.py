"""Lavoie & Boudreau 2001: settings side by side, the first condition of an arm against each."""

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np

from evoexp.papers.lavoie import claims, measures
from evoexp.papers.lavoie import page as whole_page
from evoexp.papers.lavoie.figures import run_distributions
from evoexp.papers.lavoie.measures import RefutedMotions
from evoexp.papers.lavoie.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import judging, markdown, sweep_figures

Group = tuple[kit.ConditionResults, ...]
BOUND = 1.0  # x of P(position error < x) by which the paper's percentages differ most


def judge_sweep(
    results: kit.Results, settings: kit.ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[kit.Claim, ...]:
    """Judge the claims about the settings in which conditions differ."""
    judge = judging.judge(results, settings, RULES)
    return (
        *_success(judge, results),
        *_precision(judge, results),
        *_generations(judge, results),
        *_coding(judge, results),
        *_blindness(judge, results, refuted),
        *claims.judge_controls(judge, results),
        *_positions(judge, results, refuted),
    )


def groups_but_for(results: kit.Results, *path: str) -> list[Group]:
    """Return groups of conditions, without controls, that agree in all settings but one.

    The names of the path lead to it: "ga", "num_generations".
    """

    def key(condition: kit.ConditionResults) -> tuple[Any, ...]:
        part = planner = condition.planner.canonical()
        for name in path[:-1]:
            part[name] = part = dict(part[name])
        part.pop(path[-1], None)
        scene = condition.condition.robot, condition.condition.scenario
        return *(one.canonical() for one in scene), planner

    return [group for group in kit.grouped(results.main, key) if len(group) > 1]


def _success(judge: kit.Judge, results: kit.Results) -> list[kit.Claim]:
    """Judge the printed percentages by either reading of a success, each a family of tests."""
    by_reading: dict[str, list[kit.ConditionResults]] = {}
    for condition in itertools.chain(*groups_but_for(results, "success")):
        by_reading.setdefault(condition.planner.success, []).append(condition)
    families = (claims.percentages(judge, own) for own in by_reading.values())
    return list(itertools.chain(*families))


def _precision(judge: kit.Judge, results: kit.Results) -> Iterator[kit.Claim]:
    """Judge that smaller stopping values give smaller errors, step by step."""
    for group in groups_but_for(results, "stop_cost_sp2"):
        own = sorted(group, key=lambda c: -float(c.planner.stop_cost_sp2))
        steps = [(small, large) for large, small in itertools.pairwise(own)]
        rows = kit.compared(steps, measures.errors, judge.settings, named=_against)
        medians = (f"{_median(c, measures.errors)} below {c.planner.stop_cost_sp2:g}" for c in own)
        told = "; ".join(f"{row.quantity}: {kit.evidence(row, 'smaller')}" for row in rows)
        where = f": at most {own[0].planner.ga.num_generations} generations"
        told = f"median errors: {', '.join(medians)}; step by step: {told}"
        yield judge.on("precision", where=where).better_than_all(told, rows)


def _generations(judge: kit.Judge, results: kit.Results) -> Iterator[kit.Claim]:
    """Judge that more generations are needed at the smallest stopping value."""
    least = min(c.planner.stop_cost_sp2 for c in results.main)
    for group in groups_but_for(results, "ga", "num_generations"):
        few, *_, many = sorted(group, key=lambda c: int(c.planner.ga.num_generations))
        if few.planner.stop_cost_sp2 > least:
            continue
        attempts = (f"{c.column('term_attempts').mean():.2f}" for c in (many, few))
        spent = (_median(c, measures.effort) for c in (many, few))
        one, two = kit.success(many), kit.success(few)
        told = (
            f"runs with a solution: {judge.share(one, 1)} with at most "
            f"{many.planner.ga.num_generations} generations, {judge.share(two, 1)} "
            f"with {few.planner.ga.num_generations}; {kit.fisher_evidence(one, two)}; mean "
            f"attempts {' and '.join(attempts)}, median evaluations {' and '.join(spent)}"
        )
        yield judge.on("generations", least=f"{least:g}").greater(told, one, two)


def _coding(judge: kit.Judge, results: kit.Results) -> Iterator[kit.Claim]:
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
            row = judge.compared(*pair, values)
            where = f", judged by {what}: {_against(*pair)}"
            told = f"median {' against '.join(_median(c, values) for c in pair)}; {{}}"
            yield judge.on("coding", where=where).better(row, word, told)


def _blindness(
    judge: kit.Judge, results: kit.Results, refuted: dict[str, RefutedMotions]
) -> Iterator[kit.Claim]:
    """Judge that the scene is not trivial: an arm that ignores obstacles meets them."""
    for group in groups_but_for(results, "collision", "blind"):
        seeing, blind = sorted(group, key=lambda c: bool(c.planner.collision.blind))
        one, two = refuted[blind.label].anywhere, refuted[seeing.label].anywhere
        hearing = judge.on("blind_collides", who=_against(blind, seeing))
        yield hearing.greater(_shares(judge, one, two), one, two)


def _positions(
    judge: kit.Judge, results: kit.Results, refuted: dict[str, RefutedMotions]
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
        told = f"{_shares(judge, two, one)}; adjusted (Holm) {markdown.p_value(p)}"
        yield judge.on("fewer_contacts", who=_against(fine, coarse)).greater(told, one, two, p)
    for (_, fine), (_, two) in zip(pairs, counts, strict=True):
        positions = fine.planner.collision.num_positions
        if positions > least:
            told = f"refuted: {judge.share(two, 1)}"
            hearing = judge.on("no_contacts", positions=positions, who=fine.label)
            runs = two.total - two.having, two.total, fine.solved
            yield hearing.every(told, *runs)


def _against(one: kit.ConditionResults, two: kit.ConditionResults) -> str:
    return f"{one.label} against {two.label}"


def _median(condition: kit.ConditionResults, values: kit.Values) -> str:
    value = float(np.median(values(condition)))
    return markdown.number(float(round(value)) if 1e3 < value < np.inf else value)


def _shares(judge: kit.Judge, one: kit.Proportion, two: kit.Proportion) -> str:
    shares = " against ".join(judge.share(proportion, 1) for proportion in (one, two))
    return f"{shares}; {kit.fisher_evidence(one, two)}"


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of a sweep, or that of the experiment if there is nothing to compare."""
    if not measures.fits(results) or len(results.with_data) < 2:
        return whole_page.page(results, settings)
    refuted = {c.label: measures.refuted(c) for c in results.with_data}
    found = kit.compare_families(map(kit.Family.of, arms(results)), quantities(results), settings)
    return PAPER.page(
        results,
        "sweep",
        quantities=whole_page.quantities(results),
        claims=judge_sweep(results, settings, refuted),
        checks=_checks(results, settings, refuted),
        comparisons=kit.headed(found),
        drawings=_drawings(results, settings, found, refuted),
    )


def arms(results: kit.Results) -> tuple[tuple[kit.ConditionResults, ...], ...]:
    """Return the conditions arm by arm, told by their numbers of joints."""
    return kit.grouped(results.with_data, kit.num_joints)


def quantities(results: kit.Results) -> tuple[kit.Measure, ...]:
    """Return the quantities in which the first condition of an arm is compared with its others."""
    return (
        kit.Measure("position error", measures.errors, results.with_data[0].condition.length_unit),
        kit.Measure("evaluations to a solution", measures.effort),
    )


def _checks(
    results: kit.Results, settings: kit.ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[tuple[str, str], ...]:
    """Return a row of shares per condition, and rows on the worth of agreement with Fig. 3."""
    rows = []
    for c in results.with_data:
        found = refuted[c.label]
        told = {
            "with a solution": kit.success(c),
            f"error below {BOUND:g}": measures.below(c, BOUND),
            "accepted and in contact": found.anywhere,
            "on SP1": found.sp1,
            "on SP2": found.sp2,
        }
        texts = [
            f"{name}: {p.with_interval(settings.confidence, 1)}"
            for name, p in told.items()
            if p.total
        ]
        if not c.is_control:
            texts.append(f"mean attempts: {c.column('term_attempts').mean():.2f}")
        rows.append((f"{c.label}: shares of runs", "; ".join(texts)))
    others = any(c.is_control or c.planner.collision.blind for c in results.with_data)
    weak = () if others or _paths_differ(results) else _weak_evidence(results, settings)
    return *rows, *weak


def _weak_evidence(results: kit.Results, settings: kit.ReportSettings) -> Iterator[tuple[str, str]]:
    """Count the settings of each arm that agree with a printed percentage.

    The more settings agree, the less agreement says about any of them.
    """
    for own in arms(results):
        for printed in (one for one in measures.printed(own[0]) if one.bound == BOUND):
            intervals = {
                c.label: kit.newcombe(
                    measures.below(c, BOUND), printed.proportion, settings.confidence
                )
                for c in own
            }
            same = [label for label, (low, high) in intervals.items() if low <= 0.0 <= high]
            what = (
                f"{own[0].label} and others: whose errors below {BOUND:g} cannot be told from the "
                f"printed {100 * printed.proportion.share:.1f} %"
            )
            text = (
                f"{len(same)} of {len(own)}{': ' if same else ''}{', '.join(same)} (0 within "
                f"Newcombe's {100 * settings.confidence:g} % interval of the difference; at most "
                f"{max(c.done for c in own)} runs each). Agreement with Fig. 3 is weak evidence "
                "for a setting as long as others agree as well"
            )
            yield (what, text)


def _paths_differ(results: kit.Results) -> bool:
    """Return whether conditions differ in the places at which they test paths for collision."""
    collisions = (c.planner.collision for c in results.with_data)
    return len({(model.num_positions, model.swept) for model in collisions}) > 1


def _drawings(
    results: kit.Results,
    settings: kit.ReportSettings,
    found: tuple[kit.FamilyComparison, ...],
    refuted: dict[str, RefutedMotions],
) -> tuple[kit.Drawing, ...]:
    """Return the figures: stopping values where they differ, shares, values, effect sizes."""
    stopping_values = PAPER.drawing(
        "stopping",
        run_distributions.STOPPING,
        results.with_data,
        results,
        measures.errors,
        measures.effort,
    )
    differ = len({c.planner.stop_cost_sp2 for c in results.with_data}) > 1
    one_arm = len(arms(results)) == 1
    caption = (
        f"With Wilson's {100 * settings.confidence:g} % interval, counts beside. Motions that "
        "touch an obstacle are counted among the accepted ones. A dashed line: the percentage "
        "that the paper prints, where all conditions are of one arm."
    )
    printed = measures.printed(results.with_data[0]) if one_arm else []
    references = {f"error below {p.bound:g}": p.proportion.share for p in printed}
    shares = _share_rows(results, refuted)
    values = {f"{one.name} [{one.unit}]": one.values for one in quantities(results)}
    better = "the first one is better than the other one"
    return (
        *([stopping_values] if differ else []),
        sweep_figures.shares_drawing(results, settings, shares, caption, references),
        sweep_figures.values_drawing(results, values),
        *sweep_figures.effects_drawings(
            results, settings, kit.rows_by_name(found), "the first condition of an arm", better
        ),
    )


def _share_rows(
    results: kit.Results, refuted: dict[str, RefutedMotions]
) -> list[tuple[str, int, str, kit.Proportion]]:
    """Return the counts that are drawn, by sub-path if the tests of paths differ."""
    rows = []
    for position, c in enumerate(results.with_data):
        found = refuted[c.label]
        told = {"touch an obstacle": found.anywhere, "on SP1": found.sp1, "on SP2": found.sp2}
        if not _paths_differ(results):
            told = {
                f"error below {BOUND:g}": measures.below(c, BOUND),
                "with a solution": kit.success(c),
                "touch an obstacle": found.anywhere,
            }
        rows += [(name, position, c.label, proportion) for name, proportion in told.items()]
    return rows
