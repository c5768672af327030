"""`evoexp site`: the home page of all reports."""

import argparse
import importlib
from collections import Counter

from evoexp.commands.console import say
from evoexp.commands.stored_runs import stored_runs
from evoexp.configuration.search_path import options
from evoexp.errors import EvoexpError, NothingStored
from evoexp.registry import CLAIMS, names, registered
from evoexp.report.pages.build import ReportFiles
from evoexp.report.pages.home_page import Paper, StoredRun, home_page, summaries
from evoexp.report.pages.html_page import HTML
from evoexp.report.statistics.claim_rules import registered_rules
from evoexp.store.files import write_file
from evoexp.store.run_context import ORIGIN, origin_of
from evoexp.store.run_directory import RunDirectory, outputs_root

MAX_NAMED = 4  # runs that are named as being written


def main(arguments: argparse.Namespace) -> int:
    """Write the page, and name it."""
    directory, files = home_files()
    directory.mkdir(parents=True, exist_ok=True)
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
        more = ", …" if len(busy) > MAX_NAMED else ""
        which = "runs are" if len(busy) > 1 else "run is"
        say(
            f"{len(busy)} {which} being written now ({', '.join(busy[:MAX_NAMED])}{more}): "
            "their results are partial"
        )
    return 0


def home_files() -> ReportFiles:
    """Return the home page as it follows from the reports and runs that are there."""
    outputs = outputs_root()
    found, runs = summaries(outputs / "reports"), list[StoredRun]()
    for name, run in stored_runs(outputs):
        if isinstance(run, EvoexpError):
            runs.append(StoredRun(name, "", "", "", 0, 0, 0, str(run)))
            continue
        origin = origin_of(run)
        experiment, label, budget = (str(origin[key] or "") for key in ORIGIN)
        budget += ", changed" * bool(budget and origin["changed"])
        counts = len(run.completed()), run.num_planned(), len(run.failed())
        runs.append(StoredRun(name, experiment, label, budget, *counts))
    if not found and not runs:
        raise NothingStored(
            f"site: nothing stored in {outputs}; try: evoexp run experiment=rana_planar"
        )
    runs.sort(key=lambda run: (run.experiment, run.budget, run.label, run.hash12))
    return ReportFiles(outputs / "reports", {HTML: home_page(found, papers(), runs)})


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
