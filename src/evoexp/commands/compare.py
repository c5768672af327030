"""`evoexp compare`: planners in one currency, by answers that the exact certifier proves."""

import argparse
import hashlib
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.table import Table

from evoexp.commands.arguments import add_experiment_arguments, folder_words, is_override
from evoexp.commands.console import add_columns, new_table, plain_console, print_json
from evoexp.commands.pack import unpacked
from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.configuration.labels import SAME
from evoexp.configuration.search_path import is_file, options
from evoexp.errors import SettingError, UnknownOption
from evoexp.report import build, markdown
from evoexp.report.best_known import read_best_known, shipped_best_known
from evoexp.report.comparison_files import as_csv, as_latex
from evoexp.report.given_data import GivenData, of_given, read_given, strange_problems
from evoexp.report.ioh_format import ioh_files
from evoexp.report.pages import comparison
from evoexp.report.planner_runs import PlannerRuns, of_results
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import gather
from evoexp.shipped import shipped
from evoexp.store.files import write_file, write_files
from evoexp.store.run_directory import outputs_root, resolve

PAGE = "comparison"
MAX_NAMED = 4  # runs whose hashes the name of a report spells out
_HASH = re.compile("[0-9a-fA-F]{4,64}")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    words = add_experiment_arguments(parser)
    words.metavar, words.nargs = "EXPERIMENT | HASH | RUNS.tar ... [KEY=VALUE ...]", "+"
    words.help = "experiments and overrides as for run, or prefixes of the hashes of stored runs"
    parser.add_argument(
        "--data",
        metavar="FILE.csv",
        help="runs of other planners: columns planner, problem, seed, queries, cost; a row per "
        "improvement, cost: the path's length, empty: the run has no answer",
    )
    parser.add_argument(
        "--best-known",
        metavar="FILE.yaml",
        help="best known lengths of problems, besides those that come with evoexp: targets are "
        "multiples of them",
    )
    parser.add_argument("--csv", metavar="FILE", help="write the table as CSV, with all digits")
    parser.add_argument("--latex", metavar="FILE", help="write the table as LaTeX (booktabs)")
    parser.add_argument(
        "--ioh", metavar="FOLDER", help="write the runs for IOHanalyzer and iohinspector"
    )
    parser.add_argument("--json", action="store_true", help="print JSON: an object per condition")


class Drawn(NamedTuple):
    """A comparison before it is written.

    Attributes:
        files: Of its page.
        request: That it answers.
        settings: Levels and formats.
        runs: Of all planners, those given by `--data` included.
        strange: Lines on problems that only the given data know.
    """

    files: build.ReportFiles
    request: build.Request
    settings: ReportSettings
    runs: list[PlannerRuns]
    strange: list[str]


def main(arguments: argparse.Namespace) -> int:
    """Draw the page, and print its table."""
    arguments.overrides = unpacked(arguments.overrides)
    if arguments.ioh:
        _check_empty(arguments.ioh)
    files, request, settings, runs, strange = drawn(arguments)
    path = build.write_report(files)
    rows = comparison.rated(runs, settings)
    _write_files(arguments, runs, rows, f"evoexp compare {request.words}", settings)
    if arguments.json:
        print_json([row._asdict() | _parts(row) for row in rows])
        return 0
    console = plain_console()
    console.print(_table(rows, request.report_name))
    for line in strange:
        console.print(line, highlight=False, soft_wrap=True)
    for kind in ("csv", "latex", "ioh"):
        if written := getattr(arguments, kind):
            console.print(f"{kind}: {written}", highlight=False, soft_wrap=True)
    console.print(f"compare: {path}", highlight=False, soft_wrap=True)
    return 0


def drawn(arguments: argparse.Namespace) -> Drawn:
    """Draw the page that is asked for; nothing is written."""
    given = read_given(arguments.data) if arguments.data else None
    known = _best_known(arguments.best_known)
    request, settings, planned = _asked(arguments)
    if given:
        request = _with_data(request, arguments.data, given)
    found = gather(
        outputs_root(),
        request.conditions,
        planned,
        request.experiment,
        request.budget,
        request.hint,
        request.options,
    )
    runs, strange = of_results(found.evolved, known), list[str]()
    if given:
        strange = list(strange_problems(given, runs))
        runs += of_given(given, runs)
    page = comparison.page_of_runs(runs, found, settings, given)
    return Drawn(build.page_files(request, page, found, settings), request, settings, runs, strange)


def _table(rows: Sequence[comparison.Rated], title: str) -> Table:
    table = new_table(title)
    add_columns(table, "condition")
    add_columns(table, "proven", "queries\neach", "best\nlength", "refuted", right=True)
    for row in rows:
        table.add_row(
            row.condition,
            f"{row.proven} of {row.runs}",
            markdown.number(row.queries),
            markdown.number(row.lengths.median),
            f"{row.refuted} of {row.judged}" if row.judged else "–",
        )
    return table


def _write_files(
    arguments: argparse.Namespace,
    runs: Sequence[PlannerRuns],
    rows: Sequence[comparison.Rated],
    command: str,
    settings: ReportSettings,
) -> None:
    """Write the files that `--csv`, `--latex` and `--ioh` ask for."""
    if arguments.csv:
        write_file(Path(arguments.csv), as_csv(rows))
    if arguments.latex:
        write_file(Path(arguments.latex), as_latex(rows, command, settings.confidence))
    if arguments.ioh:
        folder = Path(arguments.ioh)
        files = {folder / name: content for name, content in ioh_files(runs).items()}
        for parent in {path.parent for path in files}:
            parent.mkdir(parents=True, exist_ok=True)
        write_files(files)


def _parts(row: comparison.Rated) -> dict[str, Any]:
    return {"interval": row.interval._asdict(), "lengths": row.lengths._asdict()}


def _asked(arguments: argparse.Namespace) -> tuple[build.Request, ReportSettings, int | None]:
    """Return the request of the page, its settings, and the planned replicates.

    Raises:
        UnknownOption: If a word is neither an experiment nor a hash.
        SettingError: If runs are given by their hashes, and overrides beside them.
    """
    multirun, only, known = arguments.multirun, arguments.only, options("experiment")
    overrides = [word for word in arguments.overrides if is_override(word)]
    names = [word for word in arguments.overrides if word not in overrides]
    words = shlex.join([*arguments.overrides, *(["-m"] if multirun else [])])
    words += f" --only {shlex.quote(','.join(only))}" if only else ""
    words = " ".join([words, *folder_words(arguments.config_dir)])
    if names and not any(name in known or is_file(name) for name in names):
        for name in names:
            if not _HASH.fullmatch(name):
                raise UnknownOption("experiment", name, known)
        if overrides or multirun or only:
            must = "left out where runs are given by their hashes"
            raise SettingError("overrides", must, " ".join([*overrides, *only]) or "-m")
        runs = [resolve(outputs_root(), name) for name in names]
        conditions = {run.hash12: Condition.from_json(run.config_json()) for run in runs}
        plain = expansions.expand([f"experiment={shipped()[0].experiment}", "report=paper"])[0]
        name = _name("+".join(conditions), len(conditions))
        request = build.Request(name, "", "", tuple(conditions.items()), words, None, "compare")
        return request, _with_page(plain.report), None
    for name in names:
        if name not in known and not is_file(name):
            raise UnknownOption("experiment", name, known)
    chosen = [f"experiment={','.join(names)}"] if names else []
    experiments = expansions.expand(
        [*chosen, *overrides], multirun=multirun or len(names) > 1, only=only
    )
    several = len(experiments) > 1
    rows: dict[str, tuple[str, Condition]] = {}  # experiments share conditions
    for experiment in experiments:
        for label, condition in experiment.conditions:
            name = f"{experiment.name}: {label}" if several else label
            before = [rows[condition.id][0]] if condition.id in rows else []
            rows[condition.id] = SAME.join([*before, name]), condition
    first = experiments[0]
    name = _name("+".join(experiment.report_name for experiment in experiments), len(experiments))
    title = " and ".join(dict.fromkeys(experiment.name for experiment in experiments))
    request = build.Request(name, title, first.budget, tuple(rows.values()), words, None, "compare")
    return request, _with_page(first.report), first.num_replicates


def _check_empty(path: str) -> None:
    """Refuse a folder that holds anything: readers would take older files in it for runs, too."""
    folder = Path(path)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise SettingError("--ioh", "a folder that is empty or not there yet", path)


def _best_known(path: str | None) -> dict[str, float]:
    """Return the best known lengths by the keys of problems; those of the user's file win."""
    known = shipped_best_known() | (read_best_known(path) if path else {})
    return {key: each.length for key, each in known.items()}


def _with_data(request: build.Request, path: str, given: GivenData) -> build.Request:
    """Return the request of a page that shows given runs, too: a folder of its own."""
    name = f"{request.report_name}+given_{given.sha256[:8]}"
    words = f"{request.arguments} --data {shlex.quote(path)}".strip()
    return request._replace(report_name=name, arguments=words)


def _name(parts: str, count: int) -> str:
    """Return the name of the page's folder."""
    if count > MAX_NAMED:
        parts = f"{count}+{hashlib.sha256(parts.encode()).hexdigest()[:8]}"
    return f"compare_{parts}"


def _with_page(settings: ReportSettings) -> ReportSettings:
    return settings.model_copy(update={"figures": PAGE})
