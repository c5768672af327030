"""`evoexp report --all`: every report that follows from the outputs, then the home page."""

import argparse
import contextlib
import functools
import io
import shlex
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

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

BUDGETS = ("paper", "smoke")  # those of the other budgets have the same hashes as one of them


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
        for budget in BUDGETS:
            if not _may_be_stored(outputs, name, budget):
                continue
            words = [f"experiment={name}", *([f"budget={budget}"] if budget != "paper" else [])]
            (experiment,) = expansions.expand(words)
            ids = [condition.id for _, condition in experiment.conditions]
            if experiment.report_name not in seen and _is_stored(outputs, ids):
                seen.add(experiment.report_name)
                yield Planned(experiment.report_name, draft_of(experiment, words).files)
    for each in summaries(outputs / "reports"):
        if each.folder not in seen:
            yield Planned(each.folder, functools.partial(_again, each.folder, each.command))


def _may_be_stored(outputs: Path, name: str, budget: str) -> bool:
    """Return whether an experiment has to be composed to see if it is stored: others take long."""
    rows = [row for row in shipped() if row.experiment == name]
    return not rows or _is_stored(
        outputs, [row.condition_id for row in rows if row.budget == budget]
    )


def _is_stored(outputs: Path, ids: Sequence[str]) -> bool:
    runs = (RunDirectory(outputs, each) for each in ids)
    return any(run.completed() or run.failed() for run in runs)


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
