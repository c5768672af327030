"""Corsépius 2001: settings side by side, per task the first condition against each other one."""

from functools import partial

import numpy as np

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius import page as whole_page
from evoexp.papers.corsepius.figures import population_effort, residual_floor
from evoexp.papers.corsepius.measures import Task, text
from evoexp.records import FloatArray
from evoexp.report.kit import (
    Comparison,
    ConditionResults,
    Drawing,
    Page,
    ReportSettings,
    Results,
    Table,
    compared,
    fisher_exact,
    grouped,
    holm,
    markdown,
    solved,
    spread,
    success,
    sweep_figures,
)

PRINTED_PARENTS = 5.0  # "typical size 5" (section 4.2)
INTRODUCTION = (
    "Conditions of one task differ in one setting and share their seeds. Effort of a run that "
    "does not meet its goal counts as infinite where runs are compared, and as spent where "
    "expected running times are formed. The paper sweeps nothing; it says that the setting "
    "scales the algorithm (section 5) or is a next step (section 6)."
)
SHARES = (
    "condition",
    "goal met",
    "p",
    "of these refuted",
    "p",
    "steps beyond the scope, of a path",
)
NOTE = (
    "p: against the first condition of the task, Fisher's exact test, Holm over the task's "
    "conditions."
)
FLOOR = (
    "The goal's tolerance is too small to be met, so every search ends by stagnation: "
    "how near it came. Points: runs; bars: medians and quartiles. A step has the size of "
    "the scope, so it seldom lands nearer than some share of it."
)
VALUES = f"{sweep_figures.BOXES}; never: runs that do not meet the goal."
EFFECTS = (
    f"{sweep_figures.A12} the first condition takes fewer evaluations to the goal than the other "
    "one; dashed: no difference."
)
FirstComparison = tuple[str, str, tuple[Comparison, ...]]
"""(quantity, first condition of a task, its comparisons with each other one)."""


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of a sweep, or that of the tasks if there is nothing to compare."""
    if not measures.fits(results) or len(results.main) < 2:
        return whole_page.page(results, settings)
    found = comparisons(results, settings)
    slope = "slope of log residual over log scope {:.2f}; 1: proportional"
    return Page(
        title=f"Corsépius 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=whole_page.quantities(results),
        tables=(_table(results, settings),),
        checks=tuple(
            ("Residual floor", slope.format(residual_floor.slope(task)))
            for task in _scopes(results)
        ),
        comparisons=tuple((f"{name}: {first} against …", rows) for name, first, rows in found),
        drawings=_drawings(results, settings, found),
    )


def groups(results: Results) -> tuple[tuple[ConditionResults, ...], ...]:
    """Return the conditions by robot and scenario, controls included."""
    return grouped(results.with_data, measures.scene)


def effort(condition: ConditionResults) -> FloatArray:
    """Return the evaluations to the goal of each run, (done,); inf without it."""
    return np.where(solved(condition), measures.evaluations(condition), np.inf)


def comparisons(results: Results, settings: ReportSettings) -> list[FirstComparison]:
    """Compare the first condition of every task with each other one.

    P-values are adjusted over each task. If no run meets its goal, distances to it are compared.
    """
    reaching = any(c.solved for c in results.main)
    name = "evaluations to the goal" if reaching else "distance to the goal"
    values = effort if reaching else measures.residuals
    found = (
        (name, first.label, compared([(first, other) for other in others], values, settings))
        for first, *others in groups(results)
    )
    return [one for one in found if one[2]]


def _table(results: Results, settings: ReportSettings) -> Table:
    """Return success, verdicts and oversized steps of every condition."""
    rows, level = [], settings.confidence
    for first, *others in groups(results):
        met, touching = (
            holm([fisher_exact(count(first), count(c)) for c in others])
            for count in (success, measures.refuted)
        )
        for c, *p_values in zip((first, *others), (None, *met), (None, *touching), strict=True):
            p_met, p_touching = ("–" if p is None else markdown.p_value(p) for p in p_values)
            beyond = markdown.spread(spread(c.column("term_oversized_steps")))
            told = text(success(c), level), p_met, text(measures.refuted(c), level), p_touching
            rows.append((c.label, *told, beyond))
    return Table("Shares of runs", SHARES, tuple(rows), NOTE)


def _scopes(results: Results) -> tuple[Task, ...]:
    """Return the tasks whose scopes differ and that never end by reaching the goal."""
    if any(len(set(c.planner.scope)) > 1 for c in results.main):  # joint by joint another one
        return ()
    found = measures.tasks(results, "scope", "")
    return tuple(task for task in found if not any(c.solved for c in task.conditions))


def _drawings(
    results: Results, settings: ReportSettings, found: list[FirstComparison]
) -> tuple[Drawing, ...]:
    """Return the figures that the settings in which conditions differ allow."""
    scopes, parents = _scopes(results), measures.tasks(results, "num_parents")
    drawn = [
        Drawing(
            "floor",
            "Residual floor",
            FLOOR,
            partial(residual_floor.floor_table, task),
            residual_floor.draw_floor,
            task.conditions,
        )
        for task in scopes
    ]
    if parents:
        return (*drawn, _effort(parents, settings))
    shown = results.with_data
    if any(c.solved for c in shown):
        counts = {"goal met": success, "of these: touch between postures": measures.refuted}
        rows = [
            (name, results.position(c.label), c.label, count(c))
            for name, count in counts.items()
            for c in shown
        ]
        caption = f"Wilson's {100 * settings.confidence:g} % intervals."
        drawn.append(sweep_figures.shares_drawing(results, settings, rows, caption))
    if not scopes:
        values = {"evaluations to the goal": effort, "steps of the path": measures.num_steps}
        main = results._replace(conditions=results.main)
        boxes = sweep_figures.values_drawing(main, values, VALUES)
        by_name = {name: rows for name, _, rows in found}
        first = shown[0].label
        drawn += [
            boxes._replace(conditions=shown),
            sweep_figures.effects_drawing(results, settings, by_name, first, EFFECTS),
        ]
    return tuple(drawn)


def _effort(found: tuple[Task, ...], settings: ReportSettings) -> Drawing:
    """Return the figure of success and effort by the number of parents."""
    levels = settings.confidence, settings.num_resamples
    counts, efforts = {"goal met": success}, {"evaluations [-]": measures.evaluations}
    return Drawing(
        "effort",
        "Success and effort against the number of parents",
        "Left: share of runs that meet the goal; right: expected running time, failures counted; "
        f"{100 * settings.confidence:g} % intervals. Dashed: {PRINTED_PARENTS:g}, which the paper "
        "names typical.",
        partial(population_effort.effort_table, found, counts, efforts, *levels),
        partial(population_effort.draw_effort, setting="parents μ [-]", marked=PRINTED_PARENTS),
        tuple(c for task in found for c in task.conditions),
    )
