"""`evoexp plan`: the replicates that a `run` would start, and an estimate of their time and memory.

Nothing is run or written.
"""

import argparse
import hashlib
import json
from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.batch.memory_limit import GIGABYTE, replicate_memory
from evoexp.batch.workers import num_cores
from evoexp.commands.arguments import add_experiment_arguments, add_json_argument
from evoexp.commands.console import hash_column, new_table, print_json, right, say
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import StoreError
from evoexp.store.identity import CONFIG, read
from evoexp.store.run_directory import RunDirectory, outputs_root, run_names
from evoexp.store.summaries import damaged_logs, summary_table
from evoexp.validation import TARGET

START_S = 5.0  # [s] assumed: at most, to start workers and compile nothing
CONDITION_S = 0.05  # [s] assumed: at most, to prepare a condition and write its files
FEW = 3  # replicates, below which their spread is not known
OTHER_SETTINGS = 1.5  # an evaluation with other settings takes so many times as long, or as short
ALL_GENERATIONS = "generations"  # reason to stop of a replicate that had all of them


class PlannedCondition(NamedTuple):
    """One condition of a batch, and how much of it is stored: what `--json` prints."""

    experiment: str
    label: str
    hash: str  # 64 hex digits
    planned: int  # replicates that are asked for
    cached: int  # those that are stored
    missing: int  # those that a run would start: neither stored nor failed before
    failed: int  # those that failed before, which start only if told so
    damaged: int  # those of the missing ones whose log is damaged
    other_revision: tuple[str, ...]  # runs of the same settings by components of another revision
    cpu_s_each: float | None  # of a replicate [s]; None: unknown
    cpu_s_least: float | None  # that it may take in the mean [s]
    cpu_s_most: float | None  # that it may take in the mean [s]
    cpu_s_from: str  # origin of these times
    memory_gb_each: float  # of a replicate [GB]


class Times(NamedTuple):
    """Times of a run's finished replicates."""

    cpu_s: list[float]  # of each replicate [s]
    evaluations: list[int]  # of each replicate
    stopped_early: bool  # whether one did not have all generations


# mean, least and most CPU time of a replicate that was not run yet [s], None: unknown; its origin
Estimate = tuple[float | None, float | None, float | None, str]
KEYS = PlannedCondition._fields


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_experiment_arguments(parser)
    add_json_argument(parser, f"a list of conditions ({', '.join(KEYS)})")


def main(arguments: argparse.Namespace) -> int:
    """Print the plan."""
    words, only = arguments.overrides, arguments.only
    experiments = compose.expand(words, multirun=arguments.multirun, only=only)
    stored = StoredTimes(outputs_root())
    rows: dict[str, PlannedCondition] = {}
    for experiment in experiments:
        for label, condition in experiment.conditions:
            if condition.id in rows:
                continue
            run = RunDirectory(outputs_root(), condition.id)
            settings = json.loads(condition.to_json())
            count, done = condition.num_replicates(experiment.num_replicates), run.completed()
            asked = set(range(count))
            damaged = {int(Path(name).stem) for name in damaged_logs(run)} if done else set()
            cached, failed = (done - damaged) & asked, run.failed() & asked
            same_settings = stored.named.get(_key(_without_revisions(settings)), ())
            rows[condition.id] = PlannedCondition(
                experiment.name,
                label,
                condition.id,
                count,
                len(cached),
                count - len(cached) - len(failed),
                len(failed),
                len(damaged & asked),
                tuple(other[:12] for other in same_settings if other != condition.id),
                *stored.estimate(condition, run, settings),
                round(replicate_memory(condition) / GIGABYTE, 4),
            )
    planned = list(rows.values())
    if arguments.json:
        print_json([row._asdict() for row in planned])
        return 0
    counts = right("planned", "there", "to run", "failed\nbefore", "damaged")
    costs = right("CPU s\neach", "GB\neach")
    table = new_table("", "condition", hash_column(), *counts, "other revision", *costs)
    for row in planned:
        table.add_row(
            row.label,
            row.hash[:12],
            *map(str, (row.planned, row.cached, row.missing, row.failed, row.damaged)),
            ", ".join(row.other_revision) or "–",
            _seconds(row.cpu_s_each, row.cpu_s_least, row.cpu_s_most),
            f"{row.memory_gb_each:.3g}",
        )
    say(table)
    say(_total(planned, experiments[0].runner.num_workers or num_cores()))
    return 0


def _seconds(mean: float | None, least: float | None, most: float | None) -> str:
    """Return a time, or a range if its ends differ by more than a factor of two."""
    if mean is None or least is None or most is None:
        return "unknown"
    return f"{mean:.3g}" if most <= 2 * least else f"{least:.2g} to {most:.2g}"


def _total(rows: Sequence[PlannedCondition], workers: int) -> str:
    """Say how many replicates would run, and how long it would take."""
    missing, failed = sum(row.missing for row in rows), sum(row.failed for row in rows)
    again = f"{failed} failed before, which start with --retry-failed" if failed else ""
    if not missing:
        return f"nothing to run{f': {again}' if failed else ': every replicate is there'}"
    todo = [row for row in rows if row.missing]
    known = [row for row in todo if row.cpu_s_each is not None]
    bounds = attrgetter("cpu_s_each", "cpu_s_least", "cpu_s_most")
    cpu = [sum(row.missing * bounds(row)[k] for row in known) for k in range(3)]
    starting = START_S + CONDITION_S * len(todo)
    wall = cpu[0] / workers, cpu[1] / workers, cpu[2] / workers + starting
    unknown = sum(row.missing for row in todo if row.cpu_s_each is None)
    time = f"{_seconds(*cpu)} s of CPU time, {_seconds(*wall)} s on {workers} workers"
    open_ones = f"{unknown} of them of unknown length" if known else "of unknown length"
    largest = max(row.memory_gb_each for row in todo)
    parts = (
        f"{missing} replicates to run" if missing > 1 else "1 replicate to run",
        time if known else "",
        open_ones if unknown else "",
        f"at most {largest * min(workers, missing):.3g} GB at once",
        again,
    )
    return "; ".join(part for part in parts if part)


class StoredTimes:
    """The times of all stored runs; a run's table is read when the first condition needs it."""

    def __init__(self, outputs: Path) -> None:
        """Read the configurations of all runs; those that cannot be read are left out."""
        self.named: dict[str, list[str]] = {}  # settings without revisions → ids of runs
        self._alike: dict[str, list[RunDirectory]] = {}  # planner and scene → runs
        self._known: dict[str, list[Times]] = {}
        for name in run_names(outputs):
            try:
                content = read(outputs / "runs" / name / CONFIG)
                settings = json.loads(content)
            except (StoreError, ValueError):
                continue
            condition_id = hashlib.sha256(content).hexdigest()
            if condition_id.startswith(name) and isinstance(settings, dict):
                self.named.setdefault(_key(_without_revisions(settings)), []).append(condition_id)
                run = RunDirectory(outputs, condition_id)
                self._alike.setdefault(_scene(settings), []).append(run)

    def estimate(self, condition: Condition, run: RunDirectory, settings: Any) -> Estimate:
        """Estimate the CPU time of a replicate: from its own ones, else from runs like it."""
        if (own := _times(run)).cpu_s:
            widening = 1.0 if len(own.cpu_s) >= FEW else 2.0
            least, most = min(own.cpu_s) / widening, max(own.cpu_s) * widening
            mean = float(np.mean(own.cpu_s))
            return mean, least, most, f"{len(own.cpu_s)} of its own"
        scene = _scene(settings)
        if scene not in self._known:
            runs = map(_times, self._alike.get(scene, ()))
            self._known[scene] = [times for times in runs if any(times.evaluations)]
        if not (alike := self._known[scene]):
            return None, None, None, "nothing stored like it"
        generations = range(min(condition.planner.num_generations, 10_000) + 1)
        least, most = bounds(alike, sum(map(condition.planner.num_evaluations, generations)))
        source = f"{len(alike)} other runs of the scene"
        return float(np.sqrt(least * most)), least, most, source


def bounds(alike: Sequence[Times], evaluations: int) -> tuple[float, float]:
    """Return the least and the most that a replicate of so many evaluations may take [s].

    More evaluations take more time, but no more than in proportion: a part of the time is the same
    for any number. Runs of about as many evaluations, or the nearest number, tell the most.
    """
    ratios = np.array(
        [evaluations / max(1.0, float(np.mean(times.evaluations))) for times in alike]
    )
    spent = np.array([np.mean(times.cpu_s) for times in alike])  # [s]
    distance = np.abs(np.log(np.maximum(ratios, 1e-9)))
    near = distance <= distance.min() + 0.1
    least, most = (spent * np.minimum(ratios, 1.0))[near], (spent * np.maximum(ratios, 1.0))[near]
    low, high = float(np.quantile(least, 0.1)), float(np.quantile(most, 0.9))
    if any(times.stopped_early for times in alike):  # as the next one may
        low = min(low, *(min(times.cpu_s) for times in alike))
    return low / OTHER_SETTINGS, high * OTHER_SETTINGS


def _times(run: RunDirectory) -> Times:
    if not run.completed():
        return Times([], [], False)
    columns = ["status", "cpu_s", "evaluations", "stop_reason"]
    rows = [row for row in summary_table(run).select(columns).to_pylist() if row["cpu_s"]]
    done = [row for row in rows if row["status"] == "done"]
    return Times(
        [float(row["cpu_s"]) for row in done],
        [int(row["evaluations"] or 0) for row in done],
        any(row["stop_reason"] != ALL_GENERATIONS for row in done),
    )


def _without_revisions(config: Any) -> Any:
    """Return plain data of a condition without the revisions of its components."""
    if isinstance(config, Mapping):
        return {key: _without_revisions(v) for key, v in config.items() if key != "revision"}
    if isinstance(config, list):
        return [_without_revisions(value) for value in config]
    return config


def _scene(settings: Mapping[str, Any]) -> str:
    """Return a key of the planner's component and the scene, shared by runs of other settings."""
    planner = settings.get("planner")
    name = planner.get(TARGET) if isinstance(planner, Mapping) else None
    return _key([name, settings.get("robot"), settings.get("scenario")])


def _key(value: Any) -> str:
    return json.dumps(value, sort_keys=True)
