"""The one loop: a planner yields generations, a log takes them, the certifier judges the best."""

import hashlib
from collections.abc import Callable, Iterator
from typing import NamedTuple

from evoexp.attachments import SHA256
from evoexp.batch.compile_clock import cpu_now, now
from evoexp.collision.box_support import EXACT
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.gathering import Run
from evoexp.planners.proofs import judge_motion
from evoexp.records import Generation, ReplicateSummary
from evoexp.registry import guests
from evoexp.store.log import Finished, Log
from evoexp.store.manifest import environment

GENERATIONS = "generations"  # why a run ended that used all of them up
BUDGET_SPENT = "collision queries"  # why a run ended whose next generation exceeds the budget
EXACT_BOXES = "exact_boxes"  # the entry of a log's environment; logs without it are older
HASHED = f'"{SHA256}"'.encode()  # stands in configurations that refer to files, and only there


def run_replicate(
    condition: Condition,
    index: int,
    config_json: bytes | None = None,
    hear: Callable[[Generation], None] | None = None,
) -> Finished:
    """Run one seeded replicate; return its finished log as bytes and its summary row.

    Args:
        condition: What to run.
        index: Of the replicate.
        config_json: The condition's canonical form, if the caller has it; making it takes as long
            as a short run.
        hear: Told every generation, after the log was.
    """
    planner, problem = condition.prepare()  # once per process: no part of a replicate's time
    begun = now()
    rng = condition.rng(index)
    config_json = config_json or condition.to_json()
    condition_id = hashlib.sha256(config_json).hexdigest()
    files = condition.files() if HASHED in config_json else None
    around = environment(guests(config_json)) | {EXACT_BOXES: {"coal": EXACT}}
    log = Log(condition_id, config_json, index, rng, files, around)
    generations, most = planner.evolve(problem, rng), condition.max_collision_queries
    if most is None and hear is None and isinstance(generations, Run):
        last, first_feasible, ended = _log_together(generations, log, begun.cpu_s)
    else:
        last, first_feasible, ended = _log_each(generations, log, begun.cpu_s, most, hear)
    evolved = now()
    verdict = judge_motion(planner, problem, planner.motion(problem, last.best))
    certified = now()
    summary = ReplicateSummary(
        condition=condition_id,
        replicate=index,
        status="done",
        stop_reason=ended,
        num_generations=last.index,
        best_cost=last.best_cost,
        first_feasible_generation=first_feasible,
        evaluations=last.evaluations,
        collision_queries=last.collision_queries,
        solved=last.solved,
        **verdict._asdict(),
        length_unit=condition.length_unit,
        terms=last.terms | planner.evaluate(problem, last.best),
        digest="",
        certificate_s=(certified - evolved).cpu_s,
        **(now() - begun)._asdict(),
    )
    return log.finish(summary)


class _Evolved(NamedTuple):
    """Entries of a summary that all generations together give."""

    last: Generation
    first_feasible: int | None  # index of the first generation with a feasible individual
    stop_reason: str


def _log_each(
    generations: Iterator[Generation],
    log: Log,
    begun_s: float,
    most: float | None,
    hear: Callable[[Generation], None] | None,
) -> _Evolved:
    """Log generations one by one, up to the first that asks for more configurations than `most`."""
    first_feasible: int | None = None
    last: Generation | None = None
    ended = GENERATIONS
    for generation in generations:
        if most is not None and generation.collision_queries > most:
            ended = BUDGET_SPENT
            break
        last = generation
        log.write(last, cpu_now() - begun_s)  # the planner knows nothing of files
        if hear is not None:
            hear(last)
        if first_feasible is None and last.num_feasible > 0:
            first_feasible = last.index
    if last is None:
        raise _too_few(most, generation)
    return _Evolved(last, first_feasible, last.stop_reason or ended)


def _log_together(run: Run, log: Log, begun_s: float) -> _Evolved:
    """Log generations many at a time."""
    first_feasible: int | None = None
    for stretch in run.stretches(lambda: cpu_now() - begun_s):
        log.write_stretch(stretch)
        if first_feasible is None and any(stretch.num_feasible):
            feasible = (k for k, count in enumerate(stretch.num_feasible) if count > 0)
            first_feasible = stretch.first + next(feasible)
    return _Evolved(stretch.last(), first_feasible, GENERATIONS)


def _too_few(most: float | None, first: Generation) -> SettingError:
    must = f"at least what the initial population asks for ({first.collision_queries:,})"
    return SettingError("budget.collision_queries", must, most)
