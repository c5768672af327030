"""The worth of evolution in Lavoie & Boudreau 2001: the algorithm against its best control.

Controls draw uniformly where the algorithm evolves: sub-path by sub-path under the same loop, or
both sub-paths at once.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from evoexp.papers import run_values
from evoexp.papers.lavoie import measures
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import markdown

Runs = tuple[FloatArray, np.ndarray]
"""Evaluations of every run, and whether it ended with a solution."""


def judge_controls(
    judge: kit.Judge, results: kit.Results, settings: kit.ReportSettings
) -> Iterator[kit.Claim]:
    """Judge every condition against the best of its controls, in solutions and in effort."""
    pairs = [
        (own, best_control(controls))
        for own in results.with_data
        if not own.is_control and (controls := _controls(results, own))
    ]
    p_values = kit.holm(
        [kit.fisher_exact(kit.success(own), kit.success(control)) for own, control in pairs]
    )
    for (own, control), p_adjusted in zip(pairs, p_values, strict=True):
        yield more_solutions(judge, own, control, settings, p_adjusted, f"{own.label}: ")
        yield _less_effort(judge, own, control, settings)


def best_control(controls: Sequence[kit.ConditionResults]) -> kit.ConditionResults:
    """Return the control that solves most; of equal ones that of the least expected effort."""
    return min(controls, key=lambda c: (-kit.success(c).share, kit.expected_effort(*runs(c))))


def more_solutions(
    judge: kit.Judge,
    own: kit.ConditionResults,
    control: kit.ConditionResults,
    settings: kit.ReportSettings,
    p_adjusted: float | None = None,
    who: str = "",
) -> kit.Claim:
    """Judge that the algorithm finds more solutions than a control."""
    level, one, two = settings.confidence, kit.success(own), kit.success(control)
    p_value = kit.fisher_exact(one, two) if p_adjusted is None else p_adjusted
    low, high = kit.newcombe(one, two, level)
    within = solved_within(own, control)
    evidence = (
        f"runs with a solution: {measures.text(one, level)} against {measures.text(two, level)} "
        f"({control.label}), adjusted p = {markdown.p_value(p_value)} (Fisher, Holm over the "
        f"arms); evolution adds {100 * (one.share - two.share):.0f} "
        f"[{100 * low:.0f}, {100 * high:.0f}] points; within the algorithm's median effort the "
        f"control has solved {measures.text(within, level)}"
    )
    hearing = judge.on("more_solutions", who=who, control=f", {control.label}")
    return hearing.greater(evidence, one, two, p_value)


def _less_effort(
    judge: kit.Judge,
    own: kit.ConditionResults,
    control: kit.ConditionResults,
    settings: kit.ReportSettings,
) -> kit.Claim:
    """Judge that the algorithm takes fewer evaluations per solution than a control."""
    first, second = run_values.on_common_seeds(own, control, kit.by_column("evaluations"))
    expected = [kit.expected_effort(*each) for each in (first, second)]
    low, high = kit.effort_ratio(first, second, settings.confidence, settings.num_resamples)
    ratio = expected[0] / expected[1] if np.isfinite(expected[0]) else np.inf
    told = " against ".join(_whole(value) for value in expected)
    evidence = (
        f"expected running time {told} evaluations ({control.label}); ratio {ratio:.3g} "
        f"[{low:.3g}, {high:.3g}] ({100 * settings.confidence:g} % bootstrap interval over seeds)"
    )
    hearing = judge.on("less_effort", who=f"{own.label}: ", control=f", {control.label}")
    holds = None if low <= 1.0 <= high else high < 1.0
    return hearing.own(evidence, f"{len(first[0])} pairs", holds)


def runs(condition: kit.ConditionResults) -> Runs:
    """Return the evaluations of all runs, and which of them ended with a solution."""
    return condition.column("evaluations"), kit.solved(condition)


def solved_within(own: kit.ConditionResults, control: kit.ConditionResults) -> kit.Proportion:
    """Count the control's runs that are solved within the algorithm's median effort.

    The effort of a run of the algorithm without a solution is infinite.
    """
    most = np.median(measures.effort(own))
    return kit.counted(kit.solved(control) & (measures.effort(control) <= most))


def _controls(results: kit.Results, own: kit.ConditionResults) -> list[kit.ConditionResults]:
    """Return the controls that stand beside this very planner in the same scene."""
    same = own.condition.robot, own.condition.scenario, own.planner
    return [
        c
        for c in results.with_data
        if c.is_control and (c.condition.robot, c.condition.scenario, c.planner) == same
    ]


def _whole(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else "∞"
