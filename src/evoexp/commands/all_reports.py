"""`evoexp report --all`: every report that follows from the outputs, then the home page."""

import argparse
import contextlib
import functools
import io
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

from evoexp.commands import compare
from evoexp.commands.command_parser import command_parser
from evoexp.commands.drafts import check_reports, draft_of, drafts
from evoexp.commands.site import home_files, write_site
from evoexp.configuration import expansions
from evoexp.configuration.search_path import options, searched_first
from evoexp.errors import EvoexpError, NothingStored, SettingError, StoreError
from evoexp.report import build
from evoexp.report.home_page import summaries
from evoexp.shipped import shipped
from evoexp.store.run_directory import RunDirectory, outputs_root


class Planned(NamedTuple):
    """A report to be drawn: the name of its folder, and the function that draws it."""

    folder: str
    draw: Callable[[], build.ReportFiles]


def report_all(arguments: argparse.Namespace, console: Console) -> int:
    """Draw all reports and the home page, or check them.

    Raises:
        SettingError: If words are given, too.
        NothingStored: If nothing is stored.
    """
    given = [*arguments.overrides, *arguments.only, *(["-m"] if arguments.multirun else [])]
    if given:
        raise SettingError("--all", "given alone", " ".join(given))
    failed: list[str] = []
    found = _drawn(list(planned_reports(outputs_root())), failed, console)
    if arguments.check:
        code = check_reports(_with_home(found), console, others=len(failed))
        return 1 if failed else code
    for report in found:
        console.print(f"report: {build.write_report(report)}", soft_wrap=True)
    write_site(console)
    return 1 if failed else 0


def _with_home(found: Iterator[build.ReportFiles]) -> Iterator[build.ReportFiles]:
    yield from found
    yield home_files()


def _drawn(
    reports: Sequence[Planned], failed: list[str], console: Console
) -> Iterator[build.ReportFiles]:
    """Draw reports one after the other; those that cannot be drawn are named, and left as they are.

    Raises:
        NothingStored: If there is none.
    """
    if not reports:
        raise NothingStored(
            f"report: no experiment is stored in {outputs_root()}, and no report; see: evoexp list"
        )
    for folder, draw in reports:
        try:
            drawn = draw()
            if drawn.directory.name != folder:
                raise StoreError(f"its command draws {drawn.directory.name}")
        except (EvoexpError, OSError) as error:
            failed.append(folder)
            console.print(f"cannot be drawn: {folder}: {error}", soft_wrap=True)
            continue
        yield drawn


def planned_reports(outputs: Path) -> Iterator[Planned]:
    """Yield the reports of all experiments that are stored, then the others that are there."""
    seen = set()
    for name in options("experiment"):
        for budget in _budgets(outputs, name):
            folder, words = name, [f"experiment={name}"]
            if budget != "paper":
                folder, words = f"{name}@{budget}", [*words, f"budget={budget}"]
            seen.add(folder)
            yield Planned(folder, functools.partial(_of_experiment, words))
    for each in summaries(outputs / "reports"):
        if each.folder not in seen:
            yield Planned(each.folder, functools.partial(_again, each.folder, each.command))


def _of_experiment(words: Sequence[str]) -> build.ReportFiles:
    (experiment,) = expansions.expand(words)
    return draft_of(experiment, words).files()


def _budgets(outputs: Path, name: str) -> Iterator[str]:
    """Yield the budgets at which an experiment was run.

    It began one of its runs, or all of them are there: experiments share conditions, so one of
    them alone does not mean that all were asked for.
    """
    for budget in ("paper", "smoke"):
        ids = _ids(name, budget)
        begun = _begun(outputs, ids)
        own = [run for run in begun if _notes(run).get("experiment") == name]
        if own or (begun and len(begun) == len(ids)):
            is_quick = budget == "paper" and _is_quick(name, own or begun)
            yield "quick" if is_quick else budget


def _ids(name: str, budget: str) -> set[str]:
    """Return the hashes of an experiment's conditions; one that is not shipped is composed."""
    rows = [row for row in shipped() if row.experiment == name]
    if rows:
        return {row.condition_id for row in rows if row.budget == budget}
    (experiment,) = expansions.expand([f"experiment={name}", f"budget={budget}"])
    return {condition.id for _, condition in experiment.conditions}


def _is_quick(name: str, begun: Sequence[RunDirectory]) -> bool:
    """Return whether runs, whose hashes are those of the paper's budget, are of `quick`."""
    commands = [_words(str(_notes(run).get("command", ""))) for run in begun]
    if not all("budget=quick" in words for words in commands):
        return False
    (quick,) = expansions.expand([f"experiment={name}", "budget=quick"])
    return all(len(run.completed()) <= quick.num_replicates for run in begun)


def _begun(outputs: Path, ids: Iterable[str]) -> list[RunDirectory]:
    """Return the runs that have a finished or failed replicate."""
    runs = (RunDirectory(outputs, each) for each in ids)
    return [run for run in runs if run.completed() or run.failed()]


def _notes(run: RunDirectory) -> dict[str, Any]:
    """Return the notes on a run's origin; none if they are damaged."""
    with contextlib.suppress(EvoexpError):
        return run.manifest()
    return {}


def _again(folder: str, command: str) -> build.ReportFiles:
    """Draw a report by the command that its page names; nothing is written.

    Raises:
        StoreError: If it names no command that draws a report.
        EvoexpError: If that cannot be done any more.
    """
    name, *words = _words(command)
    if name not in ("report", "compare"):
        raise StoreError(f"{folder}: names no command that draws it")
    arguments = _parsed(name, words)
    with searched_first(arguments.config_dir):
        if name == "compare":
            return compare.drawn(arguments).files
        found = [] if arguments.all else drafts(arguments)
        if len(found) != 1:
            raise StoreError(f"{folder}: names no command that draws it alone")
        return found[0].files()


def _words(command: str) -> list[str]:
    try:
        return shlex.split(command) or [""]
    except ValueError:
        return [""]


def _parsed(name: str, words: Sequence[str]) -> argparse.Namespace:
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint), contextlib.redirect_stdout(complaint):
            return command_parser(name).parse_intermixed_args(words)
    except SystemExit as error:
        raise StoreError(complaint.getvalue().strip().removeprefix("evoexp: ")) from error
