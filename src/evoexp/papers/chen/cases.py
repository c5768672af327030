"""The five criteria of Chen & Zalzala 1995, section 4.2: conditions, printed postures, rows."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from evoexp.planners.placement_ga.planner import NAMES, Problem
from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.results.run_measures import counted, grouped
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import Interval, Proportion, spread

METHODS = {
    "Newton-type": "newton",
    "Newton-type, smooth form": "bounded",
    "subgradient": "subgradient",
}  # conventional methods: names on the page → names in the records of the reference
AROUND, STEP = 10.0, 0.05  # [deg] from the optimum, where near postures are looked for
CLOSE = (0.001, 0.01)  # [-] gaps to the optimum; shares of runs within them are given


class PrintedPosture(NamedTuple):
    """The numbers that the paper prints of the best posture by one criterion."""

    figure: str  # the paper's figure
    term: str  # name of the printed number, as the planner's `evaluate` names it
    value: float  # the number; NaN if only angles are printed
    angles: tuple[float, float] | None = None  # θ1, θ2 [deg]; None if they are not printed
    torques: tuple[float, float, float] | None = None  # τ1, τ2, τ3; None if they are not printed
    ratio: float = np.nan  # greatest over least torque, by size; NaN if it is not printed


PRINTED = {
    "least torque norm": PrintedPosture(
        "Fig. 4", "torque_norm", 1.73, torques=(-0.61, 1.13, -0.3), ratio=3.73
    ),
    "minimax torque": PrintedPosture(
        "Fig. 5", "torque_max", 0.90, (68.96, 41.74), torques=(-0.90, 0.90, -0.87)
    ),
    "obstacle and link 2": PrintedPosture("Fig. 6", "torque_norm", 2.08),
    "obstacle and platform": PrintedPosture("Fig. 7", "torque_norm", 3.01),
    "manipulability and torque": PrintedPosture("Fig. 8", "cost", np.nan, (114.24, -36.93)),
}


class Case(NamedTuple):
    """The conditions of one criterion; None where a condition is absent or has no data."""

    name: str  # the criterion, a key of PRINTED; else the label of the first condition
    plain: ConditionResults | None = None  # the genetic algorithm without elitism
    elitist: ConditionResults | None = None  # the genetic algorithm with elitism
    search: ConditionResults | None = None  # random search at equal evaluations
    optimum: ConditionResults | None = None  # the exact optimum
    conventional: ConditionResults | None = None  # local methods from many starts
    landscape: ConditionResults | None = None  # E over θ1 and θ2

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
    def printed(self) -> PrintedPosture:
        """The numbers that the paper prints: no value and no angles where it prints none."""
        return PRINTED.get(self.name, PrintedPosture("", "", np.nan))

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


def cases(results: Results) -> list[Case]:
    """Return the criteria in the order of the experiment, each with its conditions."""
    names: dict[Any, str] = {  # weights of the terms, links that avoid obstacles → name
        (True, False, False): "least torque norm",
        (False, True, False): "minimax torque",
        (True, False, False, 2): "obstacle and link 2",
        (True, False, False, 0): "obstacle and platform",
        (True, False, True): "manipulability and torque",
    }
    found = []
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
        found.append(Case(names.get(criterion, own[0].label), **roles))
    return found


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
    """Return the shares of costs near the optimum; empty if it is not known."""
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
                    case.name,
                    name,
                    ", ".join(f"{found[f'theta_{k}_deg']:.2f}" for k in (1, 2, 3)),
                    f"{found['platform_x']:.4f}",
                    ", ".join(f"{found[f'torque_{k}']:.3f}" for k in (1, 2, 3)),
                    *(
                        f"{found[term]:.4g}"
                        for term in ("torque_norm", "torque_max", "obstacle", "manipulability")
                    ),
                    f"{found['cost']:.6g}",
                )
                yield tuple(cell.replace("-", "−") for cell in row)


def posture_checks(case: Case) -> list[tuple[str, str]]:
    """Return the rows on the local minima, and on contacts of the exact bodies."""
    rows = []
    if case.optimum is not None:
        values = ", ".join(f"{value:.4g}" for value in case.minima[:, 2])
        touching = case.optimum.summaries["certified"].eq(False).any()
        clearance = markdown.number(float(case.optimum.column("clearance")[0]))
        column = "refuted_pair" if touching else "clearance_pair"
        pair = str(case.optimum.summaries[column].iloc[0])
        named = pair.replace("arm_1_link_", "link ").replace("obstacle_1", "obstacle")
        told = "touches" if touching else f"is free, clearance {clearance}"
        rows = [
            (f"{case.name}: local minima", values),
            (f"{case.name}: bodies at the exact optimum", f"{told} ({named})"),
        ]
    if case.conditions[0].planner.objective.avoidances:
        rows += [
            (
                f"{case.name}: {name}, exact bodies",
                f"{c.verdicts.refuted} of {c.verdicts.judged} best postures touch",
            )
            for name, c in case.evolved.items()
        ]
    return rows


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # criteria whose exact optimum is known, those of them that were evolved, those with a landscape
    "exact_cases": lambda cases: [case for case in cases if case.optimum is not None],
    "evolved_cases": lambda exact_cases: [case for case in exact_cases if case.evolved],
    "landscapes": lambda cases: [case for case in cases if case.landscape is not None],
    "case_conditions": lambda cases: tuple(c for case in cases for c in case.conditions),
}
