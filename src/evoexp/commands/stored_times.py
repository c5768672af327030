"""Times of stored runs, each read once, and the estimates that follow from them."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.condition import Condition
from evoexp.errors import StoreError
from evoexp.store.identity import CONFIG, read
from evoexp.store.run_directory import RunDirectory, run_names
from evoexp.store.summaries import summary_table

FEW = 3  # replicates, below which their spread is not known
OTHER_SETTINGS = 1.5  # an evaluation with other settings takes so many times as long, or as short
ALL_GENERATIONS = "generations"  # reason to stop of a replicate that had all of them


class Estimate(NamedTuple):
    """Mean CPU time of replicates that were not run yet [s]; None: unknown."""

    seconds: float | None
    least: float | None
    most: float | None
    source: str


class Times(NamedTuple):
    """Times of a run's finished replicates.

    Attributes:
        cpu_s: Of each replicate [s].
        evaluations: Of each replicate.
        stopped_early: Whether one did not have all generations.
    """

    cpu_s: list[float]
    evaluations: list[int]
    stopped_early: bool


class StoredTimes:
    """The times of all stored runs; a run's table is read when the first condition needs it."""

    def __init__(self, outputs: Path) -> None:
        """Read the configurations of all runs; those that cannot be read are left out."""
        self._named: dict[str, list[tuple[str, str]]] = {}  # settings → (id, name) of runs
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
                key = _key(without_revisions(settings))
                self._named.setdefault(key, []).append((condition_id, name))
                run = RunDirectory(outputs, condition_id)
                self._alike.setdefault(_scene(settings), []).append(run)

    def other_revisions(self, settings: Any, condition_id: str) -> tuple[str, ...]:
        """Return the hashes of runs of the same settings by components of another revision."""
        same = self._named.get(_key(without_revisions(settings)), ())
        return tuple(name for other, name in same if other != condition_id)

    def estimate(self, condition: Condition, run: RunDirectory, settings: Any) -> Estimate:
        """Estimate the CPU time of a replicate: from its own ones, else from runs like it.

        Args:
            condition: Of which replicates shall be run.
            run: Where those that were run are stored.
            settings: Of the condition, as plain data.
        """
        if (own := _times(run)).cpu_s:
            widening = 1.0 if len(own.cpu_s) >= FEW else 2.0
            least, most = min(own.cpu_s) / widening, max(own.cpu_s) * widening
            mean = float(np.mean(own.cpu_s))
            return Estimate(mean, least, most, f"{len(own.cpu_s)} of its own")
        scene = _scene(settings)
        if scene not in self._known:
            runs = map(_times, self._alike.get(scene, ()))
            self._known[scene] = [times for times in runs if any(times.evaluations)]
        if not (alike := self._known[scene]):
            return Estimate(None, None, None, "nothing stored like it")
        most_evaluations = _num_evaluations(condition)
        least, most = bounds(alike, most_evaluations)
        source = f"{len(alike)} other runs of the scene"
        return Estimate(float(np.sqrt(least * most)), least, most, source)


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


def _num_evaluations(condition: Condition) -> int:
    planner = condition.planner
    return sum(planner.num_evaluations(k) for k in range(min(planner.num_generations, 10_000) + 1))


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


def without_revisions(config: Any) -> Any:
    """Return plain data of a condition without the revisions of its components."""
    if isinstance(config, Mapping):
        return {key: without_revisions(v) for key, v in config.items() if key != "revision"}
    if isinstance(config, list):
        return [without_revisions(value) for value in config]
    return config


def _scene(settings: Mapping[str, Any]) -> str:
    """Return a key of the planner's component and the scene, shared by runs of other settings."""
    planner = settings.get("planner")
    name = planner.get("_target_") if isinstance(planner, Mapping) else None
    return _key([name, settings.get("robot"), settings.get("scenario")])


def _key(value: Any) -> str:
    return json.dumps(value, sort_keys=True)
