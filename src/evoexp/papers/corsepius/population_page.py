"""Corsépius 2001, section 5: the size of the population, on every task."""

from functools import partial

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius import page as whole_page
from evoexp.papers.corsepius import population_claims as verdicts
from evoexp.papers.corsepius.figures import population_effort
from evoexp.papers.corsepius.measures import Task
from evoexp.papers.corsepius.population_claims import METRICS, RECOMMENDED, Against
from evoexp.report import markdown
from evoexp.report.judging import not_judged
from evoexp.report.page import Drawing, Page, Table
from evoexp.report.pages import generic
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results
from evoexp.report.statistics import Interval, expected_effort, expected_interval

SETTING = "num_offspring"
SCALES = {"cycles": (1.0, ""), "evaluations": (1.0, ""), "CPU time": (1e3, "ms")}
INTRODUCTION = (
    "λ individuals are generated per cycle, of which 5 are selected; all else is equal, seeds "
    "included. Expected running time: the effort of all runs, failed ones included, over the "
    "number of runs that met the goal: what a success costs if one starts again after every "
    "failure. Cycles stand for planning time on as many processors as individuals, evaluations "
    "for time on one; CPU time is that of the search here, at the median run's price of an "
    "evaluation, and has a fixed part per cycle, which weighs more where λ is small. A smaller λ "
    "is not only less search per cycle: selection is weaker, too (5 of λ)."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; that of the tasks where no size differs."""
    if not measures.fits(results) or not results.main:
        return generic.page(results, settings)
    found = tuple(task for task in measures.tasks(results, SETTING) if len(task.values) > 1)
    if not found:
        return whole_page.page(results, settings)
    why = not_judged(results)
    compared = {metric: verdicts.ratios(found, metric, settings) for metric in METRICS}
    return Page(
        title=f"Corsépius 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=whole_page.effort_quantities(results),
        tables=(_table(found, settings),),
        claims=verdicts.of_study(why, found, compared, settings),
        checks=CHECKS,
        drawings=_drawings(found, compared, settings),
    )


def _table(found: tuple[Task, ...], settings: ReportSettings) -> Table:
    """Return success and expected running times with their intervals, a row per task and size."""
    level, rows = settings.confidence, []
    for task in found:
        for value, c in zip(task.values, task.conditions, strict=True):
            shares = (
                measures.text(one, level) for one in (measures.success(c), measures.refuted(c))
            )
            rows.append(
                (
                    task.name,
                    f"{value:g}",
                    *shares,
                    *(_expected(c, metric, settings) for metric in METRICS),
                )
            )
    total = sum(c.done for task in found for c in task.conditions)
    note = (
        f"In brackets {100 * level:g} % intervals: Wilson's of shares, percentiles of "
        f"{settings.num_resamples} resamples of seeds for expected running times; {total} runs."
    )
    names = (
        f"expected {metric}{f' [{SCALES[metric][1]}]' if SCALES[metric][1] else ''}"
        for metric in METRICS
    )
    headers = ("task", "λ", "goal met", "of these refuted", *names)
    return Table("Success and expected running times", headers, tuple(rows), note)


def _expected(condition: ConditionResults, metric: str, settings: ReportSettings) -> str:
    if not condition.solved:
        return "∞"
    spent, having = METRICS[metric](condition), measures.solved(condition)
    scale = SCALES[metric][0]
    expected = expected_effort(spent, having)
    interval = expected_interval(spent, having, settings.confidence, settings.num_resamples)
    low, high = Interval(*(scale * value for value in interval))
    return f"{_round(scale * expected)} [{_round(low)}, {_round(high)}]"


def _round(value: float) -> str:
    return markdown.number(float(f"{value:.3g}"))


CHECKS = (
    (
        "Intervals of ratios",
        "by Bonferroni over all of a metric, so that the verdicts of one metric hold together; "
        "on common seeds",
    ),
    (
        "A task that no size solves",
        "says nothing of effort: the local minimum, `evoexp run experiment=corsepius_wall`",
    ),
    (
        "The narrow gate at the recommended size",
        "is a matter of the scope, too: `evoexp run experiment=corsepius_gate_narrow`",
    ),
)


def _drawings(
    found: tuple[Task, ...], compared: dict[str, list[Against]], settings: ReportSettings
) -> tuple[Drawing, ...]:
    level, names = f"{100 * settings.confidence:g} %", [task.name for task in found]
    shown = tuple(c for task in found for c in task.conditions)
    effort = {
        f"{metric} [{'s' if metric == 'CPU time' else '-'}]": values
        for metric, values in METRICS.items()
    }
    shares = {
        "goal met": measures.success,
        "of these: in contact between postures": measures.refuted,
    }
    label = "offspring per cycle λ [-]"
    drawn = [
        Drawing(
            "effort",
            "Success and effort against the size",
            "a: share of runs that meet the goal; b: of these, the share whose path touches "
            f"something between two postures; Wilson's {level} intervals. c–e: expected running "
            f"times, {level} bootstrap intervals; sizes without a success have no point. Dashed: "
            f"{RECOMMENDED:g}, which the paper recommends.",
            partial(
                population_effort.effort_table,
                found,
                shares,
                effort,
                settings.confidence,
                settings.num_resamples,
            ),
            partial(population_effort.draw_effort, setting=label, marked=RECOMMENDED),
            shown,
        )
    ]
    if any(compared.values()):
        caption = (
            f"Expected running times in units of that of {RECOMMENDED:g}, with intervals on "
            "common seeds, Bonferroni's over a panel. Above 1: worse. Dotted: as many more "
            "cycles as there are fewer individuals; above it the increase is over-proportional. "
            "Where one of the two never succeeds, there is no point."
        )
        table = partial(population_effort.ratios_table, compared, names, RECOMMENDED)
        draw = partial(population_effort.draw_ratios, setting="λ [-]")
        drawn.append(
            Drawing(
                "ratios", f"Effort against that of {RECOMMENDED:g}", caption, table, draw, shown
            )
        )
    return tuple(drawn)
