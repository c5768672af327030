"""`evoexp compare`: planners in one currency, by answers that the exact certifier proves."""

import argparse
import shlex
from pathlib import Path

from evoexp.commands.command_parser import option_words
from evoexp.commands.console import new_table, print_json, right, say
from evoexp.commands.report import chosen, folder_name
from evoexp.commands.stored_runs import unpacked
from evoexp.condition import Condition
from evoexp.configuration.conditions import SAME
from evoexp.report.pages import build, comparison, markdown
from evoexp.report.results import comparison_files
from evoexp.report.results.planner_runs import PlannerRuns, of_results
from evoexp.store.files import write_file
from evoexp.store.run_directory import outputs_root


def main(arguments: argparse.Namespace) -> int:
    """Draw the page, and print its table."""
    arguments.overrides = unpacked(arguments.overrides)
    files, request, runs, strange = drawn(arguments)
    page = build.write_report(files)
    rows = comparison.rated(runs, request.settings)
    if arguments.csv:
        write_file(Path(arguments.csv), comparison.as_csv(rows))
    if arguments.latex:
        (latex,) = (text for name, text in files.files.items() if name.endswith("_answers.tex"))
        write_file(Path(arguments.latex), latex)
    if arguments.json:
        inner = ("interval", "lengths")
        print_json([row._asdict() | {k: getattr(row, k)._asdict() for k in inner} for row in rows])
        return 0
    numbers = right("proven", "queries\neach", "best\nlength", "refuted")
    table = new_table(request.report_name, "condition", *numbers)
    for row in rows:
        refuted = f"{row.refuted} of {row.judged}" if row.judged else "–"
        values = markdown.number(row.queries), markdown.number(row.lengths.median), refuted
        table.add_row(row.condition, f"{row.proven} of {row.runs}", *values)
    say(table)
    for line in strange:
        say(line)
    for kind in ("csv", "latex"):
        if place := getattr(arguments, kind):
            say(f"{kind}: {place}")
    say(f"compare: {page}")
    return 0


def drawn(
    arguments: argparse.Namespace,
) -> tuple[build.ReportFiles, build.Request, list[PlannerRuns], list[str]]:
    """Draw the page that is asked for; return lines on problems that only given data know, too."""
    given = comparison_files.read_given(arguments.data) if arguments.data else None
    known = comparison_files.shipped_best_known()
    if arguments.best_known:
        known |= comparison_files.read_best_known(arguments.best_known)
    request = _asked(arguments)
    if given:  # a page of its own
        name = f"{request.report_name}+given_{given.sha256[:8]}"
        words = f"{request.arguments} --data {shlex.quote(arguments.data)}".strip()
        request = request._replace(report_name=name, arguments=words)
    found = request.results(outputs_root())
    lengths = {key: each.length for key, each in known.items()}
    runs, strange = of_results(found.evolved, lengths), list[str]()
    if given:
        strange = list(comparison_files.strange_problems(given, runs))
        runs += comparison_files.of_given(given, runs)
    page = comparison.page(found, request.settings, runs, given)
    return build.page_files(request, page, found), request, runs, strange


def _asked(arguments: argparse.Namespace) -> build.Request:
    words = shlex.join([*arguments.overrides, *option_words(arguments)])
    runs, experiments, _, settings = chosen(arguments)
    settings = settings.model_copy(update={"figures": "comparison"})
    names, title, budget, num_replicates = [*runs], "", "", None
    if experiments:
        names = [experiment.report_name for experiment in experiments]
        title = " and ".join(dict.fromkeys(experiment.name for experiment in experiments))
        budget, num_replicates = experiments[0].budget, experiments[0].num_replicates
    rows: dict[str, tuple[str, Condition]] = {run.id: (name, run) for name, run in runs.items()}
    for experiment in experiments:  # which share conditions
        for label, condition in experiment.conditions:
            name = f"{experiment.name}: {label}" if len(experiments) > 1 else label
            before = [rows[condition.id][0]] if condition.id in rows else []
            rows[condition.id] = SAME.join([*before, name]), condition
    folder = f"compare_{folder_name(names)}"
    planned = tuple(rows.values()), settings, num_replicates
    return build.Request(folder, title, budget, *planned, words, command="compare")
