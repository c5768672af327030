"""`evoexp show`: a condition before it is run, a stored run, or somebody's log."""

import argparse
import functools
import itertools
import shlex
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from rich.table import Table

from evoexp.commands.arguments import add_experiment_arguments, folder_words, is_override
from evoexp.commands.console import (
    coloured,
    hash_column,
    new_table,
    plain_console,
    print_json,
    right,
    say,
)
from evoexp.commands.facts import KEYS, composed_facts, log_facts, stored_facts
from evoexp.commands.pack import in_archive, looked_into
from evoexp.commands.stored_runs import shipped_experiment, stored_or_shipped
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.errors import SettingError, printable
from evoexp.store.identity import TAKEN
from evoexp.store.run_context import typed_parts
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import summary_table
from evoexp.validation import TARGET

MAX_CHANGES = 6  # settings per row of a table of conditions
INDENT = 13  # columns of the names on the left
VERSIONS = ("python", "evoexp", "numpy", "numba", "pin", "coal")  # those on the screen
MAX_LINES = 3  # of one entry; `show --all` prints everything
MAX_ENTRIES = 4  # of one kind: names, differences, failures
WHOLE = ("condition", "origin", "environment", "result", "verdict", "note")  # never cut


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    words = add_experiment_arguments(parser)
    words.metavar, words.nargs = "HASH | LOG.mcap | RUNS.tar[:HASH] | KEY=VALUE", "+"
    words.help = (
        "any unique prefix of a run's hash, a replicate's log, an archive of runs, which is looked "
        "into, or an experiment with overrides as for run, which is composed and not run"
    )
    parser.add_argument(
        "--all", action="store_true", help="all settings, replicates and the whole manifest, too"
    )
    keys = "; ".join(f"{key}: {value}" for key, value in KEYS.items())
    content = f"print JSON, one object or a list of them. Keys: {keys}"
    parser.add_argument("--json", action="store_true", help=content)


def main(arguments: argparse.Namespace) -> int:
    """Print a screen of facts; of several conditions a table."""
    words: list[str] = arguments.overrides
    as_table = not (arguments.all or arguments.json)
    if any(map(is_override, words)):
        experiments = compose.expand(words, multirun=arguments.multirun, only=arguments.only)
        swept = ["-m"] if arguments.multirun else []
        command = ["evoexp", "run", *swept, *words, *folder_words(arguments.config_dir)]
        labelled = [(each, label) for each in experiments for label, _ in each.conditions]
        is_table = as_table and len(labelled) > 1  # which has no notes
        found = [
            composed_facts(
                experiment, label, shlex.join([*command, "--only", label]), noted=not is_table
            )
            for experiment, label in labelled
        ]
        if is_table:
            for experiment in experiments:
                say(_condition_table(experiment, found))
            say("one condition on a screen: --only LABEL")
        else:
            _print_screens(arguments, found)
    elif packed := in_archive(" ".join(words)):
        path, prefix = packed
        with looked_into(path, prefix) as runs:
            found = [stored_facts(run) for run in runs]
            for facts in found:
                facts["origin"]["directory"] = str(path)
            if len(found) > 1 and as_table:
                counted = right("done", "solved")
                table = new_table("", hash_column(), "experiment", "condition", *counted)
                for facts in found:
                    origin, result = facts["origin"], facts["result"] or {"done": 0, "solved": 0}
                    names = (str(origin.get(name) or "–") for name in ("experiment", "label"))
                    counts = (str(result[name]) for name in ("done", "solved"))
                    table.add_row(facts["condition"][:12], *names, *counts)
                say(table)
                say(f"one run on a screen: evoexp show {printable(str(path))}:{runs[0].hash12}")
            else:
                _print_screens(arguments, found, runs)
    elif len(words) > 1:
        raise SettingError("show", "given one hash or log", " ".join(words))
    elif (path := Path(words[0])).suffix == ".mcap" or path.is_file():
        _print_screens(arguments, [log_facts(path)])
    else:
        run = stored_or_shipped(words[0])
        if isinstance(run, RunDirectory):
            _print_screens(arguments, [stored_facts(run)], [run])
        else:
            facts = composed_facts(shipped_experiment(run), run.label, run.command)
            _print_screens(arguments, [facts])
    return 0


def _print_screens(
    arguments: argparse.Namespace, found: Sequence[Any], runs: Sequence[RunDirectory] = ()
) -> None:
    if arguments.json:
        print_json(found if len(found) > 1 else found[0])
        return
    as_yaml = functools.partial(
        yaml.safe_dump, sort_keys=False, default_flow_style=None, allow_unicode=True, width=110
    )
    for facts, run in itertools.zip_longest(found, runs):
        for line in screen(facts, plain_console().width):
            say(line)
        if arguments.all:
            say(as_yaml({"settings": facts["settings"]}))
            if run is not None:
                say(_replicate_table(run))
                manifest = {k: v for k, v in run.manifest().items() if k != "condition"}
                say(as_yaml({"manifest": manifest}))


def _condition_table(experiment: Experiment, found: list[dict[str, Any]]) -> Table:
    """Return a table of an experiment's conditions and the settings in which they differ."""
    by_id = {facts["condition"]: facts for facts in found}
    rows = [(label, by_id[condition.id]) for label, condition in experiment.conditions]
    settings = [dict(_leaves(typed_parts(facts["settings"]))) for _, facts in rows]
    names = list(dict.fromkeys(itertools.chain.from_iterable(settings)))
    differing = [name for name in names if len({str(each.get(name)) for each in settings}) > 1]
    heads = hash_column(), *right("done")
    name, last = experiment.report_name, "settings in which they differ"
    table = new_table(name, "condition", *heads, last)
    for (label, facts), values in zip(rows, settings, strict=True):
        given = [f"{name}={compact(values[name])}" for name in differing if name in values]
        more = [f"… {len(given) - MAX_CHANGES} more"] if len(given) > MAX_CHANGES else []
        result = facts["result"]
        done = f"{result['done']} of {result['planned']}" if result else "–"
        changes = "\n".join([*given[:MAX_CHANGES], *more])
        table.add_row(label, facts["condition"][:12], done, changes)
    return table


def _replicate_table(run: RunDirectory) -> Table:
    """Return one row per replicate, done or failed."""
    numbers = right("best cost", "solved", "certified", "clearance", "evaluations", "CPU s")
    table = new_table(
        f"replicates in {run.path}", *right("#"), "status", *numbers, "digest, or why it failed"
    )
    for row in summary_table(run).to_pylist():
        if row["status"] != "done":
            failed = coloured("failed", "red")
            table.add_row(str(row["replicate"]), failed, *6 * ["–"], str(row["stop_reason"]))
            continue
        verdict = ["–" if row[name] is None else str(row[name]) for name in ("solved", "certified")]
        effort = [f"{row['clearance']:.4g}", str(row["evaluations"]), f"{row['cpu_s']:.3f}"]
        cells = [f"{row['best_cost']:.6g}", *verdict, *effort]
        table.add_row(str(row["replicate"]), "done", *cells, str(row["digest"]))
    return table


def _leaves(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every setting by its dotted name; lists of scalars are one setting."""
    if isinstance(value, dict):
        for key, item in value.items():
            if key != "revision":
                yield from _leaves(item, f"{name}.{key}".lstrip("."))
    elif isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        for k, item in enumerate(value):
            yield from _leaves(item, f"{name}.{k}")
    else:
        yield name, value


# one screen


def screen(facts: Mapping[str, Any], width: int) -> Iterator[str]:
    """Yield the facts about a condition as aligned lines."""
    for name, text in _entries(facts):
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


def _entries(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield name and text of every entry."""
    yield "condition", facts["condition"]
    if facts["shipped_as"]:
        named = (f"{s['experiment']}, {s['label']}, {s['budget']}" for s in facts["shipped_as"])
        yield "shipped as", _first("; ", list(named))
    yield "components", ", ".join(map(_component, facts["components"]))
    yield "origin", "\n".join(_origin(facts["origin"], facts["result"] is not None))
    yield "environment", "\n".join(_environment(facts["environment"]))
    yield "result", "\n".join(_result(facts["result"], facts["origin"]))
    yield "verdict", "\n".join(_verdict(facts["verdict"]))
    for name, component in typed_parts(facts["settings"]).items():
        yield name, compact(component)
    for note in facts["notes"]:
        yield "note", note


def _first(separator: str, texts: Sequence[str]) -> str:
    """Join the first texts, and say how many more there are."""
    more = len(texts) - MAX_ENTRIES
    return separator.join(texts[:MAX_ENTRIES]) + (f" and {more} more" if more > 0 else "")


def _component(component: Mapping[str, Any]) -> str:
    """Say a component's revision, and its package unless it is evoexp's own."""
    text = f"{component['component']} {component['revision']}"
    installed, package = component["installed_revision"], component["package"]
    if package is None:
        return f"{text} (not installed here)"
    if installed != component["revision"]:
        text += f" (here {installed})"
    return text if package.startswith("evoexp ") else f"{text} ({package})"


def _origin(origin: Mapping[str, Any], was_run: bool) -> Iterator[str]:
    """Yield the origin: names, options by the places they come from, the command, files."""
    names = [str(origin[name]) for name in ("experiment", "label") if origin.get(name)]
    if origin.get("budget"):
        names.append(f"budget {origin['budget']}")
    if archive := origin.get(TAKEN):
        yield f"out of {archive}, according to which this is:"
    if names:
        yield ", ".join(names)
    places: dict[str, list[str]] = {}
    for group, option in (origin.get("options") or {}).items():
        places.setdefault(option["origin"], []).append(f"{group}={option['name']}")
    for place, options in places.items():
        yield f"{place}: {' '.join(options)}"
    if was_run and origin.get("command") and not archive:  # somebody's command is none to be typed
        yield origin["command"]
    if origin.get("log"):
        yield f"{origin['log']}, replicate {origin['replicate']}"
    if code := origin.get("code"):
        yield f"commit {str(code.get('commit'))[:12]}" + (", changed" if code.get("dirty") else "")
    if origin.get("directory"):
        yield f"stored in {origin['directory']}"


def _environment(environment: Mapping[str, Any] | None) -> Iterator[str]:
    """Yield versions, processor, and the differences from the environment here."""
    if environment is None:
        yield "–"
        return
    versions, platform = environment.get("versions") or {}, environment.get("platform") or {}
    yield ", ".join(f"{name} {versions[name]}" for name in VERSIONS if versions.get(name))
    cpu = (environment.get("cpu") or {}).get("name")
    yield ", ".join(str(part) for part in (*platform.values(), cpu) if part)
    if differing := environment["differences"]:
        yield _first("\n", [f"not as here: {each}" for each in differing])


def _result(result: Mapping[str, Any] | None, origin: Mapping[str, Any]) -> Iterator[str]:
    """Yield replicates, costs and effort; or the command that runs the condition."""
    if result is None:
        yield f"not run here; run it: {origin['command']}"
        return
    if origin.get("log"):
        stopped = result["stop_reason"]
        solved = "solved" if result["solved"] else "not solved"
        reason = f" ({stopped})" if stopped != "generations" else ""
        yield f"{solved} after {result['generations']} generations{reason}"
        yield f"digest {result['digest']}"
    else:
        planned = f" of {result['planned']}" if result["planned"] is not None else ""
        failed = f", {result['failed']} failed" if result["failed"] else ""
        yield f"{result['done']}{planned} replicates done{failed}, {result['solved']} solved"
    if result["done"]:
        several = f", median {_number(result['median_cost'])}" if result["done"] > 1 else ""
        best = f"best cost {_number(result['best_cost'])} (replicate {result['best_replicate']})"
        yield best + several
        yield (
            f"each {_number(result['median_evaluations'])} evaluations, "
            f"{_number(result['median_collision_queries'])} collision queries, "
            f"{result['median_cpu_s']:.3g} s CPU"
        )
    for name, shape in (result.get("arrays") or {}).items():
        yield f"array {name}: {' × '.join(map(str, shape))}"
    if result["failures"]:
        yield _first(
            "\n", [f"replicate {f['replicate']}: {f['reason']}" for f in result["failures"]]
        )


def _verdict(verdict: Mapping[str, Any] | None) -> Iterator[str]:
    """Yield the certifier's counts, the closest approach, and the first contacts."""
    if verdict is None:
        yield "–"
        return
    counts = [f"{verdict[name]} {name}" for name in ("certified", "refuted", "undecided")]
    if verdict["without_motion"]:
        counts.append(f"{verdict['without_motion']} without a motion")
    kept, certified = verdict["certified_margin"], verdict["certified"]
    yield ", ".join(counts) + f"; required margin kept by {kept} of the {certified} certified"
    if verdict["clearance"] is not None:
        yield f"least clearance {_place(verdict, 'clearance')}"
    if verdict["allowed_contacts"]:
        yield f"may touch: {', '.join(verdict['allowed_contacts'])}"
        yield f"deepest overlap of these {_place(verdict, 'penetration')}"
    if verdict["contacts"]:
        contacts = [
            f"replicate {c['replicate']} touches at {c['refuted_at']:.4g} ({c['refuted_pair']})"
            for c in verdict["contacts"]
        ]
        yield _first("\n", contacts)


def _place(verdict: Mapping[str, Any], name: str) -> str:
    """Say a distance, with the replicate and the pair of bodies that have it."""
    pair = f" ({verdict[f'{name}_pair']})" if verdict[f"{name}_pair"] else ""
    unit, replicate = verdict["length_unit"], verdict[f"{name}_replicate"]
    return f"{_number(verdict[name])} {unit}, replicate {replicate}{pair}"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.6g}"


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
