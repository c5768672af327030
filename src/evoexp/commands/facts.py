"""The facts about a condition that `show` prints: identity, origin, environment, result, verdict.

Every function returns one mapping with the keys of `KEYS`; `show --json` prints it as it is.
"""

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from evoexp import shipped
from evoexp.attachments import PREFIX, keep_all
from evoexp.condition import Condition, stored_config
from evoexp.configuration.experiment import Experiment
from evoexp.errors import EvoexpError
from evoexp.records import flatten
from evoexp.registry import COMPONENTS, components_in, lacking, registered
from evoexp.store.identity import TAKEN
from evoexp.store.log_reader import read_log
from evoexp.store.manifest import differences, environment
from evoexp.store.run_context import ORIGIN
from evoexp.store.run_context import origin as origin_of
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.summaries import summary_table, whole_logs
from evoexp.validation import TARGET

KEYS = {
    "condition": "hash, 64 hex digits",
    "shipped_as": "names of the condition in shipped experiments: experiment, label, budget",
    "components": "component, revision, installed_revision, package",
    "origin": "experiment, label, budget, command, options taken, log, code; taken_from: an "
    "archive, on whose word all of this stands",
    "environment": "versions, platform, cpu, differences from the environment here; null: not run",
    "result": "replicates planned, done, failed; costs, effort; null: not run here",
    "verdict": "replicates certified, refuted, undecided, without motion; clearance; null: not run",
    "settings": "the canonical form of the condition",
    "notes": "remarks of robot, planner and scenario",
}
"""Key → its value, in the order of the screen."""


def composed_facts(
    experiment: Experiment, label: str, command: str, *, noted: bool = True
) -> dict[str, Any]:
    """Return the facts about one condition of an experiment, whether or not it was run here.

    A command runs it. For notes the planner prepares its problem.
    """
    condition = next(each.condition for each in experiment.conditions if each.label == label)
    origin = experiment.origin(label, command)
    run = RunDirectory(outputs_root(), condition.id)
    rows = summary_table(run).to_pylist() if run.completed() or run.failed() else []
    planned = run.num_planned(condition.num_replicates(experiment.num_replicates))
    around = run.manifest() if rows else None
    config_json = condition.to_json()
    is_shipped = bool(shipped.rows_of(condition.id))  # whose parts fit
    if (noted or not is_shipped) and not lacking(config_json):  # else a note says how to install it
        condition.notes()  # raises where the parts do not fit
    return _facts(config_json, origin, around, rows, planned, noted=noted)


def stored_facts(run: RunDirectory) -> dict[str, Any]:
    """Return the facts about a stored run."""
    manifest = run.manifest()
    known = origin_of(manifest, run.condition_id)
    named = {name: known[name] for name in ORIGIN if known[name]}
    others = ("command", "options", TAKEN)
    origin = named | {name: manifest[name] for name in others if name in manifest}
    origin |= {"code": manifest.get("git"), "directory": str(run.path)}
    config_json = run.config_json()
    found = _facts(config_json, origin, manifest, summary_table(run).to_pylist(), None)
    for replicate in sorted(whole_logs(run))[:1]:
        arrays = read_log(run.log_path(replicate)).arrays()
        found["result"]["arrays"] = {name: list(array.shape) for name, array in arrays.items()}
    return found


def log_facts(path: Path) -> dict[str, Any]:
    """Return the facts about a replicate's log, wherever it comes from."""
    log = read_log(path)
    keep_all(data for name, data in log.attachments.items() if name.startswith(PREFIX))
    rows = [flatten(log.summary)]
    found = _facts(log.config_json, {"log": str(path)}, log.environment, rows, None)
    found["origin"]["replicate"] = log.replicate
    found["result"] |= {
        "digest": log.summary.digest,
        "generations": len(log.generations) - 1,
        "stop_reason": log.summary.stop_reason,
        "arrays": {name: list(array.shape) for name, array in log.arrays().items()},
    }
    return found


def _facts(
    config_json: bytes,
    origin: dict[str, Any],
    around: Mapping[str, Any] | None,
    rows: Sequence[dict[str, Any]],
    planned: int | None,
    *,
    noted: bool = True,
) -> dict[str, Any]:
    """Return the facts of all keys."""
    notes = []
    if noted:
        try:
            notes = Condition.from_json(config_json).notes()
        except EvoexpError as error:  # of another revision, or a package that is not installed
            notes = [str(error)]
    config = stored_config(config_json)
    condition_id = hashlib.sha256(config_json).hexdigest()
    stored = None if around is None else {k: around.get(k) for k in ("versions", "platform", "cpu")}
    if stored is not None:
        stored["differences"] = [str(each) for each in differences(stored, environment())]
    return {
        "condition": condition_id,
        "shipped_as": [
            {"experiment": row.experiment, "label": row.label, "budget": row.budget}
            for row in shipped.rows_of(condition_id)
        ],
        "components": list(_components(config)),
        "origin": origin,
        "environment": stored,
        "result": _result(rows, planned) if rows else None,
        "verdict": _verdict([row for row in rows if row["status"] == "done"]) if rows else None,
        "settings": config,
        "notes": notes,
    }


def _components(config: Any) -> Iterator[dict[str, Any]]:
    """Yield every component once, with its revision here and as stored, and its package."""
    revisions: dict[str, Any] = {}
    for _, settings in components_in(config):
        revisions.setdefault(str(settings[TARGET]), settings.get("revision"))
    for name, revision in revisions.items():
        registration = registered(COMPONENTS, name)
        yield {
            "component": name,
            "revision": revision,
            "installed_revision": registration and registration.load().revision,
            "package": registration and registration.package,
        }


def _result(rows: Sequence[dict[str, Any]], planned: int | None) -> dict[str, Any]:
    """Return counts, costs and effort of replicates."""
    done = [row for row in rows if row["status"] == "done"]
    failed = [row for row in rows if row["status"] != "done"]
    best = min(done, key=lambda row: row["best_cost"], default=None)
    names = ("best_cost", "evaluations", "collision_queries", "cpu_s")
    medians = [float(np.median([row[name] for row in done])) if done else None for name in names]
    return {
        "planned": planned,
        "done": len(done),
        "failed": len(failed),
        "failures": [
            {"replicate": row["replicate"], "reason": row["stop_reason"]} for row in failed
        ],
        "solved": sum(bool(row["solved"]) for row in done),
        "best_cost": best and best["best_cost"],
        "best_replicate": best and best["replicate"],
        **{f"median_{n.removeprefix('best_')}": m for n, m in zip(names, medians, strict=True)},
    }


def _verdict(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return how many motions the exact certifier accepts, and the closest approach of all."""
    moved = [row for row in rows if not math.isnan(row["clearance"])]
    near = min(moved, key=lambda row: row["clearance"], default=None) or {}
    pairs = dict.fromkeys(p for row in moved for p in row["allowed_contacts"].split(", ") if p)
    allowed = (row for row in moved if row["allowed_contacts"])
    deepest = max(allowed, key=lambda row: row["penetration"], default=None) or {}
    return {
        "certified": sum(row["certified"] is True for row in moved),
        "refuted": sum(row["certified"] is False for row in moved),
        "undecided": sum(row["certified"] is None for row in moved),
        "without_motion": len(rows) - len(moved),
        "certified_margin": sum(row["certified_margin"] is True for row in moved),
        "clearance": near.get("clearance"),
        "clearance_replicate": near.get("replicate"),
        "clearance_pair": near.get("clearance_pair"),
        "contacts": [
            {key: row[key] for key in ("replicate", "refuted_at", "refuted_pair")}
            for row in moved
            if row["refuted_at"] is not None
        ],
        "allowed_contacts": list(pairs),
        "penetration": deepest.get("penetration"),
        "penetration_replicate": deepest.get("replicate"),
        "penetration_pair": deepest.get("penetration_pair"),
        "length_unit": rows[0]["length_unit"] if rows else None,
    }
