"""The claims of Corsépius 2001 on single tasks, judged by their experiments."""

from collections.abc import Iterator

from evoexp.papers.corsepius import measures
from evoexp.report.kit import (
    Claim,
    ConditionResults,
    Judge,
    ReportSettings,
    Results,
    counted,
    fisher_exact,
    judging,
    markdown,
    solved,
    success,
    verdicts,
)

MANY_JOINTS = 6  # arms with more joints are redundant
TILTS = ("upright", "keep_parallel")
BALL = "ball"  # the object of the task whose planning time the paper prints


def judge_tasks(results: Results, settings: ReportSettings) -> tuple[Claim, ...]:
    """Judge the claims that the conditions of an experiment allow to judge."""
    judge, level, found = judging.judge(results, settings), settings.confidence, results.main
    arms = [c for c in found if measures.num_joints(c) > MANY_JOINTS]
    single = (
        (_free_of_collision(judge, c, level), *_tilt(judge, c), *_planning_time(c)) for c in found
    )
    stuck = (
        _stuck(judge, one, helped, level)
        for one in found
        for helped in found
        if measures.only_subgoals_differ(one, helped)
    )
    redundant = [_redundant(judge, arms, level)] if arms else []
    return (*(one for own in single for one in own), *redundant, *stuck)


def _free_of_collision(judge: Judge, condition: ConditionResults, level: float) -> Claim:
    """Judge that binary ratings of distances keep the whole motion free."""
    refuted, free = measures.refuted(condition), measures.certified(condition).having
    planned = refuted.total if condition.done == condition.planned else 0
    return judge.every(
        text=f"{condition.label}: paths avoid obstacles",
        source="section 4.3.3",
        evidence=(
            f"{markdown.share(free, refuted.total)} solved runs certified; refuted "
            f"{refuted.with_interval(level)}: postures are free, motions between them are not rated"
        ),
        holds=free,
        done=refuted.total,
        planned=planned,
    )


def _tilt(judge: Judge, condition: ConditionResults) -> Iterator[Claim]:
    """Judge that a grasped object is not tilted."""
    limits = {term: getattr(condition.planner.objective, term) for term in TILTS}
    for term, limit in limits.items():
        if limit is not None and condition.solved:
            at, between = (
                condition.column(f"term_greatest_{term}{part}_deg")[solved(condition)]
                for part in ("", "_between")
            )
            kept = counted(between <= limit.limit)
            told = (
                f"greatest tilt at postures {markdown.number(float(at.max()))}°, between them "
                f"{markdown.number(float(between.max()))}°, limit {limit.limit:g}°; within it all "
                f"the way: {markdown.share(*kept)} solved runs"
            )
            planned = len(at) if condition.done == condition.planned else 0
            what = f"{condition.label}: the grasped object is not tilted"
            yield judge.every(what, "section 6", told, *kept, planned)


def _redundant(judge: Judge, arms: list[ConditionResults], level: float) -> Claim:
    """Judge that the approach works for highly redundant arms: it finds a certified path."""
    free = {c.label: measures.certified(c).having for c in arms}
    texts = [
        f"{c.label}, {measures.num_joints(c)} joints: goal met "
        f"{success(c).with_interval(level)}, {free[c.label]} of them certified"
        for c in arms
    ]
    return judge.claim(
        text="The approach works for highly redundant arms",
        source="section 6",
        evidence=f"{'; '.join(texts)} (reproduced: a certified path, in one task at least)",
        verdict=verdicts.judged(any(free.values())),
    )


def _planning_time(condition: ConditionResults) -> Iterator[Claim]:
    """Set the planning time that the paper prints beside ours."""
    goals = [phase.goal for phase in condition.condition.scenario.phases]  # type: ignore[attr-defined]
    if [getattr(goal, "object", "") for goal in goals] != [BALL] or not condition.solved:
        return
    milliseconds = 1e3 * measures.usual_seconds(condition)
    cycles, shapes = measures.cycles(condition), measures.problem(condition).bodies.num_shapes
    told = (
        f"here {milliseconds.min():.2g} to {milliseconds.max():.2g} ms of search on one core, "
        f"{cycles.min():.0f} to {cycles.max():.0f} cycles; theirs: a Pentium III, and some 30 000 "
        f"spheres to this model's {shapes}"
    )
    what = f"{condition.label}: planning takes a couple of seconds up to a few minutes"
    yield Claim(what, "section 5", told, f"{verdicts.NOT_JUDGED} (another machine, another model)")


def _stuck(judge: Judge, stuck: ConditionResults, helped: ConditionResults, level: float) -> Claim:
    """Judge that the search gets stuck where the same task with a sub-goal finds a way."""
    one, two = success(helped), success(stuck)
    return judge.greater(
        text=f"{stuck.label}: the search gets stuck in a local minimum",
        source="section 6",
        evidence=(
            f"goal met {two.with_interval(level)}; {helped.label}: {one.with_interval(level)}; "
            f"Fisher's exact p = {markdown.p_value(fisher_exact(one, two))}; ended by stagnation: "
            f"{measures.reasons(stuck)['stagnation'].with_interval(level)}"
        ),
        one=one,
        two=two,
    )
