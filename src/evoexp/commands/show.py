"""`evoexp show`: a condition before it is run, a stored run, or somebody's log."""

import argparse
import itertools
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from evoexp import shipped
from evoexp.commands.arguments import add_experiment_arguments, folder_words, is_override
from evoexp.commands.console import (
    add_columns,
    add_hash_column,
    new_table,
    plain_console,
    print_json,
)
from evoexp.commands.fact_screen import compact, screen, typed_parts
from evoexp.commands.facts import KEYS, composed_facts, log_facts, stored_facts
from evoexp.commands.hashes import with_candidates
from evoexp.commands.pack import in_archive, looked_into
from evoexp.commands.replicate_table import replicate_table
from evoexp.configuration import expansions
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import options
from evoexp.errors import AmbiguousHash, SettingError, UnknownHash, printable
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve

MAX_CHANGES = 6  # settings per row of a table of conditions


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
    parser.add_argument(
        "--json",
        action="store_true",
        help=f"print JSON, one object or a list of them. Keys: {keys}",
    )


def main(arguments: argparse.Namespace) -> int:
    """Print a screen of facts; of several conditions a table."""
    run: RunDirectory | None = None
    experiments: list[Experiment] = []
    if any(map(is_override, arguments.overrides)):
        experiments = expansions.expand(
            arguments.overrides, multirun=arguments.multirun, only=arguments.only
        )
        swept, folders = (["-m"] if arguments.multirun else []), folder_words(arguments.config_dir)
        words = ["evoexp", "run", *swept, *arguments.overrides, *folders]
        found = [
            composed_facts(experiment, label, shlex.join([*words, "--only", label]))
            for experiment in experiments
            for label, _ in experiment.conditions
        ]
    elif packed := in_archive(" ".join(arguments.overrides)):
        return _show_archive(arguments, *packed)
    elif len(arguments.overrides) > 1:
        raise SettingError("show", "given one hash or log", " ".join(arguments.overrides))
    elif (path := Path(arguments.overrides[0])).suffix == ".mcap" or path.is_file():
        found = [log_facts(path)]
    else:
        run, facts = _by_hash(arguments.overrides[0])
        found = [facts]
    console = plain_console()
    if len(found) > 1 and not (arguments.all or arguments.json):
        for experiment in experiments:
            console.print(_conditions(experiment, found))
        console.print("one condition on a screen: --only LABEL", soft_wrap=True)
        return 0
    _print_screens(console, arguments, found, [run] * len(found))
    return 0


def _show_archive(arguments: argparse.Namespace, path: Path, prefix: str) -> int:
    """Show the runs of an archive, which stay where they are."""
    console = plain_console()
    with looked_into(path, prefix) as runs:
        found = [stored_facts(run) for run in runs]
        for facts in found:
            facts["origin"]["directory"] = str(path)
        if len(found) > 1 and not (arguments.all or arguments.json):
            console.print(_packed(found))
            which = f"{printable(str(path))}:{runs[0].hash12}"
            console.print(f"one run on a screen: evoexp show {which}", soft_wrap=True)
        else:
            _print_screens(console, arguments, found, runs)
    return 0


def _packed(found: Sequence[dict[str, Any]]) -> Table:
    """Return a table of the runs of an archive."""
    table = new_table()
    add_hash_column(table)
    add_columns(table, "experiment", "condition")
    add_columns(table, "done", "solved", right=True)
    for facts in found:
        origin, result = facts["origin"], facts["result"] or {"done": 0, "solved": 0}
        names = (str(origin.get(name) or "–") for name in ("experiment", "label"))
        counts = (str(result[name]) for name in ("done", "solved"))
        table.add_row(facts["condition"][:12], *names, *counts)
    return table


def _print_screens(
    console: Console,
    arguments: argparse.Namespace,
    found: Sequence[dict[str, Any]],
    runs: Sequence[RunDirectory | None],
) -> None:
    if arguments.json:
        print_json(found if len(found) > 1 else found[0])
        return
    for facts, run in zip(found, runs, strict=True):
        for line in screen(facts, console.width):
            console.print(line, soft_wrap=True)
        if arguments.all:
            _print_all(console, facts, run)


def _by_hash(prefix: str) -> tuple[RunDirectory | None, dict[str, Any]]:
    """Return the run and the facts that a hash names: of a stored run, or a shipped condition.

    Raises:
        UnknownHash: If nothing has this hash.
        AmbiguousHash: If several shipped conditions begin with it.
    """
    try:
        run = resolve(outputs_root(), prefix)
        return run, stored_facts(run)
    except UnknownHash as error:
        rows = shipped.find(prefix)
        if len(rows) > 1:
            raise AmbiguousHash(prefix, [row.condition_id[:12] for row in rows]) from None
        if not rows and prefix in options("experiment"):
            raise UnknownHash(f"{error}; did you mean 'experiment={prefix}'?") from None
        if not rows:
            raise with_candidates(error, outputs_root()) from None
    row = rows[0]
    words = [f"experiment={row.experiment}", f"budget={row.budget}"]
    experiment = expansions.expand(words, only=[row.label])[0]
    return None, composed_facts(experiment, row.label, row.command)


def _print_all(console: Console, facts: Mapping[str, Any], run: RunDirectory | None) -> None:
    """Print settings as YAML, the table of replicates and the manifest."""
    _print_yaml(console, {"settings": facts["settings"]})
    if run is not None:
        console.print(replicate_table(run))
        manifest = {k: v for k, v in run.manifest().items() if k != "condition"}
        _print_yaml(console, {"manifest": manifest})


def _print_yaml(console: Console, data: Mapping[str, Any]) -> None:
    import yaml  # which only `--all` needs

    text = yaml.safe_dump(
        dict(data), sort_keys=False, default_flow_style=None, allow_unicode=True, width=110
    )
    console.print(text, soft_wrap=True)


def _conditions(experiment: Experiment, found: list[dict[str, Any]]) -> Table:
    """Return a table of an experiment's conditions and the settings in which they differ."""
    by_id = {facts["condition"]: facts for facts in found}
    rows = [(label, by_id[condition.id]) for label, condition in experiment.conditions]
    settings = [dict(_leaves(typed_parts(facts["settings"]))) for _, facts in rows]
    names = list(dict.fromkeys(itertools.chain.from_iterable(settings)))
    differing = [name for name in names if len({str(each.get(name)) for each in settings}) > 1]
    table = new_table(experiment.report_name)
    add_columns(table, "condition")
    add_hash_column(table)
    add_columns(table, "done", right=True)
    add_columns(table, "settings in which they differ")
    for (label, facts), values in zip(rows, settings, strict=True):
        given = [f"{name}={compact(values[name])}" for name in differing if name in values]
        more = [f"… {len(given) - MAX_CHANGES} more"] if len(given) > MAX_CHANGES else []
        result = facts["result"]
        done = f"{result['done']} of {result['planned']}" if result else "–"
        changes = "\n".join([*given[:MAX_CHANGES], *more])
        table.add_row(label, facts["condition"][:12], done, changes)
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
