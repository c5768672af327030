"""`evoexp report`: figures, tables and verdicts again, from the outputs alone."""

import argparse
import hashlib
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from evoexp.commands.arguments import add_experiment_arguments, folder_words, is_override
from evoexp.commands.console import plain_console
from evoexp.commands.drafts import Draft, check_reports
from evoexp.commands.pack import unpacked
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import is_file, options
from evoexp.errors import NothingStored, SettingError, UnknownOption
from evoexp.report import build
from evoexp.shipped import shipped
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve

ASSUMPTIONS = "assumptions"  # stands for the experiments of that name, one per paper
MAX_NAMED = 4  # runs whose hashes a report's name spells out
_HASH = re.compile("[0-9a-fA-F]{4,64}")
_SILENT = (
    "experiment",
    "budget",
    "runner",
)  # overrides that the command of a report need not repeat


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    words = add_experiment_arguments(parser)
    words.metavar, words.nargs = "EXPERIMENT | HASH | RUNS.tar ... [KEY=VALUE ...]", "*"
    words.help = (
        "an experiment and overrides as for run, or prefixes of the hashes of stored runs; "
        f"`{ASSUMPTIONS}`: every paper's page of assumed numbers"
    )
    parser.add_argument(
        "--all",
        action="store_true",
        help="every experiment of which something is stored, every report that is there, and the "
        "home page (evoexp site)",
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="write nothing: derive every file again, name those that differ, are missing or left "
        "over; exit code 1 if there are any",
    )


def main(arguments: argparse.Namespace) -> int:
    """Draw, or check; exit code 1 if something differs or cannot be drawn."""
    console = plain_console()
    if arguments.all:
        from evoexp.commands.all_reports import report_all

        return report_all(arguments, console)
    if not arguments.overrides:
        raise SettingError("experiment", "named, or --all given", "none")
    arguments.overrides = unpacked(arguments.overrides)
    if ASSUMPTIONS in arguments.overrides:
        arguments.overrides = _with_assumptions(arguments.overrides, console)
    found = drafts(arguments)
    if arguments.check:
        return check_reports((draft.files() for draft in found), console)
    for draft in found:
        console.print(f"report: {build.write_report(draft.files())}", soft_wrap=True)
    return 0


def _with_assumptions(words: Sequence[str], console: Console) -> list[str]:
    """Return the words with `assumptions` replaced by the papers' experiments of that name.

    An experiment that nothing is stored of is named instead, with the command that runs it.

    Raises:
        NothingStored: If nothing is stored of any of them.
    """
    every = [name for name in options("experiment") if name.endswith(f"_{ASSUMPTIONS}")]
    table, outputs = shipped(), outputs_root()
    ids = {name: {r.condition_id for r in table if r.experiment == name} for name in every}
    stored = [
        name for name in every if any(RunDirectory(outputs, each).completed() for each in ids[name])
    ]
    missing = " ".join(f"evoexp run experiment={name};" for name in every if name not in stored)
    if not stored:
        raise NothingStored(f"{ASSUMPTIONS}: nothing stored in {outputs}; try: {missing[:-1]}")
    if missing:
        console.print(f"nothing stored yet: {missing[:-1]}", soft_wrap=True)
    return [name for word in words for name in (stored if word == ASSUMPTIONS else [word])]


def drafts(arguments: argparse.Namespace) -> list[Draft]:
    """Return a report of every named experiment, or a single report of all named runs.

    Raises:
        UnknownOption: If a word is neither an experiment nor a hash.
        SettingError: If runs are given by their hashes, and overrides beside them.
    """
    multirun, only, known = arguments.multirun, arguments.only, options("experiment")
    overrides = [word for word in arguments.overrides if is_override(word)]
    names = [word for word in arguments.overrides if word not in overrides]
    names, overrides = _with_budget(names, overrides)
    if names and not any(name in known or is_file(name) for name in names):
        for name in names:
            if not _HASH.fullmatch(name):
                raise UnknownOption("experiment", name, known)
        if overrides or multirun or only:
            must = "left out where runs are given by their hashes"
            raise SettingError("overrides", must, " ".join([*overrides, *only]) or "-m")
        return [_of_runs(names)]
    chosen = [f"experiment={','.join(names)}"] if names else []
    for name in names:
        if name not in known and not is_file(name):
            raise UnknownOption("experiment", name, known)
    experiments = expansions.expand(
        [*chosen, *overrides], multirun=multirun or len(names) > 1, only=only
    )
    return [
        draft_of(experiment, overrides, multirun, only, arguments.config_dir)
        for experiment in experiments
    ]


def _with_budget(names: Sequence[str], overrides: list[str]) -> tuple[list[str], list[str]]:
    """Read `rana_planar@smoke`, as the folder of a report is named, as its words.

    Raises:
        SettingError: If experiments are named with several budgets.
    """
    parted = [name.partition("@") if not is_file(name) else (name, "", "") for name in names]
    budgets = dict.fromkeys(budget for _, at, budget in parted if at)
    if not budgets:
        return list(names), overrides
    given = {word for word in overrides if word.startswith("budget=")}
    found = {f"budget={budget}" for budget in budgets} | given
    if len(found) > 1 or not all(at for _, at, _ in parted):
        raise SettingError("budget", "one for all experiments", " ".join(names))
    return [name for name, _, _ in parted], [*overrides, *(found - given)]


def of_experiment(
    experiment: Experiment,
    overrides: Sequence[str],
    multirun: bool = False,
    only: Sequence[str] = (),
    config_dir: Sequence[str] = (),
) -> Path:
    """Draw the report of one experiment, as `run` does at its end; see `draft_of`.

    Returns:
        Path of its `index.md`.
    """
    draft = draft_of(experiment, overrides, multirun, only, config_dir)
    return build.write_report(draft.files())


def draft_of(
    experiment: Experiment,
    overrides: Sequence[str],
    multirun: bool = False,
    only: Sequence[str] = (),
    config_dir: Sequence[str] = (),
) -> Draft:
    """Return the report of one experiment.

    Args:
        experiment: As `expansions.expand` gives it.
        overrides: As typed; `experiment=` among them is not looked at.
        multirun: Whether `-m` was given.
        only: The labels of `--only`.
        config_dir: The folders of `--config-dir`.
    """
    file = [word.split("=")[1] for word in overrides if word.startswith("experiment=")]
    words = [experiment.name] if experiment.name in options("experiment") else []
    words = file if any(map(is_file, file)) else words
    words += [f"budget={experiment.budget}"] if experiment.budget != "paper" else []
    words += [word for word in overrides if word.split("=")[0] not in _SILENT]
    words += ["--only", ",".join(only)] if only else []
    words += ["-m"] if multirun else []
    words += folder_words(config_dir)
    request = build.Request(
        experiment.report_name,
        experiment.name,
        experiment.budget,
        experiment.conditions,
        shlex.join(words),
        experiment.options,
    )
    return Draft(request, experiment.report, experiment.num_replicates)


def _of_runs(prefixes: Sequence[str]) -> Draft:
    """Return one report of several stored runs."""
    runs = [resolve(outputs_root(), prefix) for prefix in prefixes]
    found = {run.hash12: Condition.from_json(run.config_json()) for run in runs}
    name = "+".join(found)
    if len(found) > MAX_NAMED:
        name = f"{len(found)}_runs+{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    plain = expansions.expand([f"experiment={shipped()[0].experiment}", "report=paper"])[0]
    request = build.Request(name, "", "", tuple(found.items()))
    return Draft(request, plain.report, None)
