"""`evoexp report`, figures, tables and verdicts from outputs alone; `evoexp claims`, verdicts."""

import argparse
import contextlib
import functools
import hashlib
import io
import itertools
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rich.table import Column

from evoexp import registry
from evoexp.commands import site
from evoexp.commands.command_parser import command_parser, is_override, option_words
from evoexp.commands.console import new_table, print_json, say, say_each
from evoexp.commands.stored_runs import stored_runs, unpacked
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import is_file, options, searched_first
from evoexp.errors import EvoexpError, NothingStored, StoreError, UnknownOption, demand
from evoexp.report.pages import build
from evoexp.report.pages.html_page import summaries, verdict_counts
from evoexp.report.pages.page_builder import page_of
from evoexp.report.report_settings import ReportSettings
from evoexp.report.statistics.judging import Rules, registered_rules
from evoexp.shipped import shipped
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve

PlannedReports = dict[str, Callable[[], build.ReportFiles]]  # folder → who draws it
CLAIMS = "claims"  # stands for the experiments `<paper>_claims`
MAX_NAMED = 4  # runs whose hashes a report's name spells out
_HASH = re.compile("[0-9a-fA-F]{4,64}")
_SILENT = ("experiment", "budget", "runner")  # overrides that a report's command need not repeat


def main(arguments: argparse.Namespace) -> int:
    """Draw, or check; exit code 1 if something differs, or one of all cannot be drawn."""
    if arguments.all:
        return _main_of_all(arguments)
    demand(arguments.overrides, "experiment", "named, or --all given", "none")
    arguments.overrides = unpacked(arguments.overrides)
    if CLAIMS in arguments.overrides:
        arguments.overrides = _with_claims(arguments.overrides)
    asked = requests(arguments)
    if arguments.check:
        return _check(request.files(outputs_root()) for request in asked)
    say_each(functools.partial(request.write, outputs_root()) for request in asked)
    return 0


def _main_of_all(arguments: argparse.Namespace) -> int:
    beside = [*arguments.overrides, *arguments.only, *["-m"] * arguments.multirun]
    demand(not beside, "--all", "given alone", " ".join(beside))
    planned = planned_reports(outputs_root())
    if not planned:
        raise NothingStored(
            f"report: no experiment is stored in {outputs_root()}, and no report; see: evoexp list"
        )
    failed: list[str] = []
    reports = _drawn(planned, failed)
    if arguments.check:
        code = _check(itertools.chain(reports, (site.home_files() for _ in range(1))))
        return 1 if failed else code
    for report in reports:
        say(f"report: {build.write_report(report)}")
    site.main(arguments)
    return 1 if failed else 0


def _check(reports: Iterable[build.ReportFiles]) -> int:
    num_reports = num_files = num_wrong = 0
    for report in reports:
        wrong = []
        for name, content in sorted(report.files.items()):
            path = report.directory / name
            if not path.exists():
                wrong.append(f"missing: {path}")
            elif path.read_bytes() != content:
                wrong.append(f"differs: {path}")
        if build.INDEX in report.files:  # the home page owns no folder
            wrong += [f"left over: {path}" for path in build.stale_files(report)]
        for line in wrong:
            say(line)
        num_reports += 1
        num_files += len(report.files)
        num_wrong += len(wrong)
    checked = f"check: {num_files} files of {num_reports} report{'s' * (num_reports != 1)}"
    answer = f"{num_wrong or 'all'} {'not ' * bool(num_wrong)}as they follow from the outputs"
    say(f"{checked}: {answer}")
    return 1 if num_wrong else 0


def _with_claims(words: Sequence[str]) -> list[str]:
    """Return the words with `claims` replaced by the papers' experiments that are stored."""
    every = [name for name in options("experiment") if name.endswith(f"_{CLAIMS}")]
    table, outputs = shipped(), outputs_root()
    ids = {name: {r.condition_id for r in table if r.experiment == name} for name in every}
    stored = [
        name for name in every if any(RunDirectory(outputs, each).completed() for each in ids[name])
    ]
    missing = " ".join(f"evoexp run experiment={name};" for name in every if name not in stored)
    if not stored:
        raise NothingStored(f"{CLAIMS}: nothing stored in {outputs}; try: {missing[:-1]}")
    if missing:
        say(f"nothing stored yet: {missing[:-1]}")
    return [name for word in words for name in (stored if word == CLAIMS else [word])]


# what is asked for


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
        must, beside = "left out where runs are given by their hashes", [*overrides, *only]
        demand(not (beside or multirun), "overrides", must, " ".join(beside) or "-m")
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


def requests(arguments: argparse.Namespace) -> list[build.Request]:
    """Return a report of every named experiment, or a single report of all named runs."""
    runs, experiments, overrides, settings = chosen(arguments)
    if runs:
        name = folder_name([*runs], "_runs")
        return [build.Request(name, "", "", tuple(runs.items()), settings, None)]
    again = option_words(arguments)
    return [request_of(experiment, overrides, again) for experiment in experiments]


def folder_name(parts: Sequence[str], noun: str = "") -> str:
    """Return the names that a page combines, or, of many, their number and a hash."""
    name = "+".join(parts)
    if len(parts) > MAX_NAMED:
        name = f"{len(parts)}{noun}+{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    return name


def request_of(
    experiment: Experiment, overrides: Sequence[str], again: Sequence[str] = ()
) -> build.Request:
    """Return the report of one experiment, whose command repeats the words that were typed.

    Behind the overrides come the words of the options, see `option_words`.
    """
    search = experiment.search
    if search is not None and not search.stored:
        must = "no trial of this search is stored; evoexp run with the same words starts it"
        raise NothingStored(f"{experiment.report_name}: {must}")
    files = [word.split("=")[1] for word in overrides if word.startswith("experiment=")]
    words = [experiment.name] if experiment.name in options("experiment") else []
    words = files if any(map(is_file, files)) else words
    words += [f"budget={experiment.budget}"] if experiment.budget != "paper" else []
    words += [word for word in overrides if re.split("=|(?<=^runner)[.]", word)[0] not in _SILENT]
    words += again
    return build.Request(
        experiment.report_name,
        experiment.name,
        experiment.budget,
        experiment.conditions,
        experiment.report,
        experiment.num_replicates,
        shlex.join(words),
        experiment.options,
        searched=search.found() if search else None,
    )


# all reports


def _drawn(planned: PlannedReports, failed: list[str]) -> Iterator[build.ReportFiles]:
    """Draw reports one after the other; name those that cannot be drawn, and leave them."""
    for folder, draw in planned.items():
        try:
            report = draw()
            if report.directory.name != folder:
                raise StoreError(f"its command draws {report.directory.name}")
        except (EvoexpError, OSError) as error:
            failed.append(folder)
            say(f"cannot be drawn: {folder}: {error}")
            continue
        yield report


def planned_reports(outputs: Path) -> PlannedReports:
    """Return the reports of experiments that stored runs name, then the others that are there."""
    named = dict[tuple[str, str], set[str]]()  # (experiment, budget) → hashes of its runs
    for _, run in stored_runs(outputs):
        if isinstance(run, RunDirectory) and (run.completed() or run.failed()):
            with contextlib.suppress(EvoexpError):  # damaged notes name none
                notes = run.manifest()
                origin = str(notes.get("experiment")), str(notes.get("budget"))
                named.setdefault(origin, set()).add(run.condition_id)
    planned: PlannedReports = {}
    known = itertools.product(options("experiment"), options("budget"))
    for name, budget in (origin for origin in known if origin in named):
        (experiment,) = compose.expand(words := [f"experiment={name}", f"budget={budget}"])
        if named[name, budget].isdisjoint(condition.id for _, condition in experiment.conditions):
            continue  # all of them were run with other settings
        request = request_of(experiment, words)
        planned[request.report_name] = functools.partial(request.files, outputs)
    for page in summaries(outputs / "reports"):
        planned.setdefault(page.folder, functools.partial(_again, page.folder, page.command))
    return planned


def _again(folder: str, command: str) -> build.ReportFiles:
    """Draw a report by the command that its page names; nothing is written."""
    from evoexp.commands import compare  # which takes what is asked for from here

    no_command = StoreError(f"{folder}: names no command that draws it alone")
    try:
        name, *words = shlex.split(command)
    except ValueError:
        raise no_command from None
    if name not in ("report", "compare"):
        raise no_command
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint), contextlib.redirect_stdout(complaint):
            arguments = command_parser(name).parse_intermixed_args(words)
    except SystemExit as error:
        raise StoreError(complaint.getvalue().strip().removeprefix("evoexp: ")) from error
    with searched_first(arguments.config_dir):
        if name == "compare":
            return compare.drawn(arguments)[0]
        asked = [] if arguments.all else requests(arguments)
        if len(asked) != 1:
            raise no_command
        return asked[0].files(outputs_root())


_OF_CLAIM = ("name", "claim", "source", "rule", "evidence", "size", "n", "verdict")
OURS = "our question"  # the source of what no paper claims
PAPERS = registry.names(registry.CLAIMS)
KEYS = ("paper", *_OF_CLAIM, "experiment", "command")


def claims(arguments: argparse.Namespace) -> int:
    """Print the claims that stored runs judge, then those that need a run."""
    papers: dict[str, Rules] = {}
    for paper in arguments.papers or registry.names(registry.CLAIMS):
        if (registration := registry.registered(registry.CLAIMS, paper)) is None:
            raise UnknownOption("paper", paper, registry.names(registry.CLAIMS))
        papers[paper] = registered_rules(registration)
    judged = [row for paper, rules in papers.items() for row in claims_of(paper, rules)]
    if arguments.json:
        print_json(judged)
        return 0
    for row in judged:  # what is claimed, by which rule, from which numbers
        title = f"{row['paper']} · {row['experiment']} · {row['name'] or 'claim'}"
        table = new_table(title, Column(no_wrap=True), "")
        table.show_header = False
        for key in ("claim", "source", "verdict", "size", "evidence", "n", "rule", "command"):
            name = {"evidence": "numbers", "size": "decides"}.get(key, key)
            table.add_row(name, row[key] or "–")
        say(table)
        say("")
    ours = [row for row in judged if row["source"].startswith(OURS)]
    for name, rows in (("claims", [r for r in judged if r not in ours]), ("our questions", ours)):
        counts = verdict_counts(row["verdict"] for row in rows)
        words = ", ".join(f"{count} {verdict}" for verdict, count in counts)
        if rows:
            say(f"{name} ({len(rows)}): {words}")
    return 0


def claims_of(paper: str, rules: Rules) -> Iterator[dict[str, Any]]:
    """Yield the claims of a paper, experiment by experiment, with `KEYS`.

    A claim that is judged under every reading, by the experiment `<paper>_claims`, is yielded from
    there alone, and a sentence once, from the first experiment that judges it, which has all its
    conditions. Where a condition has no run, it names the command that runs its experiment.
    """
    known = set[str]()
    judged: dict[str, set[str]] = {}  # rule → identities of the conditions of its experiments
    experiments = dict.fromkeys(name for rule in rules.values() for name in rule.experiments)
    of_readings = f"{paper}_claims"
    for experiment in sorted(experiments, key=lambda name: name != of_readings):
        (expanded,) = compose.expand([f"experiment={experiment}"])
        ids = {condition.id for _, condition in expanded.conditions}
        own = [
            rule.name
            for rule in rules.values()
            if experiment == of_readings or of_readings not in rule.experiments
            if not ids <= judged.get(rule.name, set())
        ]
        try:
            request = request_of(expanded, [])
            results = request.results(outputs_root())
            if len(results.with_data) < len(results.conditions):
                raise NothingStored(experiment)  # of all conditions: claims compare them
            claims = page_of(results, request.settings).claims
            rows = [
                (c.name, c.text, c.source, c.rule, c.evidence, str(c.size or "–"), c.n, c.verdict)
                for c in claims
                if c.name in own or c.name not in rules
            ]
            command = f"evoexp report {experiment}"
            for name in own:
                if experiment in rules[name].experiments:
                    judged.setdefault(name, set()).update(ids)
        except NothingStored:
            waiting = [r.about() for r in rules.values() if experiment in r.experiments]
            rows = [
                (r.name, r.claim, r.source, r.text, "–", "–", "0", "not run")
                for r in waiting
                if r.name in own
            ]
            command = f"evoexp run experiment={experiment}"
        for row in rows:
            if row[1] in known:
                continue
            known.add(row[1])
            yield dict(zip(KEYS, (paper, *row, experiment, command), strict=True))
