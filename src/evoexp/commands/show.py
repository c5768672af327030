"""`evoexp show`: a condition before it is run, a stored run, or somebody's log.

The facts about each are one mapping with the keys of `KEYS`, which `--json` prints as it is.
"""

import argparse
import contextlib
import functools
import hashlib
import itertools
import math
import shlex
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rich.table import Table

from evoexp import shipped
from evoexp.attachments import PREFIX, keep_all
from evoexp.commands import stored_runs
from evoexp.commands.command_parser import is_override, option_words
from evoexp.commands.console import hash_column, new_table, plain_console, print_json, right, say
from evoexp.commands.list_ import run_row, run_table
from evoexp.condition import Condition, stored_config
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.errors import EvoexpError, SettingError, printable
from evoexp.records import flatten
from evoexp.registry import COMPONENTS, components_in, lacking, registered
from evoexp.store.files import first_of
from evoexp.store.identity import ORIGIN, TAKEN, differences, environment, leaves, typed_parts
from evoexp.store.log_reader import LogContents, read_log
from evoexp.store.run_directory import RunDirectory, outputs_root
from evoexp.store.summaries import summary_table, whole_logs
from evoexp.validation import TARGET

REPLICATE = {  # columns of the table of replicates, and their heads
    **{"replicate": "#", "status": "status", "best_cost": "best cost", "solved": "solved"},
    **{"certified": "certified", "clearance": "clearance", "evaluations": "evaluations"},
    **{"cpu_s": "CPU s"},
}
MAX_CHANGES = 6  # settings per row of a table of conditions
INDENT = 13  # columns of the names on the left
VERSIONS = ("python", "evoexp", "numpy", "numba", "pin", "coal")  # those on the screen
MAX_LINES = 3  # of one entry; `show --all` prints everything
MAX_ENTRIES = 4  # of a list
WHOLE = ("condition", "origin", "environment", "result", "verdict", "note")  # never cut
KEYS = (  # of the facts, in the order of the screen; commands.yaml tells their values
    *("condition", "shipped_as", "components", "origin", "environment", "result", "verdict"),
    *("settings", "notes"),
)


def main(arguments: argparse.Namespace) -> int:
    """Print a screen of facts; of several conditions a table."""
    words: list[str] = arguments.overrides
    as_table = not (arguments.all or arguments.json)
    runs: list[RunDirectory] = []
    with contextlib.ExitStack() as archive:
        if any(map(is_override, words)):
            experiments = compose.expand(words, multirun=arguments.multirun, only=arguments.only)
            arguments.only = ()  # each command has its own
            command = ["evoexp", "run", *words, *option_words(arguments)]
            if as_table and sum(len(experiment.conditions) for experiment in experiments) > 1:
                for experiment in experiments:
                    say(_condition_table(experiment))
                say("one condition on a screen: --only LABEL")
                return 0
            facts = [
                composed_facts(experiment, label, shlex.join([*command, "--only", label]))
                for experiment in experiments
                for label, _ in experiment.conditions
            ]
        elif packed := stored_runs.in_archive(" ".join(words)):
            path, runs = str(packed[0]), archive.enter_context(stored_runs.looked_into(*packed))
            if as_table and len(runs) > 1:
                say(run_table("", [run_row(run.hash12, run) for run in runs]))
                say(f"one run on a screen: evoexp show {printable(path)}:{runs[0].hash12}")
                return 0
            facts = [stored_facts(run, path) for run in runs]
        elif len(words) > 1:
            raise SettingError("show", "given one hash or log", " ".join(words))
        elif (log := Path(words[0])).suffix == ".mcap" or log.is_file():
            facts = [log_facts(log)]
        elif isinstance(named := stored_runs.stored_or_shipped(words[0]), RunDirectory):
            facts, runs = [stored_facts(named, str(named.path))], [named]
        else:
            experiment = stored_runs.shipped_experiment(named)
            facts = [composed_facts(experiment, named.label, named.command)]
        _print_screens(arguments, facts, runs)
    return 0


def _print_screens(
    arguments: argparse.Namespace, screens: Sequence[Any], runs: Sequence[RunDirectory]
) -> None:
    if arguments.json:
        print_json(screens if len(screens) > 1 else screens[0])
        return
    as_yaml = functools.partial(
        yaml.safe_dump, sort_keys=False, default_flow_style=None, allow_unicode=True, width=110
    )
    for facts, run in itertools.zip_longest(screens, runs):
        for line in screen(facts, plain_console().width):
            say(line)
        if arguments.all:
            say(as_yaml({"settings": facts["settings"]}))
            if run is not None:
                heads, last = right(*REPLICATE.values()), "digest, or why it failed"
                place = facts["origin"]["directory"]
                table = new_table(f"replicates in {place}", *heads, last)
                for row in summary_table(run).to_pylist():
                    cells = ["–" if row[k] is None else _said(row[k]) for k in REPLICATE]
                    table.add_row(*cells, row["digest"] or row["stop_reason"])
                say(table)
                manifest = {k: v for k, v in run.manifest().items() if k != "condition"}
                say(as_yaml({"manifest": manifest}))


def _condition_table(experiment: Experiment) -> Table:
    settings = []
    for _, condition in experiment.conditions:
        if not shipped.rows_of(condition.id) and not lacking(condition.to_json()):
            condition.prepare()  # raises where the parts do not fit
        settings.append(dict(leaves(typed_parts(stored_config(condition.to_json())))))
    names = list(dict.fromkeys(itertools.chain.from_iterable(settings)))
    names = [name for name in names if not name.endswith("revision")]
    differing = [name for name in names if len({str(each.get(name)) for each in settings}) > 1]
    heads = hash_column(), *right("done")
    last = "settings in which they differ"
    table = new_table(experiment.report_name, "condition", *heads, last)
    for (label, condition), values in zip(experiment.conditions, settings, strict=True):
        changes = [f"{name}={compact(values[name])}" for name in differing if name in values]
        run = RunDirectory(outputs_root(), condition.id)
        planned = run.num_planned(condition.num_replicates(experiment.num_replicates))
        done = f"{len(run.completed())} of {planned}" if run.completed() or run.failed() else "–"
        table.add_row(label, run.hash12, done, "\n".join(first_of(changes, MAX_CHANGES)))
    return table


# the facts


def composed_facts(experiment: Experiment, label: str, command: str) -> dict[str, Any]:
    """Return the facts about one condition of an experiment, which a command runs."""
    condition = next(each.condition for each in experiment.conditions if each.label == label)
    if not lacking(condition.to_json()):  # else a note says how to install it
        condition.notes()  # raises where the parts do not fit
    run = RunDirectory(outputs_root(), condition.id)
    rows = summary_table(run).to_pylist() if run.completed() or run.failed() else []
    planned = run.num_planned(condition.num_replicates(experiment.num_replicates))
    around = run.manifest() if rows else None
    origin = experiment.origin(label, command)
    return _facts(condition.to_json(), origin, around, rows, {"planned": planned})


def stored_facts(run: RunDirectory, place: str) -> dict[str, Any]:
    """Return the facts about a stored run; an archive's command is none to be typed."""
    manifest = run.manifest()
    origin = {TAKEN: manifest.get(TAKEN), **{name: run.origin()[name] for name in ORIGIN}}
    if TAKEN not in manifest:
        origin["command"] = manifest.get("command")
    origin |= {"options": manifest.get("options"), "code": manifest.get("git"), "directory": place}
    log = next((read_log(run.log_path(k)) for k in sorted(whole_logs(run))[:1]), None)
    rows = summary_table(run).to_pylist()
    return _facts(run.config_json(), origin, manifest, rows, _arrays(log) if log else {})


def log_facts(path: Path) -> dict[str, Any]:
    """Return the facts about a replicate's log, wherever it comes from."""
    log = read_log(path)
    keep_all(data for name, data in log.attachments.items() if name.startswith(PREFIX))
    result = {
        "digest": log.summary.digest,
        "generations": len(log.generations) - 1,
        "stop_reason": log.summary.stop_reason,
    }
    origin = {"log": str(path), "replicate": log.replicate}
    rows = [flatten(log.summary)]
    return _facts(log.config_json, origin, log.environment, rows, result | _arrays(log))


def _arrays(log: LogContents) -> dict[str, Any]:
    return {"arrays": {name: list(array.shape) for name, array in log.arrays().items()}}


def _facts(
    config_json: bytes,
    origin: dict[str, Any],
    around: Mapping[str, Any] | None,
    rows: Sequence[dict[str, Any]],
    result: dict[str, Any],
) -> dict[str, Any]:
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
        "origin": {name: value for name, value in origin.items() if value},
        "environment": stored,
        "result": _result(rows) | result if rows else None,
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


def _result(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    done = [row for row in rows if row["status"] == "done"]
    failed = [row for row in rows if row["status"] != "done"]
    best = min(done, key=lambda row: row["best_cost"], default=None)
    names = ("best_cost", "evaluations", "collision_queries", "cpu_s")
    medians = [float(np.median([row[name] for row in done])) if done else None for name in names]
    return {
        "planned": None,
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


# one screen


def screen(facts: Mapping[str, Any], width: int) -> Iterator[str]:
    """Yield the facts about a condition as aligned lines."""
    options = facts["origin"].get("options", {})
    places = {option["origin"]: "" for option in options.values()}
    for group, option in options.items():
        places[option["origin"]] += f" {group}={option['name']}"
    shown = {**facts, "origin": facts["origin"] | {"options": places}}
    if code := facts["origin"].get("code"):
        changed = ", changed" if code.get("dirty") else ""
        shown["origin"]["code"] = f"{str(code.get('commit'))[:12]}{changed}"
    if around := facts["environment"]:
        versions = {name: (around["versions"] or {}).get(name) for name in VERSIONS}
        cpu = (around["cpu"] or {}).get("name")
        shown["environment"] = around | {"versions": versions, "cpu": cpu}
    shown["components"] = ", ".join(map(_component, facts["components"]))
    if facts["result"] is None:
        shown["result"] = f"not run here; run it: {shown['origin'].pop('command')}"
    keys = [key for key in KEYS[:-2] if key != "shipped_as" or facts[key]]
    named = [(key.replace("_", " "), _said(shown[key]) if shown[key] else "–") for key in keys]
    parts = typed_parts(facts["settings"]).items()
    named += [(name, compact(component)) for name, component in parts]
    named += [("note", note) for note in facts["notes"]]
    for name, text in named:
        room = max(width - INDENT, 30)
        lines = [
            line
            for paragraph in text.splitlines() or [""]
            for line in textwrap.wrap(paragraph, room, break_on_hyphens=False) or [""]
        ]
        if len(lines) > MAX_LINES and name not in WHOLE:
            lines = [*lines[: MAX_LINES - 1], f"{lines[MAX_LINES - 1][: room - 2]} …"]
        for k, line in enumerate(lines):
            yield f"{'' if k else name:{INDENT}}{line}".rstrip()


def _component(component: Mapping[str, Any]) -> str:
    revision, package = component["revision"], component["package"] or "not installed here"
    here = component["installed_revision"]
    remarks = [f"here {here}"] if here not in (None, revision) else []
    remarks += [] if package.startswith("evoexp ") else [package]
    text = f"{component['component']} {revision}"
    return f"{text} ({', '.join(remarks)})" if remarks else text


def _said(fact: Any) -> str:
    """Say a fact: plain values of a mapping in one line, then a line for each list and mapping."""
    if isinstance(fact, list):
        return "; ".join(first_of(list(map(_said, fact)), MAX_ENTRIES))
    if not isinstance(fact, Mapping):
        return f"{fact:.6g}" if isinstance(fact, float) else str(fact)
    told = {k.replace("_", " "): v for k, v in fact.items() if v or v == 0}
    plain = [f"{k} {_said(v)}" for k, v in told.items() if not isinstance(v, list | Mapping)]
    rest = [f"{k}: {_said(v)}" for k, v in told.items() if isinstance(v, list | Mapping)]
    return "\n".join([", ".join(plain), *rest] if plain else rest)


def compact(value: Any) -> str:
    """Return plain configuration data in one line: `arms(arms=[planar_chain(…), …])`."""
    if isinstance(value, Mapping):
        shown = (f"{k}={compact(v)}" for k, v in value.items() if k not in (TARGET, "revision"))
        return f"{value.get(TARGET, '')}({', '.join(shown)})"
    if isinstance(value, list):
        return f"[{', '.join(map(compact, value))}]"
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    return str(value)
