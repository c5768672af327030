"""Replicates that would take more memory than there is are refused before they begin."""

import os
from contextlib import suppress
from pathlib import Path

from evoexp.batch.runner_settings import RunnerSettings
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.input_files import MEGABYTE
from evoexp.store.log import MAX_LOG

GIGABYTE = 1000 * MEGABYTE
LEAST_RECORD = 250  # [B] of a generation in a log, without the paper's own terms
# [B] of a generation in a log with some terms; a log is kept in memory until it is finished
USUAL_RECORD = 500
_CONTAINER = Path("/sys/fs/cgroup/memory.max")


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
    if num_records * LEAST_RECORD > MAX_LOG:
        most = MAX_LOG // LEAST_RECORD
        must = f"of fewer than {most:,} generations: a log holds {MAX_LOG // MEGABYTE} MB"
        raise SettingError("planner", must, num_records)
    needed = replicate_memory(condition)
    if needed > allowed:
        whose = f"condition {label or condition.id[:12]}"
        must = f"at least {needed / GIGABYTE:,.2f}, the estimate of a replicate of {whose}"
        raise SettingError("runner.memory_gb", must, float(f"{allowed / GIGABYTE:.3g}"))
