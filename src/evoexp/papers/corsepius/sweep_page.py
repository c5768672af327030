"""Corsépius 2001: settings side by side, and the size of the population (section 5)."""

from collections.abc import Callable, Mapping
from functools import partial

from evoexp.papers.corsepius import claims, measures
from evoexp.papers.corsepius import page as whole_page
from evoexp.papers.corsepius.claims import METRICS, RECOMMENDED, SizeComparison
from evoexp.papers.corsepius.figures import population_effort
from evoexp.papers.corsepius.measures import Task
from evoexp.papers.corsepius.rules import PAPER, RULES
from evoexp.planners.posture_es.planner import PostureEs
from evoexp.report import kit
from evoexp.report.kit import judging, markdown, sweep_figures

PRINTED_PARENTS = 5.0  # "typical size 5" (section 4.2)
EFFECTS = "the first condition takes fewer evaluations to the goal than the other one"
SETTING = "num_offspring"
SCALES = {"cycles": 1.0, "evaluations": 1.0, "CPU time": 1e3}  # [1/s] of a time
# evaluations to the goal, and steps of the path to it, (done,); inf without it
effort = kit.where_solved(measures.evaluations)
steps_to_goal = kit.where_solved(measures.num_steps)


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of a sweep, or that of the tasks if there is nothing to compare."""
    if not kit.planned_by(results, PostureEs) or len(results.main) < 2:
        return whole_page.page(results, settings)
    found = comparisons(results, settings)
    slope = "slope of log residual over log scope {:.2f}; 1: proportional"
    return PAPER.page(
        results,
        "sweep",
        quantities=whole_page.quantities(results),
        tables=(_table(results, settings), *_floors(results)),
        checks=tuple(
            (f"Residual floor, {task.name}", slope.format(population_effort.slope(task)))
            for task in _scopes(results)
        ),
        comparisons=kit.headed(found),
        drawings=_drawings(results, settings, found),
    )


def comparisons(
    results: kit.Results, settings: kit.ReportSettings
) -> tuple[kit.FamilyComparison, ...]:
    """Compare the first condition of every task with each other one.

    P-values are adjusted over each task. If no run meets its goal, distances to it are compared.
    """
    measure = kit.Measure("distance to the goal", measures.residuals)
    if any(c.solved for c in results.main):
        measure = kit.Measure("evaluations to the goal", effort)
    families = map(kit.Family.of, kit.grouped(results.with_data, measures.scene))
    return kit.compare_families(families, [measure], settings)


def _table(results: kit.Results, settings: kit.ReportSettings) -> kit.Table:
    """Return success, verdicts and oversized steps of every condition."""
    rows, level = [], settings.confidence
    for first, *others in kit.grouped(results.with_data, measures.scene):
        met, touching = (
            [
                "–",
                *map(
                    markdown.p_value,
                    kit.holm([kit.fisher_exact(count(first), count(c)) for c in others]),
                ),
            ]
            for count in (kit.success, measures.refuted)
        )
        for c, p_met, p_touching in zip((first, *others), met, touching, strict=True):
            goal_met, refuted = kit.success(c).with_interval(level), measures.refuted(c)
            beyond = markdown.spread(kit.spread(c.column("term_oversized_steps")))
            told = goal_met, p_met, refuted.with_interval(level), p_touching, beyond
            rows.append((c.label, *told))
    return PAPER.table("shares", rows)


def _floors(results: kit.Results) -> tuple[kit.Table, ...]:
    """Return the distances at which searches stagnate, if no goal can be met."""
    if not _scopes(results):
        return ()
    rows = tuple(
        (
            c.label,
            markdown.spread(kit.spread(1e3 * measures.residuals(c))),
            markdown.spread(kit.spread(measures.cycles(c))),
        )
        for c in results.main
    )
    return (PAPER.table("floors", rows, unit=results.main[0].condition.length_unit),)


def _scopes(results: kit.Results) -> tuple[Task, ...]:
    """Return the tasks whose scopes differ and that never end by reaching the goal."""
    if any(len(set(c.planner.scope)) > 1 for c in results.main):  # joint by joint another one
        return ()
    found = measures.tasks(results, "scope", "")
    return tuple(task for task in found if not any(c.solved for c in task.conditions))


def _drawings(
    results: kit.Results, settings: kit.ReportSettings, found: tuple[kit.FamilyComparison, ...]
) -> tuple[kit.Drawing, ...]:
    """Return the figures that the settings in which conditions differ allow."""
    scopes, parents = _scopes(results), measures.tasks(results, "num_parents")
    drawn = [
        PAPER.drawing("floor", population_effort.FLOOR, _conditions(scopes), scopes)
        for _ in scopes[:1]
    ]
    if parents:
        counts, efforts = {"goal met": kit.success}, {"evaluations [-]": measures.evaluations}
        given = parents, counts, efforts, settings
        return (*drawn, _effort("parents_effort", *given, "parents μ [-]", PRINTED_PARENTS))
    shown = results.with_data
    if any(c.solved for c in shown):
        counts = {"goal met": kit.success, "of these: touch between postures": measures.refuted}
        rows = [
            (name, results.position(c.label), c.label, count(c))
            for name, count in counts.items()
            for c in shown
        ]
        caption = f"Wilson's {100 * settings.confidence:g} % intervals."
        drawn.append(sweep_figures.shares_drawing(results, settings, rows, caption))
    if not scopes:
        values = {"evaluations to the goal": effort, "steps of the path to it": steps_to_goal}
        main = results._replace(conditions=results.main)
        boxes = sweep_figures.values_drawing(main, values)
        by_name = {one.measure.name: one.rows for one in found if one.rows}
        first = shown[0].label
        drawn += [
            boxes._replace(conditions=shown),
            *sweep_figures.effects_drawings(results, settings, by_name, first, EFFECTS),
        ]
    return tuple(drawn)


def _conditions(tasks: tuple[Task, ...]) -> tuple[kit.ConditionResults, ...]:
    return tuple(c for task in tasks for c in task.conditions)


def _effort(
    name: str,
    found: tuple[Task, ...],
    counts: Mapping[str, Callable[[kit.ConditionResults], kit.Proportion]],
    efforts: Mapping[str, kit.Values],
    settings: kit.ReportSettings,
    setting: str,
    marked: float,
) -> kit.Drawing:
    """Return the figure of success and effort by a setting, with the printed value marked."""
    draw = partial(population_effort.draw_effort, setting=setting, marked=marked)
    arguments = found, counts, efforts, settings.confidence, settings.num_resamples
    functions, level = (population_effort.effort_table, draw), 100 * settings.confidence
    shown = _conditions(found)
    return PAPER.drawing(name, functions, shown, *arguments, level=level, size=marked)


def population_page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of sizes, or that of the tasks if no size differs."""
    found = measures.tasks(results, SETTING) if kit.planned_by(results, PostureEs) else ()
    if not found:
        return whole_page.page(results, settings)
    sizes = {metric: claims.compare_sizes(found, metric, settings) for metric in METRICS}
    judge = judging.judge(results, settings, RULES)
    return PAPER.page(
        results,
        "sizes",
        quantities=whole_page.effort_quantities(results),
        tables=(_size_table(found, settings),),
        claims=claims.judge_study(judge, found, sizes),
        checks=PAPER.checks("sizes"),
        drawings=_size_drawings(found, sizes, settings),
    )


def _size_table(found: tuple[Task, ...], settings: kit.ReportSettings) -> kit.Table:
    """Return success and expected running times with their intervals, a row per task and size."""
    level = settings.confidence
    rows = tuple(
        (
            task.name,
            f"{value:g}",
            kit.success(c).with_interval(level),
            measures.refuted(c).with_interval(level),
            *(_expected(c, metric, settings) for metric in METRICS),
        )
        for task in found
        for value, c in task.by_value.items()
    )
    runs = sum(c.done for c in _conditions(found))
    resamples = settings.num_resamples
    return PAPER.table("sizes", rows, level=100 * level, resamples=resamples, runs=runs)


def _expected(condition: kit.ConditionResults, metric: str, settings: kit.ReportSettings) -> str:
    """Return the expected running time with its interval."""
    if not condition.solved:
        return "∞"
    runs = METRICS[metric](condition), kit.solved(condition)
    interval = kit.expected_interval(*runs, settings.confidence, settings.num_resamples)
    expected, low, high = (
        markdown.number(float(f"{SCALES[metric] * value:.3g}"))
        for value in (kit.expected_effort(*runs), *interval)
    )
    return f"{expected} [{low}, {high}]"


def _size_drawings(
    found: tuple[Task, ...], sizes: dict[str, list[SizeComparison]], settings: kit.ReportSettings
) -> tuple[kit.Drawing, ...]:
    """Return the figures of effort, and of ratios where there are any."""
    units = (f"{metric} [{'s' if metric == 'CPU time' else '-'}]" for metric in METRICS)
    efforts = dict(zip(units, METRICS.values(), strict=True))
    counts = {"goal met": kit.success, "of these: in contact between postures": measures.refuted}
    given = found, counts, efforts, settings
    drawn = _effort("size_effort", *given, "offspring per cycle λ [-]", RECOMMENDED)
    if not any(sizes.values()):
        return (drawn,)
    ratios = (
        population_effort.ratios_table,
        partial(population_effort.draw_ratios, setting="λ [-]"),
    )
    names = [task.name for task in found]
    arguments = sizes, names, RECOMMENDED
    shown = _conditions(found)
    return drawn, PAPER.drawing("ratios", ratios, shown, *arguments, size=RECOMMENDED)
