"""`evoexp report`: figures, tables and verdicts again, from the outputs alone."""

import argparse
import functools
import importlib
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from evoexp.commands.arguments import add_experiment_arguments
from evoexp.commands.console import plain_console
from evoexp.commands.drafts import Draft, check_reports, draft_of, drafts
from evoexp.commands.drawn_reports import name_reports
from evoexp.commands.pack import unpacked
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import options
from evoexp.errors import NothingStored, SettingError
from evoexp.report import build
from evoexp.shipped import shipped
from evoexp.store.run_directory import RunDirectory, outputs_root

ASSUMPTIONS = "assumptions"  # stands for the experiments of that name, one per paper


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
        from evoexp.commands.all_reports import report_all  # composes every experiment

        return report_all(arguments, console)
    if not arguments.overrides:
        raise SettingError("experiment", "named, or --all given", "none")
    arguments.overrides = unpacked(arguments.overrides)
    if ASSUMPTIONS in arguments.overrides:
        arguments.overrides = _with_assumptions(arguments.overrides, console)
    found = drafts(arguments)
    if arguments.check:
        return check_reports((draft.files() for draft in found), console)
    if len(found) > 1:  # what all copies of this process need
        importlib.import_module("evoexp.report.style")  # matplotlib
    return name_reports(
        [functools.partial(_written, draft) for draft in found],
        console,
    )


def _written(draft: Draft) -> str:
    return str(build.write_report(draft.files()))


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
