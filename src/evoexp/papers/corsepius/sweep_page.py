"""Corsépius 2001: settings side by side; per task the first condition against each other one."""

from functools import partial

import numpy as np

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius import page as whole_page
from evoexp.papers.corsepius.figures import population_effort, residual_floor
from evoexp.papers.corsepius.measures import Task
from evoexp.papers.corsepius.population_claims import METRICS
from evoexp.records import FloatArray
from evoexp.report import claims, markdown
from evoexp.report.claims import Comparison
from evoexp.report.figures import effects, shares
from evoexp.report.page import Drawing, Page, Table
from evoexp.report.pages import generic
from evoexp.report.proportions import fisher_exact
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import holm, spread

PRINTED_PARENTS = 5.0  # "typical size 5" (section 4.2)
INTRODUCTION = (
    "Conditions of one task differ in one setting and share their seeds. Effort of a run that "
    "does not meet its goal counts as infinite where runs are compared, and as spent where "
    "expected running times are formed. The paper sweeps nothing; it names the setting as what "
    "scales the algorithm (section 5) or as a next step (section 6)."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; that of the tasks where there is nothing to compare."""
    if not measures.fits(results) or len(results.main) < 2:
        return whole_page.page(results, settings)
    compared = comparisons(results, settings)
    return Page(
        title=f"Corsépius 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=whole_page.quantities(results),
        tables=(_table(results, settings),),
        checks=_checks(results),
        comparisons=tuple((f"{name}: {first} against …", rows) for name, first, rows in compared),
        drawings=_drawings(results, settings, compared),
    )


def groups(results: Results) -> tuple[tuple[ConditionResults, ...], ...]:
    """Return the conditions task by task: those of one robot and one scenario.

    Controls included.
    """
    found: dict[str, list[ConditionResults]] = {}
    for c in results.with_data:
        key = repr((c.condition.robot.canonical(), c.condition.scenario.canonical()))
        found.setdefault(key, []).append(c)
    return tuple(tuple(group) for group in found.values())


def effort(condition: ConditionResults) -> FloatArray:
    """Return the evaluations to the goal of each run, (done,); inf without it."""
    return np.where(measures.solved(condition), measures.evaluations(condition), np.inf)


def comparisons(
    results: Results, settings: ReportSettings
) -> list[tuple[str, str, tuple[Comparison, ...]]]:
    """Return (quantity, first condition, it against each other one).

    P-values adjusted over each task.
    """
    found = []
    reaching = any(c.solved for c in results.main)
    name, values = (
        ("evaluations to the goal", effort)
        if reaching
        else ("distance to the goal", measures.residuals)
    )
    for first, *others in groups(results):
        rows = [
            generic.compare_on_common_seeds(first, other, other.label, True, values, settings)
            for other in others
        ]
        adjusted = tuple(claims.adjusted([row for row in rows if row is not None]))
        if adjusted:
            found.append((name, first.label, adjusted))
    return found


def _table(results: Results, settings: ReportSettings) -> Table:
    """Return what each setting does to success, verdicts and steps."""
    rows, level = [], settings.confidence
    for group in groups(results):
        first, *others = group
        p_values = holm(
            [fisher_exact(measures.success(first), measures.success(c)) for c in others]
        )
        contacts = holm(
            [fisher_exact(measures.refuted(first), measures.refuted(c)) for c in others]
        )
        for c, p, touching in zip(group, (None, *p_values), (None, *contacts), strict=True):
            met, refuted = (
                measures.text(measures.success(c), level),
                measures.text(measures.refuted(c), level),
            )
            beyond = markdown.spread(spread(c.column("term_oversized_steps")))
            rows.append((c.label, met, _p(p), refuted, _p(touching), beyond))
    headers = (
        "condition",
        "goal met",
        "p",
        "of these refuted",
        "p",
        "steps beyond the scope, of a path",
    )
    note = (
        "p: against the first condition of the task, Fisher's exact test, Holm over the task's "
        "conditions."
    )
    return Table("Shares of runs", headers, tuple(rows), note)


def _checks(results: Results) -> tuple[tuple[str, str], ...]:
    return tuple(
        (
            "Residual floor",
            f"slope of log residual over log scope {residual_floor.slope(task):.2f}; 1: "
            "proportional",
        )
        for task in _scopes(results)
    )


def _p(p: float | None) -> str:
    return "–" if p is None else markdown.p_value(p)


def _scopes(results: Results) -> tuple[Task, ...]:
    """Return the tasks whose scopes differ and that never end by reaching the goal."""
    if any(len(set(c.planner.scope)) > 1 for c in results.main):  # joint by joint another one
        return ()
    found = measures.tasks(results, "scope", "")
    return tuple(t for t in found if len(t.values) > 1 and not any(c.solved for c in t.conditions))


def _drawings(
    results: Results,
    settings: ReportSettings,
    compared: list[tuple[str, str, tuple[Comparison, ...]]],
) -> tuple[Drawing, ...]:
    shown, level = results.with_data, f"{100 * settings.confidence:g} %"
    drawn = []
    for task in _scopes(results):
        caption = (
            "The goal's tolerance is too small to be met, so every search ends by stagnation: "
            "how near it came. Points: runs; bars: medians and quartiles. A step has the size of "
            "the scope, so it seldom lands nearer than some share of it."
        )
        table = partial(residual_floor.floor_table, task)
        drawn.append(
            Drawing(
                "floor",
                "Residual floor",
                caption,
                table,
                residual_floor.draw_floor,
                task.conditions,
            )
        )
    parents = tuple(task for task in measures.tasks(results, "num_parents") if len(task.values) > 1)
    if parents:
        drawn.append(_effort(parents, settings))
    if any(c.solved for c in shown) and not parents:
        rows = [
            (name, results.position(c.label), c.label, count(c))
            for name, count in (
                ("goal met", measures.success),
                ("of these: touch between postures", measures.refuted),
            )
            for c in shown
        ]
        table = partial(shares.shares_table, rows, {}, settings.confidence)
        drawn.append(
            Drawing(
                "shares",
                "Shares of runs",
                f"Wilson's {level} intervals.",
                table,
                shares.draw_shares,
                shown,
            )
        )
    if not parents and not _scopes(results):
        table = partial(
            effects.values_table,
            results._replace(conditions=results.main),
            {"evaluations to the goal": effort, "steps of the path": measures.num_steps},
        )
        drawn.append(
            Drawing("values", "Every condition", VALUES, table, effects.draw_values, shown)
        )
        by_name = {name: rows for name, _, rows in compared}
        table = partial(effects.effects_table, by_name, settings.significance)
        drawn.append(
            Drawing(
                "effects",
                f"How often {shown[0].label} is better",
                EFFECTS,
                table,
                effects.draw_effects,
                shown,
            )
        )
    return tuple(drawn)


VALUES = (
    "Boxes: median and quartiles, whiskers to the last value within 1.5 interquartile ranges, "
    "every replicate a point; dashed: median of the first condition; never: runs that do not "
    "meet the goal."
)
EFFECTS = (
    "Vargha and Delaney's A12 with its bootstrap interval: the share of pairs of runs in which "
    "the first condition takes fewer evaluations to the goal than the other one; dashed: no "
    "difference."
)


def _effort(found: tuple[Task, ...], settings: ReportSettings) -> Drawing:
    metrics = {"evaluations [-]": METRICS["evaluations"]}
    counts = {"goal met": measures.success}
    return Drawing(
        "effort",
        "Success and effort against the number of parents",
        "Left: share of runs that meet the goal; right: expected running time, failures counted; "
        f"{100 * settings.confidence:g} % intervals. Dashed: {PRINTED_PARENTS:g}, which the paper "
        "names typical.",
        partial(
            population_effort.effort_table,
            found,
            counts,
            metrics,
            settings.confidence,
            settings.num_resamples,
        ),
        partial(population_effort.draw_effort, setting="parents μ [-]", marked=PRINTED_PARENTS),
        tuple(c for task in found for c in task.conditions),
    )
