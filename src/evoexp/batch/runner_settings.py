"""How a batch is run, which is no part of any identity, and the memory that a replicate may take.

Replicates that would take more memory than there is are refused before they begin.
"""

import os
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from evoexp.condition import Condition
from evoexp.errors import demand
from evoexp.input_files import MEGABYTE
from evoexp.store.log import MAX_LOG
from evoexp.validation import Positive, Settings

MOST_WORKERS = 1000  # processes that one machine starts
GIGABYTE = 1000 * MEGABYTE
LEAST_RECORD = 250  # [B] of a generation in a log, without the paper's own terms
# [B] of a generation in a log with some terms; a log is kept in memory until it is finished
USUAL_RECORD = 500
_CONTAINER = Path("/sys/fs/cgroup/memory.max")


class RunnerSettings(Settings):
    """Settings of `conf/runner`."""

    # worker processes; None: as many as there are cores
    num_workers: Annotated[int, Field(ge=1, le=MOST_WORKERS)] | None
    # memory that one replicate may take, by its planner's estimate; what would take more is
    # refused before it begins, and what does take more in a worker fails [GB]. None: the
    # machine's, divided by the workers
    memory_gb: Positive | None = None
    # wall time that one replicate may take [s]; one that takes longer is run once more, then
    # it has failed. None: any time
    timeout_s: Positive | None = None
    # loky: processes of this machine (once started by it) | dask: of `distributed`
    backend: Literal["loky", "dask"] = "loky"
    # of a scheduler of `distributed` that runs already; None: one is started here, with
    # `num_workers` workers
    address: str | None = None


def machine_memory() -> int:
    """Return the memory of this machine, or of the container that this process is in [B]."""
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    with suppress(OSError, ValueError):
        memory = min(memory, int(_CONTAINER.read_text()))  # ValueError: `max`
    return memory


def allowed_memory(settings: RunnerSettings, num_workers: int) -> float:
    """Return the memory that one replicate may take [B]: as set, or each worker's equal share."""
    if settings.memory_gb is not None:
        return settings.memory_gb * GIGABYTE
    return machine_memory() / num_workers


def replicate_memory(condition: Condition) -> int:
    """Estimate the memory that a replicate of a condition takes, its log included [B]."""
    planner, problem = condition.prepare()
    log = min((planner.num_generations + 1) * USUAL_RECORD, MAX_LOG)
    return int(planner.memory(problem) + log)


def refuse_large(condition: Condition, allowed: float, label: str = "") -> None:
    """Refuse a condition whose replicates take more than is allowed [B], or too long a log."""
    planner, _ = condition.prepare()
    num_records = planner.num_generations + 1
    most = MAX_LOG // LEAST_RECORD
    must = f"one of fewer than {most:,} generations: a log holds {MAX_LOG // MEGABYTE} MB"
    demand(num_records <= most, "planner", must, num_records)
    needed, whose = replicate_memory(condition), f"condition {label or condition.id[:12]}"
    must = f"at least {needed / GIGABYTE:,.2f}, the estimate of a replicate of {whose}"
    demand(needed <= allowed, "runner.memory_gb", must, float(f"{allowed / GIGABYTE:.3g}"))
