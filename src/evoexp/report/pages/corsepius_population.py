"""Corsépius 2001, section 5: the size of the population, on every task."""

from functools import partial

from evoexp.report import markdown
from evoexp.report.figures import population_effort
from evoexp.report.page import Drawing, Page
from evoexp.report.pages import corsepius, generic
from evoexp.report.pages import corsepius_measures as measures
from evoexp.report.pages import corsepius_population_verdicts as verdicts
from evoexp.report.pages.corsepius_measures import Task
from evoexp.report.pages.corsepius_population_verdicts import METRICS, RECOMMENDED, Against
from evoexp.report.pages.verdicts import not_judged
from evoexp.report.results import ConditionResults, Results
from evoexp.report.settings import ReportSettings
from evoexp.report.statistics import Interval, expected_effort, expected_interval

SETTING = "num_offspring"
SCALES = {"cycles": (1.0, ""), "evaluations": (1.0, ""), "CPU time": (1e3, " ms")}
INTRODUCTION = (
    "λ individuals are generated per cycle, of which 5 are selected; all else is equal, seeds included. Expected "
    "running time: the effort of all runs, failed ones included, over the number of runs that met the goal: what a "
    "success costs if one starts again after every failure. Cycles stand for planning time on as many processors as "
    "individuals, evaluations for time on one; CPU time is that of the search here, at the median run's price of an "
    "evaluation, and has a fixed part per cycle, which weighs more where λ is small. A smaller λ is not only less "
    "search per cycle: selection is weaker, too (5 of λ)."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; that of the tasks where no size differs."""
    if not measures.fits(results) or not results.main:
        return generic.page(results, settings)
    found = tuple(task for task in measures.tasks(results, SETTING) if len(task.values) > 1)
    if not found:
        return corsepius.page(results, settings)
    why = not_judged(results)
    compared = {metric: verdicts.ratios(found, metric, settings) for metric in METRICS}
    return Page(
        title=f"Corsépius 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=corsepius.effort_quantities(results),
        claims=verdicts.of_study(why, found, compared, settings),
        checks=_checks(found, settings),
        drawings=_drawings(found, compared, settings),
    )


def _checks(found: tuple[Task, ...], settings: ReportSettings) -> tuple[tuple[str, str], ...]:
    """Return, task by task, success and expected running times with their intervals."""
    rows, level = [], settings.confidence
    for task in found:
        lines = []
        for value, c in zip(task.values, task.conditions, strict=True):
            line = f"λ = {value:g}: goal met {measures.text(measures.success(c), level)}"
            lines.append(", ".join([line, *(_expected(c, metric, settings) for metric in METRICS if c.solved)]))
        if not any(c.solved for c in task.conditions):
            lines.append("the local minimum: `evoexp run experiment=corsepius_wall`")
        rows.append((f"{task.name}: success, expected running time", "; ".join(lines)))
    total = sum(c.done for task in found for c in task.conditions)
    text = (
        f"{100 * level:g} %: Wilson's of shares, percentiles of {settings.num_resamples} resamples of seeds for "
        f"efforts; of ratios by Bonferroni over all of a metric, so that verdicts hold together; {total} runs"
    )
    rows.append(("Intervals", text))
    return tuple(rows)


def _expected(condition: ConditionResults, metric: str, settings: ReportSettings) -> str:
    spent, having = METRICS[metric](condition), measures.solved(condition)
    scale, unit = SCALES[metric]
    expected = expected_effort(spent, having)
    interval = expected_interval(spent, having, settings.confidence, settings.num_resamples)
    low, high = Interval(*(scale * value for value in interval))
    return f"{metric} {_round(scale * expected)} [{_round(low)}, {_round(high)}]{unit}"


def _round(value: float) -> str:
    return markdown.number(float(f"{value:.3g}"))


def _drawings(
    found: tuple[Task, ...], compared: dict[str, list[Against]], settings: ReportSettings
) -> tuple[Drawing, ...]:
    level, names = f"{100 * settings.confidence:g} %", [task.name for task in found]
    shown = tuple(c for task in found for c in task.conditions)
    effort = {f"{metric} [{'s' if metric == 'CPU time' else '-'}]": values for metric, values in METRICS.items()}
    shares = {"goal met": measures.success, "of these: in contact between postures": measures.refuted}
    label = "offspring per cycle λ [-]"
    drawn = [
        Drawing(
            "effort",
            "Success and effort against the size",
            f"a: share of runs that meet the goal; b: of these, the share whose path touches something between two "
            f"postures; Wilson's {level} intervals. c–e: expected running times, {level} bootstrap intervals; sizes "
            f"without a success have no point. Dashed: {RECOMMENDED:g}, which the paper recommends.",
            partial(population_effort.effort_table, found, shares, effort, settings.confidence, settings.num_resamples),
            partial(population_effort.draw_effort, setting=label, marked=RECOMMENDED),
            shown,
        )
    ]
    if any(compared.values()):
        caption = (
            f"Expected running times in units of that of {RECOMMENDED:g}, with intervals on common seeds, Bonferroni's "
            "over a panel. Above 1: worse. Dotted: as many more cycles as there are fewer individuals; above it the "
            "increase is over-proportional. Where one of the two never succeeds, there is no point."
        )
        table = partial(population_effort.ratios_table, compared, names, RECOMMENDED)
        draw = partial(population_effort.draw_ratios, setting="λ [-]")
        drawn.append(Drawing("ratios", f"Effort against that of {RECOMMENDED:g}", caption, table, draw, shown))
    return tuple(drawn)
