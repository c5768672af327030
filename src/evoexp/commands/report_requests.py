"""Reports and comparisons as they are asked for: of experiments with overrides, or stored runs."""

import argparse
import hashlib
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from evoexp.commands.arguments import folder_words, is_override
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import is_file, options
from evoexp.errors import SettingError, UnknownOption
from evoexp.report.pages import build
from evoexp.report.report_settings import ReportSettings
from evoexp.shipped import shipped
from evoexp.store.run_directory import outputs_root, resolve

MAX_NAMED = 4  # runs whose hashes a report's name spells out
_HASH = re.compile("[0-9a-fA-F]{4,64}")
_SILENT = ("experiment", "budget", "runner")  # overrides that a report's command need not repeat


class ReportRequest(NamedTuple):
    """A report before it is drawn."""

    request: build.Request
    settings: ReportSettings
    num_replicates: int | None  # planned for every condition; None: as many as each one has

    def files(self) -> build.ReportFiles:
        """Draw it; nothing is written."""
        return build.derived(self.request, self.settings, outputs_root(), self.num_replicates)

    def write(self) -> Path:
        """Draw and write it; return the path of its page."""
        return build.write_report(self.files())


def chosen(
    arguments: argparse.Namespace,
) -> tuple[dict[str, Condition], list[Experiment], list[str], ReportSettings]:
    """Return the stored runs, or experiments and overrides, that a command chooses, and settings.

    Settings are those of the first experiment, of runs those of the paper's report.
    """
    multirun, only, known = arguments.multirun, arguments.only, options("experiment")
    overrides = [word for word in arguments.overrides if is_override(word)]
    names = [word for word in arguments.overrides if word not in overrides]
    unknown = [name for name in names if name not in known and not is_file(name)]
    if names and len(unknown) == len(names) and all(map(_HASH.fullmatch, names)):
        if overrides or multirun or only:
            must = "left out where runs are given by their hashes"
            raise SettingError("overrides", must, " ".join([*overrides, *only]) or "-m")
        runs = [resolve(outputs_root(), name) for name in names]
        conditions = {run.hash12: Condition.from_json(run.config_json()) for run in runs}
        plain = compose.expand([f"experiment={shipped()[0].experiment}", "report=paper"])[0]
        return conditions, [], [], plain.report
    for name in unknown:
        if len(unknown) < len(names) or not _HASH.fullmatch(name):
            raise UnknownOption("experiment", name, known)
    words = [f"experiment={','.join(names)}"] if names else []
    experiments = compose.expand(
        [*words, *overrides], multirun=multirun or len(names) > 1, only=only
    )
    return {}, experiments, overrides, experiments[0].report


def requests(arguments: argparse.Namespace) -> list[ReportRequest]:
    """Return a report of every named experiment, or a single report of all named runs."""
    runs, experiments, overrides, settings = chosen(arguments)
    if runs:
        name = "+".join(runs)
        if len(runs) > MAX_NAMED:
            name = f"{len(runs)}_runs+{hashlib.sha256(name.encode()).hexdigest()[:8]}"
        return [ReportRequest(build.Request(name, "", "", tuple(runs.items())), settings, None)]
    return [
        request_of(experiment, overrides, arguments.multirun, arguments.only, arguments.config_dir)
        for experiment in experiments
    ]


def request_of(
    experiment: Experiment,
    overrides: Sequence[str],
    multirun: bool = False,
    only: Sequence[str] = (),
    config_dir: Sequence[str] = (),
) -> ReportRequest:
    """Return the report of one experiment, whose command repeats the words that were typed."""
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
    return ReportRequest(request, experiment.report, experiment.num_replicates)
