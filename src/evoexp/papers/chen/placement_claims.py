"""What Chen & Zalzala (1995) claim of docking postures.

Judged against exact optima and other methods.
"""

import math

import numpy as np

from evoexp.papers.chen.cases import CLOSE, Case
from evoexp.report import claims, markdown
from evoexp.report.claims import Claim, Comparison
from evoexp.report.judging import claim, evidence, not_judged
from evoexp.report.pages import generic
from evoexp.report.proportions import Proportion, fisher_exact
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import Results

ROUNDED = 0.005  # half a unit in the last place of what the paper prints
PAPER_S = 2.0  # [s] "2 seconds", on a Sun Sparc station


def of_cases(results: Results, cases: list[Case], settings: ReportSettings) -> tuple[Claim, ...]:
    """Return all claims."""
    why = not_judged(results)
    found: list[Claim] = []
    for case in cases:
        if case.printed is not None and case.optimum is not None:
            found += _printed(case, why)
    found += _against_search(cases, why, settings)
    found += _against_conventional(cases, why, settings)
    found += _seconds(cases, why)
    return tuple(found)


def _printed(case: Case, why: str) -> list[Claim]:
    """Judge the numbers that the paper prints of a posture."""
    assert case.printed is not None
    assert case.optimum is not None
    printed, rows = case.printed, []
    exact = case.measured(case.optimum.solutions[case.optimum.best_replicate])
    if not math.isnan(printed.value):
        best, name = exact[printed.term], printed.term.replace("_", " ")
        agrees = abs(best - printed.value) <= ROUNDED
        told = f"at the exact optimum {markdown.number(best)}"
        if case.any.planner.objective.avoidances:
            told += (
                f" (E = {markdown.number(case.least)}, of which the obstacle "
                f"{markdown.number(exact['obstacle'])})"
            )
        verdict = claims.REPRODUCED if agrees else claims.CONTRADICTED
        if case.name == "obstacle and platform":
            told += "; where the obstacle stands is not printed, (5.2, 0) is assumed"
            verdict = claims.REPRODUCED if agrees else claims.INCONCLUSIVE
        text = f"{case.name}: the best posture has a {name} of {printed.value:g}"
        rows.append(
            claim(
                text,
                f"section 4.2, {printed.figure}",
                told,
                verdict if not why else claims.NOT_JUDGED,
                why,
            )
        )
    if printed.angles is not None:
        cost = case.measured(printed.angles)["cost"]
        gap = float(case.gaps(np.array([cost]))[0])
        told = f"E = {cost:.6g} there, {case.least:.6g} at the optimum: {100 * gap:.2g} % above it"
        verdict = claims.REPRODUCED if gap <= CLOSE[1] else claims.CONTRADICTED
        text = (
            f"{case.name}: (θ1, θ2) = ({printed.angles[0]:g}, {printed.angles[1]:g})° is at or "
            "near the optimum"
        )
        text = text.replace("-", "−")
        rows.append(
            claim(
                text,
                f"section 4.2, {printed.figure}",
                told,
                verdict if not why else claims.NOT_JUDGED,
                why,
            )
        )
    return rows


def _against_search(cases: list[Case], why: str, settings: ReportSettings) -> list[Claim]:
    """Judge that the genetic algorithm beats random search at equal evaluations.

    With and without elitism.
    """
    told: list[tuple[str, Case, Comparison]] = []
    for case in cases:
        for name, own in (("without elitism", case.plain), ("with elitism", case.elitist)):
            if own is None or case.search is None:
                continue
            column = generic.by_column("best_cost")
            found = generic.compare_on_common_seeds(
                own, case.search, "best cost", True, column, settings
            )
            if found is not None:
                told.append((name, case, found))
    compared = claims.adjusted([found for _, _, found in told])
    rows = []
    for (name, case, _), found in zip(told, compared, strict=True):
        text = (
            f"{case.name}: the genetic algorithm, {name}, is better than random search (equal "
            "evaluations)"
        )
        verdict = claims.judge_better(why, found, settings.significance)
        rows.append(claim(text, "section 1", evidence(found, "lower E"), verdict, why))
    return rows


def _against_conventional(cases: list[Case], why: str, settings: ReportSettings) -> list[Claim]:
    """Judge that conventional methods get stuck, and that the genetic algorithm does better."""
    rows = []
    for case in cases:
        for method, ends in case.ends().items():
            at_best = case.within(ends[:, 2], CLOSE[1])
            stuck = Proportion(at_best.total - at_best.having, at_best.total)
            low, high = stuck.interval(settings.confidence)
            told = (
                f"{stuck.having} of {stuck.total} starts end more than {100 * CLOSE[1]:g} % above "
                f"the optimum ({100 * low:.0f}–{100 * high:.0f} %)"
            )
            verdict = claims.REPRODUCED if stuck.having else claims.CONTRADICTED
            verdict = claims.NOT_JUDGED if why else verdict
            rows.append(
                claim(
                    f"{case.name}: the {method} method gets stuck",
                    "sections 1 and 4.2",
                    told,
                    verdict,
                    why,
                )
            )
            if case.elitist is not None:
                rows.append(_better(case, method, at_best, why, settings))
    return rows


def _better(
    case: Case, method: str, at_best: Proportion, why: str, settings: ReportSettings
) -> Claim:
    """Judge a run of the genetic algorithm against one start of a method.

    And tell what either costs.
    """
    assert case.elitist is not None
    assert case.conventional is not None
    own = case.within(case.elitist.column("best_cost"), CLOSE[1])
    p = fisher_exact(own, at_best)
    verdict = claims.INCONCLUSIVE
    if p < settings.significance:
        verdict = claims.REPRODUCED if own.share > at_best.share else claims.CONTRADICTED
    from_key = {
        "Newton-type": "newton",
        "Newton-type, smooth form": "bounded",
        "subgradient": "subgradient",
    }[method]
    each = float(case.conventional.column(f"term_{from_key}_evaluations")[0])
    effort = case.elitist.column("evaluations").mean()
    told = (
        f"within {100 * CLOSE[1]:g} % of the optimum: {100 * own.share:.0f} % of runs with "
        f"elitism, {100 * at_best.share:.0f} % of starts, p = {markdown.p_value(p)}; a run takes "
        f"{effort:.0f} evaluations, a start {each:.0f} (and exact derivatives, but for the "
        f"subgradient): per success {_per(effort, own.share)} against {_per(each, at_best.share)}"
    )
    text = (
        f"{case.name}: a run of the genetic algorithm is better than a start of the {method} method"
    )
    return claim(text, "abstract", told, claims.NOT_JUDGED if why else verdict, why)


def _per(effort: float, share: float) -> str:
    return f"{effort / share:.0f}" if share else "∞"


def _seconds(cases: list[Case], why: str) -> list[Claim]:
    """Judge that the minimax problem takes seconds."""
    rows = []
    for case in cases:
        if case.name != "minimax torque" or case.plain is None:
            continue
        seconds = case.plain.column("cpu_s")
        verdict = claims.REPRODUCED if float(np.median(seconds)) <= PAPER_S else claims.CONTRADICTED
        told = (
            f"{1000 * float(np.median(seconds)):.1f} ms of this machine per run (median), verdict "
            "and log included"
        )
        text = (
            f"{case.name}: solved in {PAPER_S:g} seconds (the subgradient algorithm of Pin & "
            "Culioli: 15 minutes)"
        )
        rows.append(claim(text, "section 4.2 A", told, claims.NOT_JUDGED if why else verdict, why))
    return rows
