"""The claims of Chen & Zalzala 1995 on docking postures, judged by exact optima and controls."""

from collections.abc import Iterator

import numpy as np

from evoexp.papers.chen.cases import CLOSE, METHODS, Case
from evoexp.report.kit import (
    Claim,
    Judge,
    Proportion,
    ReportSettings,
    Results,
    by_column,
    compared,
    fisher_exact,
    judging,
    markdown,
    verdicts,
)

ROUNDED = 0.005  # half a unit in the last place of the printed numbers
PAPER_S = 2.0  # [s] "2 seconds", on a Sun Sparc station


def judge_cases(results: Results, cases: list[Case], settings: ReportSettings) -> tuple[Claim, ...]:
    """Judge all claims; the optimum of every case is known."""
    judge = judging.judge(results, settings)
    return (
        *(one for case in cases for one in (*_value(judge, case), *_angles(judge, case))),
        *_against_search(judge, cases, settings),
        *(one for case in cases for one in _against_conventional(judge, case, settings)),
        *(one for case in cases for one in _seconds(judge, case)),
    )


def _value(judge: Judge, case: Case) -> Iterator[Claim]:
    """Judge the number that the paper prints of its best posture."""
    printed = case.printed
    if printed is None or np.isnan(printed.value):
        return
    exact = case.measured(case.optimal_angles)
    best = exact[printed.term]
    told = f"at the exact optimum {markdown.number(best)}"
    if case.conditions[0].planner.objective.avoidances:
        told += (
            f" (E = {markdown.number(case.least)}, of which the obstacle "
            f"{markdown.number(exact['obstacle'])})"
        )
    agrees: bool | None = abs(best - printed.value) <= ROUNDED
    if case.name == "obstacle and platform":
        told += "; where the obstacle stands is not printed, (5.2, 0) is assumed"
        agrees = agrees or None
    name = printed.term.replace("_", " ")
    yield judge.claim(
        text=f"{case.name}: the best posture has a {name} of {printed.value:g}",
        source=f"section 4.2, {printed.figure}",
        evidence=told,
        verdict=verdicts.judged(agrees),
    )


def _angles(judge: Judge, case: Case) -> Iterator[Claim]:
    """Judge that the printed angles are near the optimum."""
    printed = case.printed
    if printed is None or printed.angles is None:
        return
    cost = case.measured(printed.angles)["cost"]
    gap = float(case.gaps(np.array([cost]))[0])
    yield judge.claim(
        text=(
            f"{case.name}: (θ1, θ2) = ({printed.angles[0]:g}, {printed.angles[1]:g})° is at or "
            "near the optimum"
        ).replace("-", "−"),
        source=f"section 4.2, {printed.figure}",
        evidence=(
            f"E = {cost:.6g} there, {case.least:.6g} at the optimum: {100 * gap:.2g} % above it"
        ),
        verdict=verdicts.judged(gap <= CLOSE[1]),
    )


def _against_search(judge: Judge, cases: list[Case], settings: ReportSettings) -> list[Claim]:
    """Judge that the genetic algorithm, with and without elitism, beats random search."""
    pairs = {
        f"{case.name}: the genetic algorithm, {name}, is better than random search (equal "
        "evaluations)": (own, case.search)
        for case in cases
        for name, own in (("without elitism", case.plain), ("with elitism", case.elitist))
        if own is not None and case.search is not None
    }
    texts = {own.label: text for text, (own, _) in pairs.items()}
    costs = by_column("best_cost")
    rows = compared(pairs.values(), costs, settings, named=lambda c, _: texts[c.label])
    return [judge.better(row.quantity, "section 1", row, "lower E") for row in rows]


def _against_conventional(judge: Judge, case: Case, settings: ReportSettings) -> Iterator[Claim]:
    """Judge that conventional methods get stuck, and that the genetic algorithm does better."""
    for method, ends in case.ends().items():
        at_best = case.within(ends[:, 2], CLOSE[1])
        stuck = Proportion(at_best.total - at_best.having, at_best.total)
        text, verdict = f"{case.name}: the {method} method gets stuck", stuck.having > 0
        yield judge.claim(
            text=text,
            source="sections 1 and 4.2",
            evidence=(
                f"{stuck.having} of {stuck.total} starts end more than {100 * CLOSE[1]:g} % "
                "above "
                f"the optimum ({markdown.percent(stuck.interval(settings.confidence))})"
            ),
            verdict=verdicts.judged(verdict),
        )
        if case.elitist is not None:
            yield _better(judge, case, method, at_best)


def _better(judge: Judge, case: Case, method: str, at_best: Proportion) -> Claim:
    """Judge a run of the genetic algorithm against one start of a method, and their efforts."""
    assert case.elitist is not None
    assert case.conventional is not None
    own = case.within(case.elitist.column("best_cost"), CLOSE[1])
    key = next(key for key, name in METHODS.items() if name == method)
    each = float(case.conventional.column(f"term_{key}_evaluations")[0])
    effort = case.elitist.column("evaluations").mean()
    return judge.greater(
        text=(
            f"{case.name}: a run of the genetic algorithm is better than a start of the {method} "
            "method"
        ),
        source="abstract",
        evidence=(
            f"within {100 * CLOSE[1]:g} % of the optimum: {100 * own.share:.0f} % of runs with "
            f"elitism, {100 * at_best.share:.0f} % of starts, p = "
            f"{markdown.p_value(fisher_exact(own, at_best))}; a run takes "
            f"{effort:.0f} evaluations, a start {each:.0f} (and exact derivatives, but for the "
            f"subgradient): per success {_per(effort, own.share)} against "
            f"{_per(each, at_best.share)}"
        ),
        one=own,
        two=at_best,
    )


def _per(effort: float, share: float) -> str:
    """Return an effort per success in words."""
    return f"{effort / share:.0f}" if share else "∞"


def _seconds(judge: Judge, case: Case) -> Iterator[Claim]:
    """Judge that the minimax problem takes seconds."""
    if case.name != "minimax torque" or case.plain is None:
        return
    seconds = float(np.median(case.plain.column("cpu_s")))
    yield judge.claim(
        text=(
            f"{case.name}: solved in {PAPER_S:g} seconds (the subgradient algorithm of Pin & "
            "Culioli: 15 minutes)"
        ),
        source="section 4.2 A",
        evidence=(
            f"{1000 * seconds:.1f} ms of this machine per run (median), verdict and log included"
        ),
        verdict=verdicts.judged(seconds <= PAPER_S),
    )
