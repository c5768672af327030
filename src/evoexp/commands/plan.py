"""`evoexp plan`: the replicates that a `run` would start, and an estimate of their time and memory.

Nothing is run or written.
"""

import argparse
import contextlib
import json
import math
from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.batch.runner_settings import GIGABYTE, replicate_memory
from evoexp.batch.workers import num_cores
from evoexp.commands.console import hash_column, new_table, print_json, right, say
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import StoreError
from evoexp.store.identity import CONFIG, config_id, leaves, read_object
from evoexp.store.run_directory import RunDirectory, outputs_root, run_names
from evoexp.store.summaries import damaged_logs, replicate_of, summary_table
from evoexp.validation import TARGET

START_S = 5.0  # [s] assumed: at most, to start workers and compile nothing
CONDITION_S = 0.05  # [s] assumed: at most, to prepare a condition and write its files
FEW = 3  # replicates, below which their spread is not known
OTHER_SETTINGS = 1.5  # an evaluation with other settings takes so many times as long, or as short


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


Times = list[tuple[float, int]]  # CPU time [s] and evaluations of a run's finished replicates
# mean, least and most CPU time of a replicate that was not run yet [s], None: unknown; its origin
Estimate = tuple[float | None, float | None, float | None, str]
KEYS = PlannedCondition._fields


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
            damaged = set(map(replicate_of, damaged_logs(run))) & done if done else set()
            cached, failed = (done - damaged) & asked, run.failed() & asked
            same_settings = stored.named.get(_without_revisions(settings), ())
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
    counts = right("planned", "stored", "to run", "failed\nbefore", "damaged")
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
    for search in filter(None, (experiment.search for experiment in experiments)):
        say(f"trials: {len(search.scores)} of {search.settings.num_trials} are stored")
    return 0


def _seconds(mean: float | None, least: float | None, most: float | None) -> str:
    """Return a time, or a range if its ends differ by more than a factor of two."""
    if mean is None or least is None or most is None:
        return "unknown"
    return f"{mean:.3g}" if most <= 2 * least else f"{least:.2g} to {most:.2g}"


def _total(rows: Sequence[PlannedCondition], workers: int) -> str:
    missing, failed = sum(row.missing for row in rows), sum(row.failed for row in rows)
    again = f"{failed} failed before, which start with --retry-failed" if failed else ""
    if not missing:
        return f"nothing to run{f': {again}' if failed else ': every replicate is stored'}"
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
        self._times: dict[str, Times] = {}  # of a run
        for name in run_names(outputs):
            with contextlib.suppress(StoreError):
                path = outputs / "runs" / name
                run, settings = RunDirectory(outputs, config_id(path)), read_object(path / CONFIG)
                self.named.setdefault(_without_revisions(settings), []).append(run.condition_id)
                self._alike.setdefault(_scene(settings), []).append(run)

    def estimate(self, condition: Condition, run: RunDirectory, settings: Any) -> Estimate:
        """Estimate the CPU time of a replicate: from its own ones, else from runs like it."""
        if times := [seconds for seconds, _ in self._times_of(run)]:
            widening = 1.0 if len(times) >= FEW else 2.0
            least, most = min(times) / widening, max(times) * widening
            return float(np.mean(times)), least, most, f"{len(times)} of its own"
        alike = list(filter(None, map(self._times_of, self._alike.get(_scene(settings), ()))))
        if not alike:
            return None, None, None, "nothing stored like it"
        generations = range(min(condition.planner.num_generations, 10_000) + 1)
        least, most = bounds(alike, sum(map(condition.planner.num_evaluations, generations)))
        source = f"{len(alike)} other runs of the scene"
        return math.sqrt(least * most), least, most, source

    def _times_of(self, run: RunDirectory) -> Times:
        if run.hash12 not in self._times:
            rows = summary_table(run).to_pylist() if run.completed() else []
            done = [row for row in rows if row["status"] == "done" and row["cpu_s"]]
            self._times[run.hash12] = [(row["cpu_s"], row["evaluations"]) for row in done]
        return self._times[run.hash12]


def bounds(alike: Sequence[Times], evaluations: int) -> tuple[float, float]:
    """Return the least and the most that a replicate of so many evaluations may take [s].

    More evaluations take more time, but no more than in proportion: a part of the time is the same
    for any number. The run of the nearest number of evaluations tells it.
    """
    ratios = [max(1, evaluations) / np.mean([max(1, count) for _, count in run]) for run in alike]
    nearest = min(range(len(alike)), key=lambda k: abs(math.log(ratios[k])))
    spent, ratio = [seconds for seconds, _ in alike[nearest]], float(ratios[nearest])
    least, most = min(spent) * min(ratio, 1.0), max(spent) * max(ratio, 1.0)
    return least / OTHER_SETTINGS, most * OTHER_SETTINGS


def _without_revisions(config: Any) -> str:
    """Return a key of a condition's settings, the same for all revisions of its components."""
    return json.dumps([each for each in leaves(config) if not each[0].endswith("revision")])


def _scene(settings: Mapping[str, Any]) -> str:
    """Return a key of the planner's component and the scene, shared by runs of other settings."""
    planner = settings.get("planner")
    name = planner.get(TARGET) if isinstance(planner, Mapping) else None
    return json.dumps([name, settings.get("robot"), settings.get("scenario")], sort_keys=True)
