"""Small batches."""

import os
from pathlib import Path
from typing import Any

from evoexp.batch.jobs import Outcome
from evoexp.batch.runner import Batch
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.condition import Condition
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory

WORDS = (
    *("experiment=rana_obstacles", "scenario=rana_planar", "planner._target_=faulty"),
    *("ga.population_size=8", "ga.num_generations=3", "planner.num_new_trajectories=1"),
    "num_replicates=12",
)


def new_batch(
    outputs: Path,
    *wanted: tuple[Condition, int],
    retry_failed: bool = False,
    curves: Path | None = None,
    **settings: Any,
) -> Batch:
    runner = RunnerSettings(**{"num_workers": 1} | settings)
    conditions = [(condition, count, {"label": "test"}) for condition, count in wanted]
    return Batch(conditions, runner, outputs, retry_failed=retry_failed, curves=curves)


def run(outputs: Path, *wanted: tuple[Condition, int], **settings: Any) -> list[Outcome]:
    return list(new_batch(outputs, *wanted, **settings).run())


def failures(outcomes: list[Outcome]) -> dict[int, str]:
    """Return replicate → reason of those that failed; each replicate has ended once."""
    assert sorted(outcome.replicate for outcome in outcomes) == list(range(len(outcomes)))
    return {outcome.replicate: outcome.reason for outcome in outcomes if outcome.reason}


def digests(outputs: Path, condition: Condition) -> dict[int, str]:
    """Return replicate → digest of what is stored, every log verified."""
    directory = RunDirectory(outputs, condition.id)
    return {
        k: read_log(directory.log_path(k)).summary.digest for k in sorted(directory.completed())
    }


def around_plug_in(plug_in: Path, outputs: Path) -> dict[str, str]:
    """Return the environment of a process in which the plug-in is installed."""
    paths = (str(plug_in), str(Path(__file__).parent), os.environ.get("PYTHONPATH", ""))
    return os.environ | {"EVOEXP_OUTPUTS": str(outputs), "PYTHONPATH": os.pathsep.join(paths)}
