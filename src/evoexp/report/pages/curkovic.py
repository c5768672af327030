"""Curkovic et al. 2013: methods of co-evolution side by side. Fig. 6, effort to a threshold, matched pairs."""

from functools import partial

import numpy as np

from evoexp.records import FloatArray
from evoexp.report import claims, markdown
from evoexp.report.claims import Comparison
from evoexp.report.figures import methods
from evoexp.report.page import Drawing, Page, Quantity
from evoexp.report.pages import generic
from evoexp.report.parameters import planned_replicates
from evoexp.report.results import ConditionResults, Results
from evoexp.report.settings import ReportSettings
from evoexp.report.statistics import spread

PAIRS = (("V", "I"), ("VI", "II"), ("VII", "III"), ("VIII", "IV"))
INTRODUCTION = (
    "One population of paths per robot; a path's cost is C1 + C2 + C3 + C4, where C1 counts collisions with all paths "
    "of the other populations. The answer is a team: one path per robot, free of collision with each other; its cost "
    "is C2 + C3 + C4 (end-effector paths, turns of the links, unevenness) summed over the robots, lower is better. "
    "Methods I–IV are generational with a roulette wheel, V–VIII keep a hall of fame of pairs and lower the mutation "
    "rate."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; the generic one where planners are others."""
    if not results.with_data or not all(hasattr(c.prepared.problem, "moving") for c in results.with_data):
        return generic.page(results, settings)
    first = results.with_data[0]
    bound = lower_bound(first)
    threshold = settings.threshold_ratio * bound
    compared = {name: _matched(results, settings, name, threshold) for name in ("best cost", "generations")}
    one_scene = len({(c.condition.robot, c.condition.scenario) for c in results.with_data}) == 1
    drawings = (_methods(results, bound),) if one_scene else (generic.cost_drawing(results),)
    return Page(
        title=f"Curkovic et al. 2013: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=_quantities(results, threshold),
        claims=_claims(results, settings, compared, threshold),
        checks=_checks(results, bound),
        comparisons=tuple(
            (f"{title}: matched pairs of methods", rows)
            for title, rows in (
                ("best cost of a team", compared["best cost"]),
                (f"generations to a team below {markdown.number(threshold)}", compared["generations"]),
            )
            if rows
        ),
        drawings=drawings,
    )


def lower_bound(condition: ConditionResults) -> float:
    """Return a lower bound of a team's cost: straight end-effector paths, least turns, no unevenness."""
    problem, objective = condition.prepared.problem, condition.planner.objective
    total = 0.0
    for arm, start, goal in zip(problem.collision.arms, problem.start, problem.goal, strict=True):
        tips = [arm.points(np.ascontiguousarray(q.reshape(1, 2, 1)))[0, 2:, 0] for q in (start, goal)]
        path = float(np.sqrt(np.sum((tips[1] - tips[0]) ** 2)))
        total += objective.path_weight * path + objective.rotation_weight * float(np.sum(np.abs(goal - start)))
    return total


def generations_to(condition: ConditionResults, threshold: float) -> FloatArray:
    """Return the first generation with a team at or below a cost, per replicate (done,); inf if there is none."""
    reached = condition.generations[condition.generations["best_cost"] <= threshold]
    first = reached.groupby("replicate")["index"].min()
    return first.reindex(condition.summaries.index).fillna(np.inf).to_numpy(np.float64)


def expected_evaluations(condition: ConditionResults, threshold: float) -> float:
    """Return the expected running time in evaluations: all that were spent, over the runs that got there."""
    first = generations_to(condition, threshold)
    spent = 0.0
    for replicate, generation in zip(condition.summaries.index, first, strict=True):
        rows = condition.generations[condition.generations["replicate"] == replicate]
        until = rows["index"] <= generation
        spent += float(rows.loc[until, "evaluations"].max())
    reached = int(np.isfinite(first).sum())
    return spent / reached if reached else np.inf


def _quantities(results: Results, threshold: float) -> tuple[Quantity, ...]:
    row = partial(generic.quantity, results)
    cost, _, *effort = generic.quantities(results)
    unit = results.with_data[0].condition.length_unit
    to = f"team of cost ≤ {markdown.number(threshold)}"
    expected = {c.label: spread(np.array([expected_evaluations(c, threshold)])) for c in results.with_data}
    return (
        cost._replace(name="best cost of a collision-free team"),
        row(f"generations to a {to}", "generation", lambda c: generations_to(c, threshold)),
        Quantity(f"expected evaluations to a {to} (failures included)", "–", expected),
        row("clearance of the bodies over the whole motion (exact)", unit, generic.by_column("clearance")),
        *effort,
        row("CPU time of a run", "s", generic.by_column("cpu_s")),
        *generic.term_quantities(results),
    )


def _matched(results: Results, settings: ReportSettings, what: str, threshold: float) -> tuple[Comparison, ...]:
    """Compare each method with a hall of fame with its counterpart; p-values adjusted over the pairs."""
    by_label = {c.label: c for c in results.with_data}

    def values(condition: ConditionResults) -> FloatArray:
        return condition.column("best_cost") if what == "best cost" else generations_to(condition, threshold)

    rows = [
        generic.compare_on_common_seeds(by_label[a], by_label[b], f"{a} against {b}", True, values, settings)
        for a, b in PAIRS
        if a in by_label and b in by_label
    ]
    return tuple(claims.adjusted([row for row in rows if row is not None]))


def _claims(
    results: Results, settings: ReportSettings, compared: dict[str, tuple[Comparison, ...]], threshold: float
) -> tuple[claims.Claim, ...]:
    reason = "" if results.budget == "paper" else f"budget {results.budget or 'unknown'}"
    if not reason and any(c.planned < planned_replicates(results.experiment) for c in results.conditions):
        reason = "fewer replicates than planned"
    found = []
    for name, title in (("generations", f"a team of cost ≤ {markdown.number(threshold)}"), ("best cost", "the end")):
        for comparison in compared[name]:
            low, high = comparison.better.interval
            better = "earlier" if name == "generations" else "lower"
            evidence = (
                f"{better} in {100 * comparison.better.a12:.0f} % of pairs of runs (A12 {comparison.better.a12:.3f} "
                f"[{low:.3f}, {high:.3f}]), p = {markdown.p_value(comparison.p_adjusted)}"
            )
            verdict = claims.judge_better(reason, comparison, settings.significance)
            text = f"Methods with hall of fame and Eq. 10 converge faster, judged by {title}: {comparison.quantity}"
            found.append(
                claims.Claim(text, "section 3, Fig. 6", evidence, f"{verdict} ({reason})" if reason else verdict)
            )
    slowest = max((float(c.column("cpu_s").max()) for c in results.with_data), default=np.nan)
    solved, done = sum(c.solved for c in results.with_data), sum(c.done for c in results.with_data)
    within = claims.judge_all(reason, solved if slowest < 10.0 else 0, done, sum(c.planned for c in results.conditions))
    found.append(
        claims.Claim(
            "A collision-free solution in less than 10 s",
            "section 3",
            f"{markdown.share(solved, done)} runs found one; the slowest run took {markdown.number(slowest)} s of CPU",
            f"{within} ({reason})" if reason else within,
        )
    )
    return tuple(found)


def _checks(results: Results, bound: float) -> tuple[tuple[str, str], ...]:
    refuted = "; ".join(
        f"{c.label}: {c.verdicts.solved_refuted} of {c.solved}" for c in results.with_data if c.verdicts.judged
    )
    at_first = "; ".join(
        f"{c.label}: {int((c.column('first_feasible_generation') == 0).sum())} of {c.done}" for c in results.with_data
    )
    return (
        (
            "Motions that the paper's model accepts at its configurations and that collide in between (exact verdict)",
            refuted or "nothing judged",
        ),
        (
            "Runs whose random initial populations already hold a collision-free pair (so its first generation says "
            "nothing about a method)",
            at_first,
        ),
        (
            "Lower bound of a team's cost: straight end-effector paths, least turns of the links",
            markdown.number(bound),
        ),
    )


def _methods(results: Results, bound: float) -> Drawing:
    return Drawing(
        "fig_6_methods",
        "Fig. 6: convergence of the methods, and their results",
        "The paper shows the cost of 20 runs per method with standard deviation, and a box plot. Here: the cheapest "
        "collision-free team so far (mean and standard deviation over the runs that have one by then), and its cost at "
        "the end of each run (boxes: median and quartiles, whiskers to the last value within 1.5 interquartile ranges, "
        "every run a point). Methods I–IV dashed.",
        partial(methods.methods_table, results, bound),
        methods.draw_methods,
        results.with_data,
    )
