"""Reports that are asked for, and the check of those that are there."""

import argparse
import hashlib
import re
import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from evoexp.commands.arguments import folder_words, is_override
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import is_file, options
from evoexp.errors import SettingError, UnknownOption
from evoexp.report import build
from evoexp.report.report_settings import ReportSettings
from evoexp.shipped import shipped
from evoexp.store.run_directory import outputs_root, resolve

MAX_NAMED = 4  # runs whose hashes a report's name spells out
_HASH = re.compile("[0-9a-fA-F]{4,64}")
_SILENT = ("experiment", "budget", "runner")  # overrides that a report's command need not repeat


class Draft(NamedTuple):
    """A report that is asked for, before it is drawn.

    Attributes:
        request: Names its conditions.
        settings: Formats and levels.
        num_replicates: Planned for every condition; None: as many as each one has.
    """

    request: build.Request
    settings: ReportSettings
    num_replicates: int | None

    def files(self) -> build.ReportFiles:
        """Draw it; nothing is written."""
        return build.derived(self.request, self.settings, outputs_root(), self.num_replicates)


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


def check_reports(
    reports: Iterable[build.ReportFiles], console: Console, *, others: int = 0
) -> int:
    """Compare reports with what is on disk, and name every file that is not the same.

    Args:
        reports: As they follow from the outputs.
        console: Prints one line per file, and one at the end.
        others: Reports that could not be drawn, which were named already.

    Returns:
        The exit code: 1 if a file differs, is missing or left over.
    """
    num_reports = num_files = num_wrong = 0
    for report in reports:
        wrong = list(differences(report))
        for line in wrong:
            console.print(line, soft_wrap=True)
        num_reports += 1
        num_files += len(report.files)
        num_wrong += len(wrong)
    checked = f"{num_files} files of {num_reports} report{'s' * (num_reports != 1)}"
    if num_wrong or others:
        console.print(f"check: {checked}: {num_wrong} not as they follow from the outputs")
        return 1
    console.print(f"check: {checked}: all as they follow from the outputs")
    return 0


def differences(report: build.ReportFiles) -> Iterable[str]:
    """Yield a line for every file that differs, is missing or left over."""
    directory, files = report
    for name, content in sorted(files.items()):
        try:
            stored = (directory / name).read_bytes()
        except FileNotFoundError:
            yield f"missing: {directory / name}"
            continue
        if stored != content:
            yield f"differs: {directory / name}"
    for path in left_over(report):
        yield f"left over: {path}"


def left_over(report: build.ReportFiles) -> list[Path]:
    """Return the files of a report's folder that it does not have; the home page owns no folder."""
    return build.stale_files(report) if build.INDEX in report.files else []
