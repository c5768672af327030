"""Rows of the tables and checks on the docking postures of Chen & Zalzala 1995, Figs. 3–9."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from evoexp.papers.chen.cases import CLOSE, Case
from evoexp.report.pages import markdown
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.inference import spread

Conditions = tuple[ConditionResults, ...]


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
