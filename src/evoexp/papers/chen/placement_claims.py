"""The claims of Chen & Zalzala 1995 on docking postures, judged by exact optima and controls."""

from collections.abc import Iterator

import numpy as np

from evoexp.papers.chen.cases import CLOSE, METHODS, Case
from evoexp.report.kit import (
    Claim,
    ConditionResults,
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
    minimax = [case for case in cases if case.name == "minimax torque"]
    return (
        *(one for case in cases for one in _printed_posture(judge, case)),
        *_against_search(judge, cases, settings),
        *(one for case in cases for one in _against_conventional(judge, case, settings)),
        *(_seconds(judge, case.name, case.plain) for case in minimax if case.plain is not None),
    )


def _printed_posture(judge: Judge, case: Case) -> Iterator[Claim]:
    """Judge the number that the paper prints of its best posture, and the printed angles."""
    if not np.isnan(case.printed.value):
        yield _value(judge, case)
    if case.printed.angles is not None:
        yield _angles(judge, case, case.printed.angles)


def _value(judge: Judge, case: Case) -> Claim:
    """Judge the printed number by that of the exact optimum."""
    printed, exact = case.printed, case.measured(case.optimal_angles)
    best, name = exact[printed.term], printed.term.replace("_", " ")
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
    return judge.claim(
        text=f"{case.name}: the best posture has a {name} of {printed.value:g}",
        source=f"section 4.2, {printed.figure}",
        evidence=told,
        verdict=verdicts.judged(agrees),
    )


def _angles(judge: Judge, case: Case, angles: tuple[float, float]) -> Claim:
    """Judge that the printed angles are near the optimum."""
    cost = case.measured(angles)["cost"]
    gap = float(case.gaps(np.array([cost]))[0])
    pair = f"({angles[0]:g}, {angles[1]:g})°".replace("-", "−")
    return judge.claim(
        text=f"{case.name}: (θ1, θ2) = {pair} is at or near the optimum",
        source=f"section 4.2, {case.printed.figure}",
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
        yield judge.claim(
            text=f"{case.name}: the {method} method gets stuck",
            source="sections 1 and 4.2",
            evidence=(
                f"{stuck.having} of {stuck.total} starts end more than {100 * CLOSE[1]:g} % above "
                f"the optimum ({markdown.percent(stuck.interval(settings.confidence))})"
            ),
            verdict=verdicts.judged(stuck.having > 0),
        )
        if case.elitist is not None:
            yield _better(judge, case, case.elitist, method, at_best)


def _better(
    judge: Judge, case: Case, elitist: ConditionResults, method: str, at_best: Proportion
) -> Claim:
    """Judge a run of the genetic algorithm against one start of a method, and their efforts."""
    assert case.conventional is not None
    own = case.within(elitist.column("best_cost"), CLOSE[1])
    of_start = case.conventional.column(f"term_{METHODS[method]}_evaluations")[0]
    efforts = elitist.column("evaluations").mean(), of_start
    run, start = (
        f"{effort / share:.0f}" if share else "∞"
        for effort, share in zip(efforts, (own.share, at_best.share), strict=True)
    )
    return judge.greater(
        text=(
            f"{case.name}: a run of the genetic algorithm is better than a start of the {method} "
            "method"
        ),
        source="abstract",
        evidence=(
            f"within {100 * CLOSE[1]:g} % of the optimum: {100 * own.share:.0f} % of runs with "
            f"elitism, {100 * at_best.share:.0f} % of starts, p = "
            f"{markdown.p_value(fisher_exact(own, at_best))}; a run takes {efforts[0]:.0f} "
            f"evaluations, a start {efforts[1]:.0f} (and exact derivatives, but for the "
            f"subgradient): per success {run} against {start}"
        ),
        one=own,
        two=at_best,
    )


def _seconds(judge: Judge, name: str, condition: ConditionResults) -> Claim:
    """Judge that the minimax problem takes seconds."""
    seconds = float(np.median(condition.column("cpu_s")))
    return judge.claim(
        text=(
            f"{name}: solved in {PAPER_S:g} seconds (the subgradient algorithm of Pin & Culioli: "
            "15 minutes)"
        ),
        source="section 4.2 A",
        evidence=(
            f"{1000 * seconds:.1f} ms of this machine per run (median), verdict and log included"
        ),
        verdict=verdicts.judged(seconds <= PAPER_S),
    )
