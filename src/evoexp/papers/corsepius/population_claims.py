"""What Corsépius 2001 claims of the size of the population, metric by metric."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.measures import Task
from evoexp.records import FloatArray
from evoexp.report import claims, markdown
from evoexp.report.claims import Claim
from evoexp.report.judging import claim
from evoexp.report.pages.generic import Values
from evoexp.report.proportions import fisher_exact
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults
from evoexp.report.statistics import Interval, effort_ratio, expected_effort, holm

RECOMMENDED = 100.0  # individuals (section 5)
REASONABLE = (
    2.0  # [-] a size is reasonable where no other one takes less than half the effort; our reading
)
SOURCE = "section 5"
METRICS: dict[str, Values] = {
    "cycles": measures.cycles,
    "evaluations": measures.evaluations,
    "CPU time": measures.usual_seconds,
}


class Against(NamedTuple):
    """The effort of a size over that of the recommended one, expected running times both.

    Attributes:
        task: Name.
        value: The size.
        ratio: Of the expected efforts.
        interval: Of it.
        bound: What it is compared with: 1, or what would be proportional.
    """

    task: str
    value: float
    ratio: float
    interval: Interval
    bound: float

    @property
    def says(self) -> int:
        """1 if the ratio is above the bound, −1 if it is below, 0 if neither is certain."""
        return int(self.interval.low > self.bound) - int(self.interval.high < self.bound)


def of_study(
    why: str, found: tuple[Task, ...], compared: dict[str, list[Against]], settings: ReportSettings
) -> tuple[Claim, ...]:
    """Return the claims.

    Args:
        why: Why they are not to be judged; empty: judge them.
        found: Tasks with one condition per size.
        compared: Metric → every size against the recommended one.
        settings: Levels and resamples.
    """
    rows: list[Claim] = []
    for metric, own in compared.items():
        larger = [row for row in own if row.value > RECOMMENDED]
        rows += [_no_faster(why, metric, larger), _not_necessarily(why, metric, larger)]
    for metric, own in compared.items():
        rows.append(
            _over_proportional(why, metric, [row for row in own if row.value < RECOMMENDED])
        )
    rows.append(_converges_less(why, found, settings))
    rows += [_reasonable(why, metric, found, values) for metric, values in METRICS.items()]
    return tuple(rows)


def ratios(found: tuple[Task, ...], metric: str, settings: ReportSettings) -> list[Against]:
    """Return every size against the recommended one, task by task.

    Intervals are of one family: their levels are Bonferroni's over all of them. Tasks that neither
    size ever solves are left out.
    """
    pairs = []
    for task in found:
        own = task.at(RECOMMENDED)
        for value, c in zip(task.values, task.conditions, strict=True):
            if own is not None and value != RECOMMENDED and (own.solved or c.solved):
                pairs.append((task.name, value, c, own))
    level = 1.0 - (1.0 - settings.confidence) / max(1, len(pairs))
    rows = []
    for name, value, c, own in pairs:
        one, two = _on_common_seeds(c, own, METRICS[metric])
        above, below = expected_effort(*one), expected_effort(*two)
        ratio = above / below if np.isfinite(below) else 0.0
        proportional = RECOMMENDED / value if metric == "cycles" and value < RECOMMENDED else 1.0
        interval = effort_ratio(one, two, level, settings.num_resamples)
        rows.append(Against(name, value, ratio, interval, proportional))
    return rows


def _on_common_seeds(
    one: ConditionResults, two: ConditionResults, values: Values
) -> list[tuple[FloatArray, Any]]:
    """Return effort and success of the replicates that both have."""
    common = one.summaries.index.intersection(two.summaries.index)
    places = [c.summaries.index.get_indexer(common) for c in (one, two)]
    return [
        (values(c)[rows], measures.solved(c)[rows])
        for c, rows in zip((one, two), places, strict=True)
    ]


def told(rows: list[Against], says: int) -> str:
    """Return the ratios that say so, task by task: "ball × 1.8 (200), 3.4 (400)"."""
    by_task: dict[str, list[str]] = {}
    for row in rows:
        if row.says == says:
            by_task.setdefault(row.task, []).append(f"{_short(row.ratio)} ({row.value:g})")
    return "; ".join(f"{task} × {', '.join(texts)}" for task, texts in by_task.items()) or "none"


def _short(ratio: float) -> str:
    return markdown.number(float(f"{ratio:.2g}")) if np.isfinite(ratio) else "∞"


def _no_faster(why: str, metric: str, rows: list[Against]) -> Claim:
    """Judge that nothing larger is faster, on any task."""
    says = [row.says for row in rows]
    verdict = (
        claims.CONTRADICTED
        if -1 in says
        else claims.REPRODUCED
        if 1 in says
        else claims.INCONCLUSIVE
    )
    text = f"Larger populations do not plan faster, on any task: {metric}"
    evidence = (
        f"expected {metric} in units of those of 100 (of which λ): less for {told(rows, -1)}. "
        f"More for {told(rows, 1)} "
    )
    evidence += "(reproduced: none is faster, one at least is slower)"
    return claim(text, SOURCE, evidence, claims.NOT_JUDGED if why else verdict, why)


def _not_necessarily(why: str, metric: str, rows: list[Against]) -> Claim:
    """Judge the weaker reading: there are tasks on which nothing larger is faster."""
    names = list(dict.fromkeys(row.task for row in rows))
    never = [n for n in names if all(row.says >= 0 for row in rows if row.task == n)]
    slower = [n for n in never if any(row.says > 0 for row in rows if row.task == n)]
    verdict = claims.REPRODUCED if slower else claims.INCONCLUSIVE if never else claims.CONTRADICTED
    text = f"Larger populations do not necessarily plan faster: {metric}"
    evidence = (
        f"of {len(names)} tasks nothing larger than 100 is faster on {len(never)}: "
        f"{', '.join(never) or '–'}; "
    )
    evidence += f"something larger is slower on {len(slower)} of them (reproduced: on one at least)"
    return claim(text, SOURCE, evidence, claims.NOT_JUDGED if why else verdict, why)


def _over_proportional(why: str, metric: str, rows: list[Against]) -> Claim:
    """Judge that smaller populations cost over-proportionally more.

    On every task and at every size.
    """
    says = [row.says for row in rows]
    verdict = claims.CONTRADICTED if -1 in says else claims.INCONCLUSIVE
    if says and 0 not in says and -1 not in says:
        verdict = claims.REPRODUCED
    meaning = (
        "the ratio exceeds 100/λ"
        if metric == "cycles"
        else "the ratio exceeds 1: time goes with evaluations"
    )
    text = f"Smaller populations increase planning times over-proportionally: {metric}"
    evidence = (
        f"over-proportional: {meaning}. It does for {told(rows, 1)}. It is below for "
        f"{told(rows, -1)}. Not certain: {sum(one == 0 for one in says)} of {len(rows)} "
        "(reproduced: everywhere)"
    )
    return claim(text, SOURCE, evidence, claims.NOT_JUDGED if why else verdict, why)


def _converges_less(why: str, found: tuple[Task, ...], settings: ReportSettings) -> Claim:
    """Judge that smaller populations meet their goals less often."""
    pairs = []
    for task in found:
        own = task.at(RECOMMENDED)
        for value, c in zip(task.values, task.conditions, strict=True):
            if own is not None and value < RECOMMENDED and (own.solved or c.solved):
                pairs.append((task.name, value, measures.success(c), measures.success(own)))
    adjusted = holm([fisher_exact(one, two) for _, _, one, two in pairs])
    less, more, texts = 0, 0, []
    for (name, value, one, two), p in zip(pairs, adjusted, strict=True):
        if p < settings.significance:
            less, more = less + (one.share < two.share), more + (one.share > two.share)
            texts.append(f"{name} {value:g}: {markdown.share(*one)} for {markdown.share(*two)}")
    verdict = claims.CONTRADICTED if more else claims.REPRODUCED if less else claims.INCONCLUSIVE
    evidence = (
        f"goal met less often than with 100 in {less} of {len(pairs)} cases, more often in {more} "
        f"(Fisher's exact tests, Holm): {'; '.join(texts) or '–'} (reproduced: never more often, "
        "less often somewhere)"
    )
    text = "Smaller populations reduce convergence"
    return claim(text, SOURCE, evidence, claims.NOT_JUDGED if why else verdict, why)


def _reasonable(why: str, metric: str, found: tuple[Task, ...], values: Values) -> Claim:
    """Judge that 100 is a reasonable size.

    No other takes less than half its effort, on any task that can be solved.
    """
    texts, bad, known = [], 0, 0
    for task in found:
        efforts = {
            v: expected_effort(values(c), measures.solved(c))
            for v, c in zip(task.values, task.conditions, strict=True)
        }
        best = min(efforts, key=lambda value: efforts[value])
        if RECOMMENDED not in efforts or not np.isfinite(efforts[best]):
            continue
        factor = efforts[RECOMMENDED] / efforts[best]
        known, bad = known + 1, bad + (factor > REASONABLE)
        texts.append(f"{task.name} {_short(factor)} (best: {best:g})")
    verdict = claims.CONTRADICTED if bad else claims.REPRODUCED if known else claims.INCONCLUSIVE
    evidence = f"effort of 100 over that of the best size: {', '.join(texts) or '–'} "
    evidence += f"(reproduced: at most {REASONABLE:g} everywhere; our reading)"
    text = f"100 individuals are reasonable: {metric}"
    return claim(text, SOURCE, evidence, claims.NOT_JUDGED if why else verdict, why)
