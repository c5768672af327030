"""Corsépius 2001, section 5: the size of the population, on every task."""

from functools import partial

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius import page as whole_page
from evoexp.papers.corsepius import population_claims as verdicts
from evoexp.papers.corsepius.figures import population_effort
from evoexp.papers.corsepius.measures import Task, text
from evoexp.papers.corsepius.population_claims import METRICS, RECOMMENDED, SizeComparison
from evoexp.report.kit import (
    ConditionResults,
    Drawing,
    Page,
    ReportSettings,
    Results,
    Table,
    expected_effort,
    expected_interval,
    generic,
    judging,
    markdown,
    solved,
    success,
)

SETTING = "num_offspring"
SCALES = {"cycles": (1.0, ""), "evaluations": (1.0, ""), "CPU time": (1e3, " [ms]")}
INTRODUCTION = (
    "λ individuals are generated per cycle, of which 5 are selected; all else is equal, seeds "
    "included. Expected running time: the effort of all runs, failed ones included, over the "
    "number of runs that met the goal: the price of a success if one starts again after every "
    "failure. Cycles stand for planning time on as many processors as individuals, evaluations "
    "for time on one; CPU time is that of the search here, at the median run's price of an "
    "evaluation, and has a fixed part per cycle, which weighs more where λ is small. A smaller λ "
    "is not only less search per cycle: selection is weaker, too (5 of λ)."
)
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


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of sizes, or that of the tasks if no size differs."""
    if not measures.fits(results) or not results.main:
        return generic.page(results, settings)
    found = measures.tasks(results, SETTING)
    if not found:
        return whole_page.page(results, settings)
    compared = {metric: verdicts.compare_sizes(found, metric, settings) for metric in METRICS}
    judge = judging.judge(results, settings)
    return Page(
        title=f"Corsépius 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=whole_page.effort_quantities(results),
        tables=(_table(found, settings),),
        claims=verdicts.judge_study(judge, found, compared, settings),
        checks=CHECKS,
        drawings=_drawings(found, compared, settings),
    )


def _table(found: tuple[Task, ...], settings: ReportSettings) -> Table:
    """Return success and expected running times with their intervals, a row per task and size."""
    level = settings.confidence
    rows = tuple(
        (
            task.name,
            f"{value:g}",
            text(success(c), level),
            text(measures.refuted(c), level),
            *(_expected(c, metric, settings) for metric in METRICS),
        )
        for task in found
        for value, c in task.by_value.items()
    )
    note = (
        f"In brackets {100 * level:g} % intervals: Wilson's of shares, percentiles of "
        f"{settings.num_resamples} resamples of seeds for expected running times; "
        f"{sum(c.done for task in found for c in task.conditions)} runs."
    )
    names = (f"expected {metric}{SCALES[metric][1]}" for metric in METRICS)
    headers = ("task", "λ", "goal met", "of these refuted", *names)
    return Table("Success and expected running times", headers, rows, note)


def _expected(condition: ConditionResults, metric: str, settings: ReportSettings) -> str:
    """Return the expected running time with its interval."""
    if not condition.solved:
        return "∞"
    runs = METRICS[metric](condition), solved(condition)
    interval = expected_interval(*runs, settings.confidence, settings.num_resamples)
    expected, low, high = (
        markdown.number(float(f"{SCALES[metric][0] * value:.3g}"))
        for value in (expected_effort(*runs), *interval)
    )
    return f"{expected} [{low}, {high}]"


def _drawings(
    found: tuple[Task, ...], compared: dict[str, list[SizeComparison]], settings: ReportSettings
) -> tuple[Drawing, ...]:
    """Return the figures of effort, and of ratios where there are any."""
    level = f"{100 * settings.confidence:g} %"
    shown = tuple(c for task in found for c in task.conditions)
    units = (f"{metric} [{'s' if metric == 'CPU time' else '-'}]" for metric in METRICS)
    effort = dict(zip(units, METRICS.values(), strict=True))
    shares = {"goal met": success, "of these: in contact between postures": measures.refuted}
    levels = settings.confidence, settings.num_resamples
    efforts = Drawing(
        "effort",
        "Success and effort against the size",
        "a: share of runs that meet the goal; b: of these, the share whose path touches "
        f"something between two postures; Wilson's {level} intervals. c–e: expected running "
        f"times, {level} bootstrap intervals; sizes without a success have no point. Dashed: "
        f"{RECOMMENDED:g}, which the paper recommends.",
        partial(population_effort.effort_table, found, shares, effort, *levels),
        partial(
            population_effort.draw_effort, setting="offspring per cycle λ [-]", marked=RECOMMENDED
        ),
        shown,
    )
    names = [task.name for task in found]
    ratios = Drawing(
        "ratios",
        f"Effort against that of {RECOMMENDED:g}",
        f"Expected running times in units of that of {RECOMMENDED:g}, with intervals on "
        "common seeds, Bonferroni's over a panel. Above 1: worse. Dotted: as many more "
        "cycles as there are fewer individuals; above it the increase is over-proportional. "
        "Where one of the two never succeeds, there is no point.",
        partial(population_effort.ratios_table, compared, names, RECOMMENDED),
        partial(population_effort.draw_ratios, setting="λ [-]"),
        shown,
    )
    return (efforts, ratios) if any(compared.values()) else (efforts,)
