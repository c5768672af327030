"""Chen & Zalzala 1995, Figs. 3–8.

Docking postures by five criteria, beside exact optima and other methods.
"""

from functools import partial

import numpy as np

from evoexp.papers.chen import cases, placement_claims
from evoexp.papers.chen.cases import CLOSE, Case
from evoexp.papers.chen.figures import placements
from evoexp.report import markdown
from evoexp.report.page import Drawing, Page, Table
from evoexp.report.pages import generic
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import spread

INTRODUCTION = (
    "Two angles of a three-link arm on a platform are searched; θ3 (the better of its two "
    "values) and the platform's place follow from where the end-effector shall be. The cost is E "
    "(Eq. 14), lower is better; the paper's fitness is f = 250 − E. Infeasible postures cost "
    "250. Elitism: the paper speaks of none, so both are shown. Exact optima: a dense search "
    "over both angles, every minimum polished; conventional methods: local ones, from the same "
    "feasible starts spread evenly. Without an obstacle everything has a mirror image of the "
    "same cost."
)
TABLE = (
    "Paper: what it prints of its best posture; where it prints angles, E at these. GA and "
    "random search: median [quartiles] of the best E of a run; in brackets shares of runs (for "
    "conventional methods: of starts) within 0.1 % and 1 % of the optimum."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; the generic one where planners are others."""
    if not results.with_data or not cases.fits(results):
        return generic.page(results, settings)
    found = cases.cases(results)
    exact = [case for case in found if case.optimum is not None]
    return Page(
        title=f"Chen & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        tables=(_beside(found), _postures(found)),
        claims=placement_claims.of_cases(results, exact, settings),
        checks=_checks(found),
        drawings=_drawings(found),
    )


def _beside(cases: list[Case]) -> Table:
    """Return the table paper | exact optimum | GA | random search | conventional."""
    rows = []
    for case in cases:
        methods = [
            "; ".join(f"{name} {_shares(case, ends[:, 2])}" for name, ends in case.ends().items())
            or "–"
        ]
        runs = [_run(case, c) for c in (case.plain, case.elitist, case.search)]
        least = f"E = {case.least:.6g}" if case.optimum is not None else "–"
        rows.append((case.name, _paper(case), least, *runs, *methods))
    headers = (
        "criterion",
        "paper",
        "exact optimum",
        "GA",
        "GA, elitism",
        "random search",
        "conventional, by start",
    )
    return Table("Results", headers, tuple(rows), TABLE)


def _paper(case: Case) -> str:
    if case.printed is None:
        return "–"
    told = []
    if not np.isnan(case.printed.value):
        told.append(f"{case.printed.term.replace('_', ' ')} {case.printed.value:g}")
    if case.printed.angles is not None:
        told.append(f"E = {case.measured(case.printed.angles)['cost']:.6g} at its angles")
    return "; ".join(told)


def _run(case: Case, condition: ConditionResults | None) -> str:
    if condition is None:
        return "–"
    costs = condition.column("best_cost")
    return f"{markdown.spread(spread(costs))} {_shares(case, costs)}"


def _shares(case: Case, costs: np.ndarray) -> str:
    if np.isnan(case.least):
        return ""
    shares = [f"{100 * case.within(costs, close).share:.0f} %" for close in CLOSE]
    return f"({', '.join(shares)})"


def _postures(cases: list[Case]) -> Table:
    """Return the numbers of the exact optima and of the paper's angles."""
    rows = []
    for case in cases:
        shown = {}
        if case.optimum is not None:
            shown["exact optimum"] = case.optimum.solutions[case.optimum.best_replicate]
        if case.printed is not None and case.printed.angles is not None:
            shown["paper's angles"] = np.array(case.printed.angles)
        for name, angles in shown.items():
            found = case.measured(angles)
            degrees = ", ".join(f"{found[f'theta_{k}_deg']:.2f}" for k in (1, 2, 3))
            torques = ", ".join(f"{found[f'torque_{k}']:.3f}" for k in (1, 2, 3))
            terms = [
                f"{found[term]:.4g}"
                for term in ("torque_norm", "torque_max", "obstacle", "manipulability")
            ]
            row = (
                case.name,
                name,
                degrees,
                f"{found['platform_x']:.4f}",
                torques,
                *terms,
                f"{found['cost']:.6g}",
            )
            rows.append(tuple(cell.replace("-", "−") for cell in row))
    headers = (
        "criterion",
        "posture",
        "θ1, θ2, θ3 [deg]",
        "X_p",
        "τ1, τ2, τ3",
        "E1",
        "E2",
        "Σ γ E_obs",
        "E_man",
        "E",
    )
    return Table("Postures", headers, tuple(rows))


def _checks(cases: list[Case]) -> tuple[tuple[str, str], ...]:
    rows = []
    for case in cases:
        if case.optimum is not None:
            minima = case.optimum.array("minima")[:, 2]
            rows.append(
                (f"{case.name}: local minima", ", ".join(f"{value:.4g}" for value in minima))
            )
            touching = case.optimum.summaries["certified"].eq(False).any()
            clearance = float(case.optimum.column("clearance")[0])
            pair = str(
                case.optimum.summaries["refuted_pair" if touching else "clearance_pair"].iloc[0]
            )
            told = "touches" if touching else f"is free, clearance {markdown.number(clearance)}"
            rows.append((f"{case.name}: bodies at the exact optimum", f"{told} ({_named(pair)})"))
        for name, c in case.evolved.items():
            verdicts = c.verdicts
            told = f"{verdicts.refuted} of {verdicts.judged} best postures touch"
            if case.any.planner.objective.avoidances:
                rows.append((f"{case.name}: {name}, exact bodies", told))
    return tuple(rows)


def _named(pair: str) -> str:
    """Return the names of two bodies as the paper has them."""
    return pair.replace("arm_1_link_", "link ").replace("obstacle_1", "obstacle")


def _drawings(cases: list[Case]) -> tuple[Drawing, ...]:
    exact = [case for case in cases if case.optimum is not None and case.evolved]
    shown = tuple(c for case in cases for c in case[1:] if isinstance(c, ConditionResults))
    found = [
        Drawing(
            "fig_3_to_8_postures",
            "Figs. 3–8: postures",
            "Thick: the exact optimum; thin: the best run of the genetic algorithm, with elitism "
            "where it was run; where the paper prints angles, its posture. Where two differ, "
            "they are often mirror images. The platform's size and the obstacle of Fig. 7 are "
            "assumed.",
            partial(placements.postures_table, cases),
            placements.draw_postures,
            shown,
        )
    ]
    if exact:
        fitness = Drawing(
            "fig_4_to_8_fitness",
            "Figs. 4–8: the best of a run against generations",
            "Median and quartiles over runs of the best so far, at equal evaluations; "
            "dash-dotted: the exact optimum. For the least torque norm the paper draws the "
            "torque norm itself (lower is better), else the fitness f = 250 − E (higher is "
            "better).",
            partial(placements.fitness_table, exact),
            placements.draw_fitness,
            shown,
        )
        gaps = Drawing(
            "gaps",
            "Gaps to the exact optimum",
            "Share of runs, or of starts of a conventional method (dashed), that end closer to "
            "the optimum than x; dotted: 0.1 % and 1 %. What is below 1e-6 is drawn there; "
            "plateaus on the right are local minima.",
            partial(placements.gaps_table, exact),
            placements.draw_gaps,
            shown,
        )
        found += [fitness, gaps]
    return tuple(found)
