"""The claims of Corsépius 2001 on single tasks, judged by their experiments."""

from collections.abc import Iterator

from evoexp.papers import run_values
from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.rules import RULES
from evoexp.report import kit
from evoexp.report.kit import judging, markdown

TILTS = ("upright", "keep_parallel")
BALL = "ball"  # the object of the task whose planning time the paper prints


def judge_tasks(results: kit.Results, settings: kit.ReportSettings) -> tuple[kit.Claim, ...]:
    """Judge the claims that the conditions of an experiment allow to judge."""
    judge, level = judging.judge(results, settings, RULES), settings.confidence
    found = measures.among_obstacles(results.main)
    many = RULES["redundant_arms"].limits["joints"]
    arms = [c for c in found if run_values.num_joints(c) > many]
    single = (
        (
            judge_met(judge, c, level),
            judge_free(judge, c, level),
            *_tilt(judge, c),
            *_planning_time(judge, c),
        )
        for c in found
    )
    stuck = (
        _stuck(judge, one, helped, level)
        for one in found
        for helped in found
        if measures.only_subgoals_differ(one, helped)
    )
    pairs = measures.with_empty_scenes(results.main)
    redundant = [judge_redundant(judge, arms, level)] if arms else []
    at_obstacles = [_at_obstacles(judge, pairs)] if pairs else []
    return (*(one for own in single for one in own), *redundant, *stuck, *at_obstacles)


def judge_met(judge: kit.Judge, condition: kit.ConditionResults, level: float) -> kit.Claim:
    """Judge that goals given in work space are met by a search in configuration space."""
    met = kit.success(condition)
    told = f"goal met {met.with_interval(level)}"
    return judge.on("goals_met", who=condition.label).majority(told, *met)


def judge_free(judge: kit.Judge, condition: kit.ConditionResults, level: float) -> kit.Claim:
    """Judge that binary ratings of distances keep the whole motion free."""
    refuted, free = measures.refuted(condition), run_values.certified(condition).having
    planned = refuted.total if condition.done == condition.planned else 0
    told = (
        f"{markdown.share(free, refuted.total)} solved runs certified; refuted "
        f"{refuted.with_interval(level)}: postures are free, motions between them are not rated"
    )
    allowed = measures.allowed_contacts(condition)
    if allowed:
        told += f"; may touch, {allowed.limit:g} {allowed.unit} deep at most: {allowed.pairs}"
    hearing = judge.on("paths_avoid_obstacles", who=condition.label)
    return hearing.every(told, free, refuted.total, planned)


def _tilt(judge: kit.Judge, condition: kit.ConditionResults) -> Iterator[kit.Claim]:
    """Judge that a grasped object is not tilted."""
    limits = {term: getattr(condition.planner.objective, term) for term in TILTS}
    for term, limit in limits.items():
        if limit is not None and condition.solved:
            at, between = (
                condition.column(f"term_greatest_{term}{part}_deg")[kit.solved(condition)]
                for part in ("", "_between")
            )
            kept = kit.counted(between <= limit.limit)
            told = (
                f"greatest tilt at postures {markdown.number(float(at.max()))}°, between them "
                f"{markdown.number(float(between.max()))}°, limit {limit.limit:g}°; within it all "
                f"the way: {markdown.share(*kept)} solved runs"
            )
            planned = len(at) if condition.done == condition.planned else 0
            yield judge.on("not_tilted", who=condition.label).every(told, *kept, planned)


def judge_redundant(judge: kit.Judge, arms: list[kit.ConditionResults], level: float) -> kit.Claim:
    """Judge that the approach works for highly redundant arms: it finds a certified path."""
    free = {c.label: run_values.certified(c).having for c in arms}
    texts = [
        f"{c.label}, {run_values.num_joints(c)} joints: goal met "
        f"{kit.success(c).with_interval(level)}, {free[c.label]} of them certified"
        for c in arms
    ]
    runs = sum(c.done for c in arms)
    return judge.on("redundant_arms").own("; ".join(texts), runs, any(free.values()))


def _planning_time(judge: kit.Judge, condition: kit.ConditionResults) -> Iterator[kit.Claim]:
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
    verdict = f"{judging.NOT_JUDGED} (another machine, another model)"
    yield judge.on("planning_time", who=condition.label).made(told, condition.done, verdict)


def _stuck(
    judge: kit.Judge, stuck: kit.ConditionResults, helped: kit.ConditionResults, level: float
) -> kit.Claim:
    """Judge that the search gets stuck where the same task with a sub-goal finds a way."""
    one, two = kit.success(helped), kit.success(stuck)
    told = (
        f"goal met {two.with_interval(level)}; {helped.label}: {one.with_interval(level)}; "
        f"Fisher's exact p = {markdown.p_value(kit.fisher_exact(one, two))}; ended by stagnation: "
        f"{measures.reasons(stuck)['stagnation'].with_interval(level)}"
    )
    return judge.on("stuck_without_sub_goal", who=stuck.label).greater(told, one, two)


def _at_obstacles(
    judge: kit.Judge, pairs: list[tuple[kit.ConditionResults, kit.ConditionResults]]
) -> kit.Claim:
    """Judge that obstacles, and nothing else, keep the search from its goals."""
    shares = [(c.label, kit.success(c), kit.success(empty)) for c, empty in pairs]
    adjusted = kit.holm([kit.fisher_exact(own, empty) for _, own, empty in shares])
    texts = [
        f"{label} {markdown.share(*own)}, empty scene {markdown.share(*empty)}, p = "
        f"{markdown.p_value(p)}"
        for (label, own, empty), p in zip(shares, adjusted, strict=True)
    ]
    less = [own.share < empty.share for _, own, empty in shares]
    clear = [p < judge.significance for p in adjusted]
    stuck = any(a and b for a, b in zip(less, clear, strict=True))
    holds = True if stuck else None if any(less) else False
    runs = sum(own.total + empty.total for _, own, empty in shares)
    return judge.on("stuck_at_obstacles").own("; ".join(texts), runs, holds)
