"""A replicate to write: seeded, with every kind of number that a log must carry."""

import hashlib
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from evoexp.records import Block, FrontRow, Generation, ReplicateSummary
from evoexp.store.log import Finished, Log

CONFIG = b'{"planner": "demo", "seed": 1}'
CONDITION = hashlib.sha256(CONFIG).hexdigest()
ENVIRONMENT = {"versions": {"numpy": "2.4.6"}, "cpu": {"features": ["avx2", "fma"]}}
SUMMARY = ReplicateSummary(
    condition=CONDITION,
    replicate=7,
    status="done",
    stop_reason="num_generations",
    num_generations=9,
    best_cost=math.inf,
    first_feasible_generation=None,
    evaluations=200,
    collision_queries=2**40 + 9,
    solved=False,
    certified=None,
    certified_margin=False,
    clearance=math.nan,
    clearance_at=2.5,
    clearance_pair="arm_1_link_2 – obstacle_1",
    refuted_at=None,
    refuted_pair="",
    length_unit="m",
    terms={"length": 3.5, "clearance": -0.0, "torque": math.nan},
    digest="",
    certificate_queries=12,
    certificate_s=0.001,
    cpu_s=0.25,
    wall_s=0.5,
)


def generations(num: int, seed: int = 0, reverse_terms: bool = False) -> list[Generation]:
    """Return generations of which the first three are infeasible, and about a third improve."""
    rng = np.random.default_rng(seed)
    rows, best_cost, best = [], math.inf, rng.random(12)
    for index in range(num):
        if index >= 3 and (index == 3 or rng.random() < 0.3):
            best_cost, best = 100.0 - index + rng.random(), rng.random(12)
        costs = rng.random(20)
        costs[::4] = math.inf
        terms = {
            "length": rng.random() if index >= 3 else math.inf,
            "clearance": -math.inf if index < 2 else -0.0,
            "torque": math.nan if index == 1 else 1e-300,
        }
        rows.append(
            Generation(
                index=index,
                best=best,
                best_cost=best_cost,
                best_cost_in_generation=best_cost,
                mean_cost=math.nan if index < 3 else rng.random(),
                std_cost=rng.random(),
                num_feasible=index,
                evaluations=20 * (index + 1),
                collision_queries=2**40 + index,
                solved=index >= 3,
                terms=dict(reversed(terms.items())) if reverse_terms else terms,
                costs=costs,
                population=rng.random((20, 12)),
            )
        )
    return rows


def write(
    written: Iterable[Generation],
    replicate: int = 7,
    fronts: Iterable[FrontRow] = (),
    seconds: Sequence[float] = (),
    **changes: Any,
) -> Finished:
    """Write a log of these generations, logged at the given seconds of CPU time."""
    rng = np.random.default_rng(5)
    log = Log(CONDITION, CONFIG, replicate, rng, {"map.txt": b"\x00\xff"}, ENVIRONMENT)
    criteria = {front.generation: front.criteria.T[None] for front in fronts}
    for row in written:
        rng.random()
        if row.index in criteria:
            row = row._replace(criteria=criteria[row.index])
        log.write(Block.of(row), seconds[row.index] if seconds else 0.0)
    return log.finish(SUMMARY._replace(replicate=replicate, **changes))
