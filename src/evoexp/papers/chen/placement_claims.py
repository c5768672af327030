"""The claims of Chen & Zalzala 1995 on docking postures, judged by exact optima and controls."""

from collections.abc import Iterator

import numpy as np

from evoexp.papers.chen.cases import METHODS, Case
from evoexp.papers.chen.posture_claims import judge_printed
from evoexp.papers.chen.rules import RULES
from evoexp.report import kit
from evoexp.report.kit import judging, markdown


def judge_cases(
    results: kit.Results, cases: list[Case], settings: kit.ReportSettings
) -> tuple[kit.Claim, ...]:
    """Judge all claims; the optimum of every case is known."""
    judge = judging.judge(results, settings, RULES)
    minimax = [case for case in cases if case.name == "minimax torque"]
    return (
        *(one for case in cases for one in judge_printed(judge, case)),
        *_against_search(judge, cases, settings),
        *(one for case in cases for one in _against_conventional(judge, case, settings)),
        *(_seconds(judge, case.name, case.plain) for case in minimax if case.plain is not None),
    )


def _against_search(
    judge: kit.Judge, cases: list[Case], settings: kit.ReportSettings
) -> list[kit.Claim]:
    """Judge that the genetic algorithm, with and without elitism, beats random search."""
    pairs = {
        own.label: (case, name, own, case.search)
        for case in cases
        for name, own in (("without elitism", case.plain), ("with elitism", case.elitist))
        if own is not None and case.search is not None
    }
    rows = kit.compared(
        [(own, search) for _, _, own, search in pairs.values()],
        kit.by_column("best_cost"),
        settings,
        named=lambda own, _: own.label,
    )
    claims = []
    for row in rows:
        case, name, own, search = pairs[row.quantity]
        medians = (float(np.median(c.column("best_cost"))) for c in (own, search))
        told = "median {} against {}: ".format(*map(markdown.number, medians))
        hearing = judge.on("placement_evolution", case=case.name, elitism=name)
        claims.append(hearing.better(row, "lower E", told + "{}"))
    return claims


def _against_conventional(
    judge: kit.Judge, case: Case, settings: kit.ReportSettings
) -> Iterator[kit.Claim]:
    """Judge that conventional methods get stuck, and that the genetic algorithm does better."""
    close = RULES["gets_stuck"].limits["near_percent"] / 100.0
    for method, ends in case.ends().items():
        at_best = case.within(ends[:, 2], close)
        stuck = kit.Proportion(at_best.total - at_best.having, at_best.total)
        yield judge.on("gets_stuck", case=case.name, method=method).own(
            f"{stuck.having} of {stuck.total} starts "
            f"({markdown.percent(stuck.interval(settings.confidence))})",
            stuck.total,
            stuck.having > 0,
        )
        if case.elitist is not None:
            yield from _better(judge, case, case.elitist, method, at_best)


def _better(
    judge: kit.Judge,
    case: Case,
    elitist: kit.ConditionResults,
    method: str,
    at_best: kit.Proportion,
) -> Iterator[kit.Claim]:
    """Judge a run of the genetic algorithm against one start of a method, and their efforts."""
    assert case.conventional is not None
    close = RULES["per_success"].limits["near_percent"] / 100.0
    own = case.within(elitist.column("best_cost"), close)
    of_start = float(case.conventional.column(f"term_{METHODS[method]}_evaluations")[0])
    of_run = float(elitist.column("evaluations").mean())
    yield judge.on("better_than_a_start", case=case.name, method=method).greater(
        f"within {100 * close:g} % of the optimum: {100 * own.share:.0f} % of runs with "
        f"elitism, {100 * at_best.share:.0f} % of starts, p = "
        f"{markdown.p_value(kit.fisher_exact(own, at_best))}; a run takes {of_run:.0f} "
        f"evaluations, a start {of_start:.0f}",
        own,
        at_best,
    )
    run, start = (
        effort / share if share else np.inf
        for effort, share in ((of_run, own.share), (of_start, at_best.share))
    )
    yield judge.on("per_success", case=case.name, method=method).own(
        f"{run:.0f} against {start:.0f}".replace("inf", "∞"),
        f"{own.total} and {at_best.total}",
        run < start if min(run, start) < np.inf else None,
    )


def _seconds(judge: kit.Judge, name: str, condition: kit.ConditionResults) -> kit.Claim:
    """Judge that the minimax problem takes seconds."""
    seconds = float(np.median(condition.column("cpu_s")))
    return judge.on("seconds", case=name).own(
        f"{1000 * seconds:.1f} ms of this machine per run (median), verdict and log included",
        condition.done,
        seconds <= RULES["seconds"].limits["most_s"],
    )
