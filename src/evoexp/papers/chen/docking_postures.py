"""Docking postures of Chen & Zalzala 1995, section 4.2: five criteria, rows, claims on them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from evoexp.planners.placement_ga.planner import NAMES, Problem
from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim, EffectSize
from evoexp.report.results.run_measures import counted, grouped
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import Interval, Proportion, fisher_exact, spread
from evoexp.report.statistics.judging import Judge

METHODS = {
    "Newton-type": "newton",
    "Newton-type, smooth form": "bounded",
    "subgradient": "subgradient",
}  # conventional methods: names on the page → names in the records of the reference
AROUND, STEP = 10.0, 0.05  # [deg] from the optimum, where near postures are looked for
TERMS = ("torque_norm", "torque_max", "obstacle", "manipulability")  # of E, in tables
CLOSE = (0.001, 0.01)  # [-] gaps to the optimum; shares of runs within them are given
MINIMAX, MANIPULABILITY = "minimax torque", "manipulability and torque"


class PrintedPosture(NamedTuple):
    """The numbers that the paper prints of the best posture by one criterion."""

    figure: str = ""  # the paper's figure
    term: str = ""  # name of the printed number, as the planner's `evaluate` names it
    value: float = np.nan  # the number; NaN if only angles are printed
    angles: Sequence[float] | None = None  # θ1, θ2 [deg]; None if they are not printed
    torques: Sequence[float] | None = None  # τ1, τ2, τ3; None if they are not printed
    ratio: float = np.nan  # greatest over least torque, by size; NaN if it is not printed


class Case(NamedTuple):
    """The conditions of one criterion; None where a condition is absent or has no data."""

    name: str  # the criterion; of another one the label of the first condition
    plain: ConditionResults | None = None  # the genetic algorithm without elitism
    elitist: ConditionResults | None = None  # the genetic algorithm with elitism
    search: ConditionResults | None = None  # random search at equal evaluations
    optimum: ConditionResults | None = None  # the exact optimum
    conventional: ConditionResults | None = None  # local methods from many starts
    landscape: ConditionResults | None = None  # E over θ1 and θ2
    printed: PrintedPosture = PrintedPosture()  # the numbers that the paper prints

    @property
    def conditions(self) -> tuple[ConditionResults, ...]:
        """All conditions that are there; they share robot, task and criterion."""
        return tuple(c for c in self[1:] if isinstance(c, ConditionResults))

    @property
    def evolved(self) -> dict[str, ConditionResults]:
        """The conditions that were run with many seeds, by their names in figures."""
        named = {"GA": self.plain, "GA, elitism": self.elitist, "random search": self.search}
        return {name: c for name, c in named.items() if c is not None}

    @property
    def least(self) -> float:
        """E of the exact optimum; NaN if it was not computed."""
        return float(self.optimum.column("best_cost")[0]) if self.optimum is not None else np.nan

    @property
    def optimal_angles(self) -> FloatArray | None:
        """θ1, θ2 [deg] of the exact optimum; None if it was not computed."""
        best = self.optimum
        return best.solutions[best.best_replicate] if best is not None else None

    @property
    def minima(self) -> FloatArray:
        """All local minima, (minima, 3): θ1, θ2 [deg], E, the least first."""
        return self.optimum.array("minima") if self.optimum is not None else np.empty((0, 3))

    def gaps(self, costs: FloatArray) -> FloatArray:
        """Return the gaps of costs above the optimum, as multiples of the optimum [-]."""
        return costs / self.least - 1.0

    def within(self, costs: FloatArray, close: float) -> Proportion:
        """Count the costs within a gap [-] of the optimum."""
        return counted(self.gaps(costs) <= close)

    def measured(self, angles: Any) -> dict[str, float]:
        """Return the named terms of the posture θ1, θ2 [deg]; see `PlacementGa.evaluate`."""
        return self.conditions[0].evaluate(np.asarray(angles, dtype=np.float64))

    def near_values(self, term: str, close: float) -> Interval:
        """Return the least and the greatest value of a term within a gap [-] of the optimum.

        Of postures around the optimum, at most `AROUND` away in either angle.
        """
        assert self.optimal_angles is not None
        steps = np.arange(-AROUND, AROUND + 0.5 * STEP, STEP)
        pairs = self.optimal_angles[:, None, None] + np.stack(np.meshgrid(steps, steps))
        problem = self.conditions[0].problem(Problem)
        found = problem.model.measure(np.ascontiguousarray(pairs.reshape(2, -1)))
        values = found[("cost", *NAMES).index(term)][self.gaps(found[0]) <= close]
        return Interval(float(values.min()), float(values.max()))

    def torques(self, angles: Any) -> FloatArray:
        """Return τ1, τ2, τ3 of the posture θ1, θ2 [deg]."""
        found = self.measured(angles)
        return np.array([found[f"torque_{k}"] for k in (1, 2, 3)])

    def ends(self) -> dict[str, FloatArray]:
        """Return local method → the postures at which it ends, (starts, 3): θ1, θ2 [deg], E."""
        own = self.conventional
        return {
            name: own.array(key)
            for name, key in METHODS.items()
            if own is not None and f"term_{key}_evaluations" in own.summaries
        }


def cases(results: Results, printed_postures: Mapping[str, Any]) -> Iterator[Case]:
    """Yield the criteria in the order of the experiment, each with its conditions."""
    names: dict[Any, str] = {  # weights of the terms, links that avoid obstacles → name
        (True, False, False): "least torque norm",
        (False, True, False): MINIMAX,
        (True, False, False, 2): "obstacle and link 2",
        (True, False, False, 0): "obstacle and platform",
        (True, False, True): MANIPULABILITY,
    }
    for own in grouped(results.with_data, lambda c: (c.robot, c.scenario, c.planner.objective)):
        roles: dict[str, ConditionResults] = {}
        for c in own:
            role = "elitist" if c.planner.ga.num_elites else "plain"
            if c.is_reference:
                role = str(c.condition.planner.component).removeprefix("placement_")
            roles.setdefault("search" if c.is_control else role, c)
        cost = own[0].planner.objective
        weights = cost.torque_norm_weight, cost.torque_max_weight, cost.manipulability_weight
        criterion = (*map(bool, weights), *(one.link for one in cost.avoidances))
        name = names.get(criterion, own[0].label)
        printed = PrintedPosture(**printed_postures.get(name, {}))
        yield Case(name, **roles, printed=printed)


def landscape_row(case: Case) -> tuple[object, ...]:
    """Return a criterion's feasible share, its local minima and the best run."""
    assert case.landscape is not None
    share = 100.0 * float(case.landscape.column("term_share_feasible")[0])
    told = "; ".join(f"({a:.2f}, {b:.2f})°: {e:.5g}" for a, b, e in case.minima).replace("-", "−")
    best = float(case.plain.column("best_cost").min()) if case.plain is not None else np.nan
    return case.name, f"{share:.1f} %", len(case.minima), told or "–", markdown.number(best)


def result_row(case: Case) -> tuple[str, ...]:
    """Return a criterion's row: paper, exact optimum, GA, random search, conventional methods."""
    value, angles = case.printed.value, case.printed.angles
    paper = [] if np.isnan(value) else [f"{case.printed.term.replace('_', ' ')} {value:g}"]
    if angles is not None:
        paper.append(f"E = {case.measured(angles)['cost']:.6g} at its angles")
    methods = (f"{name} {_shares(case, ends[:, 2])}" for name, ends in case.ends().items())
    least = f"E = {case.least:.6g}" if case.optimum is not None else "–"
    evolved = (case.plain, case.elitist, case.search)
    costs = [np.empty(0) if c is None else c.column("best_cost") for c in evolved]
    runs = (f"{markdown.spread(spread(e))} {_shares(case, e)}" if len(e) else "–" for e in costs)
    return (case.name, "; ".join(paper) or "–", least, *runs, "; ".join(methods) or "–")


def _shares(case: Case, costs: np.ndarray) -> str:
    shares = (f"{100 * case.within(costs, close).share:.0f} %" for close in CLOSE)
    return "" if np.isnan(case.least) else f"({', '.join(shares)})"


def posture_rows(cases: list[Case]) -> Iterator[tuple[str, ...]]:
    """Yield the numbers of the exact optimum and of the paper's angles."""
    for case in cases:
        shown = {"exact optimum": case.optimal_angles, "paper's angles": case.printed.angles}
        for name, angles in shown.items():
            if angles is not None:
                found = case.measured(angles)
                row = (
                    *(case.name, name),
                    ", ".join(f"{found[f'theta_{k}_deg']:.2f}" for k in (1, 2, 3)),
                    f"{found['platform_x']:.4f}",
                    ", ".join(f"{found[f'torque_{k}']:.3f}" for k in (1, 2, 3)),
                    *(f"{found[term]:.4g}" for term in TERMS),
                    f"{found['cost']:.6g}",
                )
                yield tuple(cell.replace("-", "−") for cell in row)


def posture_checks(case: Case) -> Iterator[tuple[str, str]]:
    """Yield the rows on the local minima, and on contacts of the exact bodies."""
    if case.optimum is not None:
        values = ", ".join(f"{value:.4g}" for value in case.minima[:, 2])
        touching = case.optimum.summaries["certified"].eq(False).any()
        clearance = markdown.number(float(case.optimum.column("clearance")[0]))
        column = "refuted_pair" if touching else "clearance_pair"
        pair = str(case.optimum.summaries[column].iloc[0])
        named = pair.replace("arm_1_link_", "link ").replace("obstacle_1", "obstacle")
        told = "touches" if touching else f"is free, clearance {clearance}"
        yield f"{case.name}: local minima", values
        yield f"{case.name}: bodies at the exact optimum", f"{told} ({named})"
    if case.conditions[0].planner.objective.avoidances:
        for name, c in case.evolved.items():
            told = f"{c.verdicts.refuted} of {c.verdicts.judged} best postures touch"
            yield f"{case.name}: {name}, exact bodies", told


def judge_printed(judge: Judge, case: Case) -> Iterator[Claim]:
    """Judge the number, the angles, the torques and their ratio, as far as they are printed."""
    printed = case.printed
    angles = "({:g}, {:g})°".format(*printed.angles).replace("-", "−") if printed.angles else ""
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
        # the printed ratio of torques by the printed sizes, and by those of the optimum
        sizes, exact = np.abs(torques), np.abs(exact)
        hearing = on("torque_ratio", ratio=f"{printed.ratio:g}")
        rounded, near = (hearing.rule.limits[name] for name in ("rounded", "near_percent"))
        lowest = (sizes.max() - rounded) / (sizes.min() + rounded)
        greatest = (sizes.max() + rounded) / (sizes.min() - rounded)
        ratio = float(exact.max() / exact.min())
        off = 100.0 * (ratio / printed.ratio - 1.0)
        told = {"printed": sizes.max() / sizes.min(), "lowest": lowest, "greatest": greatest}
        holds = bool(lowest <= printed.ratio <= greatest and abs(off) <= near)
        yield hearing.own(told | {"own": ratio, "off": off}, 1, holds)


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


def triple(torques: FloatArray, digits: int) -> str:
    """Return torques in words: (−0.61, 1.13, −0.30)."""
    return f"({', '.join(f'{torque:.{digits}f}' for torque in torques)})".replace("-", "−")


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


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # criteria whose exact optimum is known, those of them that were evolved, those with a landscape
    "exact_cases": lambda cases: [case for case in cases if case.optimum is not None],
    "evolved_cases": lambda exact_cases: [case for case in exact_cases if case.evolved],
    "landscapes": lambda cases: [case for case in cases if case.landscape is not None],
    "case_conditions": lambda cases: tuple(c for case in cases for c in case.conditions),
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
    "plain_minimax": lambda case: case.name == MINIMAX and case.plain,
    "plain_manipulability": lambda case: case.name == MANIPULABILITY and case.plain,
    # median time of a run, its exact verdict included
    "milliseconds": lambda condition: 1e3 * float(np.median(condition.column("cpu_s"))),
    "in_seconds": lambda milliseconds, rules: (
        milliseconds <= 1e3 * rules["seconds"].limits["most_s"]
    ),
    "num_minima": lambda case: float(len(case.minima)),
}
