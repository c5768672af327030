"""The claims of Chen & Zalzala 1995 on docking postures, judged by exact optima and controls."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from scipy import stats

from evoexp.papers.chen.cases import METHODS, Case
from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim, EffectSize
from evoexp.report.statistics.inference import Interval, Proportion, fisher_exact
from evoexp.report.statistics.judging import Judge

MANIPULABILITY = "manipulability and torque"
SECONDS = {  # criteria that took two seconds: beside what, and where the paper says so
    "minimax torque": (
        " (the subgradient algorithm of Pin & Culioli: 15 minutes)",
        "section 4.2 A",
    ),
    MANIPULABILITY: ("", "section 4.2 C"),
}


def judge_printed(judge: Judge, case: Case) -> Iterator[Claim]:
    """Judge the number, the angles, the torques and their ratio, as far as they are printed."""
    printed = case.printed
    angles = _signed("({:g}, {:g})°".format(*printed.angles)) if printed.angles else ""
    on = partial(judge.on, case=case.name, figure=printed.figure, angles=angles)
    if not np.isnan(printed.value):
        yield judge_value(judge, case)
    if printed.angles is not None:
        cost = case.measured(printed.angles)["cost"]
        gap = 100.0 * float(case.gaps(np.array([cost]))[0])
        hearing = on("printed_angles")
        told: dict[str, object] = {"cost": cost, "least": case.least, "gap": gap}
        yield hearing.own(told, 1, gap <= hearing.rule.limits["near_percent"])
    if printed.torques is None:
        return
    # the torques of the exact optimum, of its mirror images the nearest
    torques = np.array(printed.torques)
    optima = case.minima[case.minima[:, 2] <= case.least * (1.0 + 1e-9), :2]
    exact = min(map(case.torques, optima), key=lambda own: float(np.abs(own - torques).max()))
    by_norm = case.conditions[0].planner.objective.torque_norm_weight > 0.0
    cost = float((torques**2).sum() if by_norm else np.abs(torques).max())
    gap, off = 100.0 * (cost / case.least - 1.0), float(np.abs(exact - torques).max())
    hearing = on("printed_torques", torques=triple(torques, 2))
    limits = hearing.rule.limits
    told = {"exact": triple(exact, 4), "off": off, "cost": cost, "gap": gap, "least": case.least}
    yield hearing.own(told, 1, gap <= limits["near_percent"] and off <= limits["rounded"])
    # those of our model at the printed angles
    if printed.angles is not None:
        own = case.torques(printed.angles)
        off = float(np.abs(own - torques).max())
        hearing = on("torques_at_angles", torques=triple(torques, 2))
        told = {"own": triple(own, 4), "off": off}
        yield hearing.own(told, 1, off <= hearing.rule.limits["rounded"])
    if not np.isnan(printed.ratio):
        yield _ratio(judge, case, np.abs(torques), np.abs(exact))


def judge_value(judge: Judge, case: Case) -> Claim:
    """Judge the printed number by that of the exact optimum, and of postures near it."""
    printed, exact = case.printed, case.measured(case.optimal_angles)
    best, name = exact[printed.term], printed.term.replace("_", " ")
    words = {"case": case.name, "term": name, "value": f"{printed.value:g}"}
    hearing = judge.on("printed_value", figure=printed.figure, **words)
    told = f"at the exact optimum {markdown.number(best)}"
    if case.conditions[0].planner.objective.avoidances:
        told += (
            f" (E = {markdown.number(case.least)}, of which the obstacle "
            f"{markdown.number(exact['obstacle'])})"
        )
    rounded, near = (hearing.rule.limits[name] for name in ("rounded", "near_percent"))
    low, high = case.near_values(printed.term, 0.01 * near)
    told += f"; within {near:g} % of it {markdown.number(low)} to {markdown.number(high)}"
    agrees: bool | None = low - rounded <= printed.value <= high + rounded
    if case.name == "obstacle and platform":
        told += "; where the obstacle stands is not printed, (5.2, 0) is assumed"
        agrees = agrees or None
    return hearing.own(told, 1, agrees)


def _ratio(judge: Judge, case: Case, sizes: FloatArray, exact: FloatArray) -> Claim:
    """Judge the printed ratio of torques by the printed sizes, and by those of the optimum."""
    printed = case.printed
    words = {"case": case.name, "ratio": f"{printed.ratio:g}", "figure": printed.figure}
    hearing = judge.on("torque_ratio", **words)
    rounded, near = (hearing.rule.limits[name] for name in ("rounded", "near_percent"))
    lowest = (sizes.max() - rounded) / (sizes.min() + rounded)
    greatest = (sizes.max() + rounded) / (sizes.min() - rounded)
    own = float(exact.max() / exact.min())
    off = 100.0 * (own / printed.ratio - 1.0)
    told = {"printed": sizes.max() / sizes.min(), "lowest": lowest, "greatest": greatest}
    holds = bool(lowest <= printed.ratio <= greatest and abs(off) <= near)
    return hearing.own(told | {"own": own, "off": off}, 1, holds)


def triple(torques: FloatArray, digits: int) -> str:
    """Return torques in words: (−0.61, 1.13, −0.30)."""
    return _signed(f"({', '.join(f'{torque:.{digits}f}' for torque in torques)})")


def _signed(text: str) -> str:
    return text.replace("-", "−")


def against_conventional(judge: Judge, case: Case) -> Iterator[Claim]:
    """Judge that conventional methods get stuck, and that the genetic algorithm does better."""
    for method, ends in case.ends().items():
        hearing = judge.on("gets_stuck", case=case.name, method=method)
        at_best = case.within(ends[:, 2], hearing.rule.limits["near_percent"] / 100.0)
        stuck = Proportion(at_best.total - at_best.having, at_best.total)
        interval = markdown.percent(stuck.interval(judge.level))
        told: dict[str, object] = {"stuck": stuck, "interval": interval}
        yield hearing.own(told, stuck.total, stuck.having > 0)
        if case.elitist is None or case.conventional is None:
            continue
        # a run of the genetic algorithm against one start of the method, and their efforts
        efforts = judge.on("per_success", case=case.name, method=method)
        close = efforts.rule.limits["near_percent"]
        own = case.within(case.elitist.column("best_cost"), close / 100.0)
        of_start = float(case.conventional.column(f"term_{METHODS[method]}_evaluations")[0])
        of_run = float(case.elitist.column("evaluations").mean())
        told = {"close": close, "runs": 100 * own.share, "starts": 100 * at_best.share}
        told |= {"p": fisher_exact(own, at_best), "of_run": of_run, "of_start": of_start}
        runs = judge.on("better_than_a_start", case=case.name, method=method)
        yield runs.greater(told, own, at_best)
        run, start = (
            effort / share if share else np.inf
            for effort, share in ((of_run, own.share), (of_start, at_best.share))
        )
        ratio, between = run / start, Interval(0.0, np.inf)
        if own.having and at_best.having:
            # runs cost about the same each, and starts: the ratio varies as that of the shares
            shares = stats.contingency.relative_risk(*at_best, *own)
            by_shares, price = shares.confidence_interval(judge.level), of_run / of_start
            between = Interval(price * by_shares.low, price * by_shares.high)
        low, high = between
        text = f"{run:.0f} against {start:.0f}; ratio {ratio:.3g} [{low:.3g}, {high:.3g}]"
        holds = None if low <= 1.0 <= high else high < 1.0
        size = EffectSize("ratio of efforts per success", ratio, low, high, 1.0)
        counted = f"{own.total} and {at_best.total}"
        yield efforts.own(text.replace("inf", "∞"), counted, holds, size)


def evener_torques(judge: Judge, exact_cases: list[Case]) -> Iterator[Claim]:
    """Judge that the minimax criterion loads the joints more evenly than the least norm."""
    ratios = {}
    for case in exact_cases:
        sizes = np.abs(case.torques(case.optimal_angles))
        ratios[case.name] = float(sizes.max() / sizes.min())
    if {"least torque norm", "minimax torque"} <= ratios.keys():
        told = {"norm": ratios["least torque norm"], "minimax": ratios["minimax torque"]}
        yield judge.on("evener_torques").own(told, 2, told["minimax"] < told["norm"])


def in_seconds(judge: Judge, case: Case) -> Claim | None:
    """Judge the time that the paper prints, of criteria for which it prints one."""
    if case.name not in SECONDS or case.plain is None:
        return None
    seconds = float(np.median(case.plain.column("cpu_s")))
    beside, where = SECONDS[case.name]
    hearing = judge.on("seconds", case=case.name, beside=beside, where=where)
    holds = seconds <= hearing.rule.limits["most_s"]
    return hearing.own({"milliseconds": 1e3 * seconds}, case.plain.done, holds)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "near_optimum": lambda condition, case, rules: case.within(
        condition.column("best_cost"), rules["near_posture"].limits["near_percent"] / 100.0
    ),
    # (criterion, how it was evolved, its runs) of those that random search stands beside
    "evolved_beside_search": lambda exact_cases: [
        (case, elitism, run)
        for case in exact_cases
        for elitism, run in (("without elitism", case.plain), ("with elitism", case.elitist))
        if run is not None and case.search is not None
    ],
    "is_manipulability": lambda case: case.name == MANIPULABILITY,
    "num_minima": lambda case: float(len(case.minima)),
}
