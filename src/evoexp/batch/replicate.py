"""The one loop: a planner yields blocks of generations, a log takes them, the best is judged."""

import hashlib
import time
from collections.abc import Callable
from typing import Any

from evoexp.attachments import SHA256
from evoexp.collision.box_support import EXACT
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.answers import judge_motion
from evoexp.records import Block, ReplicateSummary, blocks
from evoexp.registry import guests
from evoexp.store.identity import environment
from evoexp.store.log import Finished, Log

GENERATIONS = "generations"  # why a run ended that used all of them up
BUDGET_SPENT = "collision queries"  # why a run ended whose next generation exceeds the budget
EXACT_BOXES = "exact_boxes"  # the entry of a log's environment; logs without it are older
HASHED = f'"{SHA256}"'.encode()  # stands in configurations that refer to files, and only there


def run_replicate(
    condition: Condition,
    index: int,
    config_json: bytes | None = None,
    hear: Callable[[Block], None] | None = None,
) -> Finished:
    """Run one seeded replicate; return its finished log as bytes and its summary row.

    SettingError is raised where the budget does not suffice for the first generation.

    Args:
        config_json: The condition's canonical form, which takes as long as a short run to make.
        hear: Told every block of generations, after the log was.
    """
    config_json = config_json or condition.to_json()
    planner, problem = condition.prepare()  # kept: no part of a replicate's time
    begun_cpu_s, begun_s = time.process_time(), time.perf_counter()
    rng = condition.rng(index)
    files = condition.files() if HASHED in config_json else None
    around = environment(guests(config_json)) | {EXACT_BOXES: {"coal": EXACT}}
    condition_id = hashlib.sha256(config_json).hexdigest()
    log = Log(condition_id, config_json, index, rng, files, around)

    first_feasible, stop_reason, last = None, "", None
    for block in blocks(planner.evolve(problem, rng)):
        within = _within(block, condition.max_collision_queries)
        if within.num_generations > 0:
            log.write(within, time.process_time() - begun_cpu_s)
            last = within
            if hear is not None:
                hear(within)
            if first_feasible is None:
                counts = enumerate(within.num_feasible, within.first)
                first_feasible = next((k for k, count in counts if count > 0), None)
        if within is not block:
            stop_reason = BUDGET_SPENT
            break
    if last is None:
        raise SettingError(
            "budget.collision_queries",
            f"at least the queries of the initial population ({block.collision_queries[0]:,})",
            condition.max_collision_queries,
        )
    judged = _judged(planner, problem, last)
    return log.finish(
        ReplicateSummary(
            condition=condition_id,
            replicate=index,
            stop_reason=last.stop_reason or stop_reason or GENERATIONS,
            first_feasible_generation=first_feasible,
            length_unit=condition.length_unit,
            **judged,
            cpu_s=time.process_time() - begun_cpu_s,
            wall_s=time.perf_counter() - begun_s,
        )
    )


def _judged(planner: Any, problem: Any, last: Block) -> dict[str, Any]:
    begun_s, best = time.process_time(), last.bests[-1]
    verdict = judge_motion(planner, problem, planner.motion(problem, best.solution))
    certificate_s = time.process_time() - begun_s
    return verdict._asdict() | {
        "status": "done",
        "digest": "",  # the log knows it
        "num_generations": last.first + last.num_generations - 1,
        "best_cost": best.cost,
        "evaluations": last.evaluations[-1],
        "collision_queries": last.collision_queries[-1],
        "solved": best.solved,
        "terms": best.terms | planner.evaluate(problem, best.solution),
        "certificate_s": certificate_s,
    }


def _within(block: Block, most: float | None) -> Block:
    """Return the generations before the first that asks for more configurations than `most`."""
    queries = block.collision_queries
    if most is None or queries[-1] <= most:
        return block
    return block.head(next(k for k, count in enumerate(queries) if count > most))
