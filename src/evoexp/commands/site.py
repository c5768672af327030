"""`evoexp site`: the home page of all reports."""

import argparse
import functools
import importlib
from collections import Counter

from evoexp.commands.console import say
from evoexp.commands.stored_runs import stored_runs
from evoexp.configuration.search_path import options
from evoexp.errors import EvoexpError, NothingStored
from evoexp.registry import CLAIMS, names, registered
from evoexp.report.pages.build import ReportFiles
from evoexp.report.pages.html_page import HTML, Paper, StoredRun, home_page, summaries
from evoexp.report.results.parameters import option
from evoexp.report.statistics.judging import registered_rules
from evoexp.shipped import config_directory, shipped
from evoexp.store.files import first_of, write_file
from evoexp.store.identity import ORIGIN
from evoexp.store.run_directory import RunDirectory, outputs_root

MAX_NAMED = 4  # runs that are named as being written
PAPER, FEWER = "paper", "paper, fewer runs"  # budgets


def main(arguments: argparse.Namespace) -> int:
    """Write the page, and name it."""
    directory, files = home_files()
    write_file(directory / HTML, files[HTML])
    say(f"site: {directory / HTML}")
    # unfinished runs that another process is writing now
    busy = [
        name
        for name, run in stored_runs(outputs_root())
        if isinstance(run, RunDirectory)
        and run.num_planned() > len(run.completed())
        and run.is_being_written()
    ]
    if busy:
        which, named = "runs are" if len(busy) > 1 else "run is", first_of(busy, MAX_NAMED)
        names = ", ".join(named)
        say(f"{len(busy)} {which} being written now ({names}): their results are partial")
    return 0


def home_files() -> ReportFiles:
    """Return the home page as it follows from the reports and runs that are there."""
    outputs = outputs_root()
    found, runs = summaries(outputs / "reports"), list[StoredRun]()
    for name, run in stored_runs(outputs):
        if isinstance(run, EvoexpError):
            runs.append(StoredRun(name, "", "", "", 0, 0, 0, str(run)))
            continue
        origin = run.origin()
        experiment, label, budget = (str(origin[key] or "") for key in ORIGIN)
        budget += ", changed" * bool(budget and origin["changed"])
        counts = len(run.completed()), run.num_planned(), len(run.failed())
        if budget == PAPER and 1 < counts[1] < planned_by(experiment):
            budget = FEWER
        runs.append(StoredRun(name, experiment, label, budget, *counts))
    if not found and not runs:
        raise NothingStored(
            f"site: nothing stored in {outputs}; try: evoexp run experiment=rana_planar"
        )
    runs.sort(key=lambda run: (run.experiment, run.budget, run.label, run.hash12))
    return ReportFiles(outputs / "reports", {HTML: home_page(found, papers(), runs)})


@functools.cache
def planned_by(experiment: str) -> int:
    """Return the number of replicates that a shipped experiment plans; 0: it is not shipped."""
    if all(row.experiment != experiment for row in shipped()):
        return 0
    entry = option(config_directory() / "experiment" / f"{experiment}.yaml").get("num_replicates")
    return int(entry.value) if entry else 0


def papers() -> list[Paper]:
    """Return the papers that packages register claims of, the oldest first.

    The title of a paper is the first sentence of its package.
    """
    found = []
    for name in names(CLAIMS):
        registration = registered(CLAIMS, name)
        assert registration is not None
        rules = registered_rules(registration).values()
        module = importlib.import_module(registration.module)
        text = importlib.import_module(module.__package__ or module.__name__).__doc__ or name
        title, _, subtitle = text.strip().partition("\n")[0].rstrip(".").partition(": ")
        claims = Counter(experiment for rule in rules for experiment in rule.experiments)
        found.append(Paper(name, title, subtitle, tuple(options("experiment")), claims))
    return sorted(found, key=lambda paper: (paper.title[-4:], paper.title))
