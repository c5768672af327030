"""`evoexp verify`, whether a store is whole; `evoexp clean`, which deletes what nobody needs."""

import argparse
import contextlib
import itertools
import json
import shutil
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from evoexp import shipped
from evoexp.batch.workers import Workers, in_order, num_cores
from evoexp.commands.console import hash_column, new_table, plain_console, print_json, right, say
from evoexp.commands.stored_runs import in_archive, looked_into, stored_run
from evoexp.condition import revisions
from evoexp.errors import Busy, StoreError, UnknownOption, printable
from evoexp.store.files import first_of, is_set_aside, is_temporary
from evoexp.store.identity import CONFIG, REPLICATES, read
from evoexp.store.integrity import DELETE, LogCheck, RunCheck, check_log, check_run
from evoexp.store.run_directory import COMMAND, RunDirectory, outputs_root, run_names
from evoexp.store.summaries import altered

LARGE = 8_000_000  # [B] of logs from which on worker processes check them
MANY = 200  # logs, likewise: their solutions are evaluated
SHOWN = 4  # problems of a run
RUN_KEYS = [name for name in RunCheck._fields if name != "run"]


def verify(arguments: argparse.Namespace) -> int:
    """Check; exit code 1 if anything is damaged. Nothing is written."""
    outputs = outputs_root()
    archives = {word: packed for word in arguments.hashes if (packed := in_archive(word))}
    names: list[str] = []
    for prefix in arguments.hashes:  # whatever is damaged in the run
        if prefix not in archives:
            known = [name for name in run_names(outputs) if name.startswith(prefix.lower() or "-")]
            names += known if len(known) == 1 else [stored_run(prefix).hash12]
    if not arguments.hashes:
        names = run_names(outputs)
    with plain_console().status("checking logs"):
        found = _checked_runs([check_run(outputs, name) for name in dict.fromkeys(names)])
        for packed in archives.values():
            with looked_into(*packed) as runs:
                checks = [check_run(run.path.parents[1], run.hash12) for run in runs]
                # no command mends an archive
                found += [each._replace(mend="") for each in _checked_runs(checks)]
    places = [str(outputs)] * bool(names) + [printable(word) for word in archives]
    damaged = [run for run in found if run.problems]
    if arguments.json:
        print_json([{name: getattr(run, name) for name in RUN_KEYS} for run in found])
        return 1 if damaged else 0
    if damaged:
        title = f"damaged runs in {', '.join(places)}"
        table = new_table(title, hash_column("run"), *right("logs"), "damaged files")
        for run in damaged:
            lines = [f"{name}: {problem}" for name, problem in run.problems.items()]
            table.add_row(run.hash, str(run.logs), "\n".join(first_of(lines, SHOWN)))
        say(table)
        for mend in dict.fromkeys(run.mend for run in damaged if run.mend):
            say(f"mend: {mend}")
    for run in found:
        if run.leftovers:
            say(f"not part of run {run.hash}: {', '.join(first_of(run.leftovers, SHOWN))}")
        if run.unevaluated:
            say(f"run {run.hash}: its solutions were not evaluated: {run.unevaluated}")
    logs, problems = sum(r.logs for r in found), sum(len(r.problems) for r in found)
    found_in = f"{problems} damaged file{'s' * (problems > 1)} in {len(damaged)} of them"
    say(f"{len(found)} runs, {logs} logs: {found_in if damaged else 'all is well'}")
    return 1 if damaged else 0


def _checked_runs(runs: Sequence[RunCheck]) -> list[RunCheck]:
    """Check the logs of runs, too; worker processes check large stores."""
    stored = [(check.run, k) for check in runs if check.run for k in sorted(check.run.completed())]
    tasks = [(run.log_path(k), run.condition_id) for run, k in stored]
    if len(tasks) >= MANY or sum(path.lstat().st_size for path, _ in tasks) >= LARGE:
        with Workers(min(num_cores(), len(tasks))) as workers:
            checks = in_order(workers, _check, tasks)
    else:
        checks = list(itertools.starmap(_check, tasks))
    logs = defaultdict[str, list[LogCheck]](list)
    for (run, _), check in zip(stored, checks, strict=True):
        logs[run.hash12].append(check)
    return [_checked(each, logs[each.hash]) for each in runs]


def _check(path: Path, condition_id: str) -> LogCheck:
    from evoexp.batch.reproduction import contradictions  # planners, which take long to load

    return check_log(path, condition_id, contradictions)


def _checked(check: RunCheck, logs: list[LogCheck]) -> RunCheck:
    """Return a run with the problems of its logs, and the command that mends it, if one does."""
    run, mend = check.run, ""
    problems = check.problems | {log.name: log.problem for log in logs if log.problem}
    if run is not None:
        whole = {log.name: log.summary for log in logs if log.summary and not log.problem}
        if problem := altered(run, whole):
            problems["summary.parquet"] = problem + DELETE
    if problems and (run or CONFIG in problems):  # else nothing of it can be read
        mend = run.command if run else COMMAND
        if mend == COMMAND and (rows := shipped.find(check.hash)):
            mend = rows[0].command
    unevaluated = next((log.unevaluated for log in logs if log.unevaluated), "")
    return check._replace(problems=problems, logs=len(logs), mend=mend, unevaluated=unevaluated)


MOST_LISTED = 20


class Waste(NamedTuple):
    """A file or folder that no command needs: what `--json` prints."""

    kind: str  # why, one of `KINDS`
    path: Path
    bytes: int  # with everything in it [B]


KEYS = Waste._fields
KINDS = ("temporary", "damaged", "failed", "old_revision", "empty")
USUAL = ("temporary", "damaged", "empty")


def clean(arguments: argparse.Namespace) -> int:
    """List, and delete if told so."""
    kinds = list(dict.fromkeys(arguments.kinds)) or list(USUAL)
    for kind in kinds:
        if kind not in (*KINDS, "all"):
            raise UnknownOption("kind", kind, [*KINDS, "all"])
    wanted = set(KINDS) if "all" in kinds else set(kinds)
    outputs = outputs_root()
    found = [each for each in waste(outputs) if each.kind in wanted]
    if arguments.json:
        print_json([each._asdict() for each in found])
    else:
        _print_waste(found, outputs)
    if arguments.yes:
        _delete(found, outputs)
    return 0


def waste(outputs: Path) -> Iterator[Waste]:
    """Yield everything that no command needs, run by run; nothing is deleted."""
    runs = outputs / "runs"
    for path in sorted(runs.iterdir()) if runs.is_dir() else ():
        if path.is_dir() and path.name not in run_names(outputs):
            others = [each for each in path.rglob("*") if each.is_file() and each.name != ".lock"]
            if all(is_temporary(each.name) for each in others):
                yield Waste("empty", path, _size(path))
            continue
        with contextlib.suppress(StoreError, ValueError, TypeError):  # of what is damaged
            config = json.loads(read(path / CONFIG))
            if any(stored != installed for _, stored, installed in revisions(config)):
                yield Waste("old_revision", path, _size(path))
                continue
        for folder in (path, path / REPLICATES):
            for each in sorted(folder.iterdir()) if folder.is_dir() else ():
                if is_temporary(each.name):
                    yield Waste("temporary", each, _size(each))
                elif is_set_aside(each.name):
                    yield Waste("damaged", each, _size(each))
                elif each.name.endswith(".failed.json"):
                    yield Waste("failed", each, _size(each))


def _size(path: Path) -> int:
    if path.is_dir() and not path.is_symlink():
        return sum(each.lstat().st_size for each in path.rglob("*") if not each.is_dir())
    return path.lstat().st_size


def _print_waste(found: list[Waste], outputs: Path) -> None:
    if not found:
        say(f"{outputs}: nothing to delete")
        return
    shown = ((w.kind, str(w.path.relative_to(outputs)), f"{w.bytes / 1000:.0f}") for w in found)
    say(new_table("", "kind", "file", *right("kB"), rows=itertools.islice(shown, MOST_LISTED)))
    more = f" ({len(found) - MOST_LISTED} more than shown)" if len(found) > MOST_LISTED else ""
    size = sum(each.bytes for each in found) / 1e6
    say(f"{len(found)} files or folders{more}, {size:.2f} MB")


def _delete(found: list[Waste], outputs: Path) -> None:
    """Delete, run by run; a run that another process writes is left alone."""
    deleted = 0
    for each in found:
        name = each.path.relative_to(outputs / "runs").parts[0]
        lock = RunDirectory(outputs, name + "0" * (64 - len(name))).lock()
        try:
            with lock:
                if each.path.is_dir() and not each.path.is_symlink():
                    shutil.rmtree(each.path)
                else:
                    each.path.unlink(missing_ok=True)
                deleted += 1
        except Busy:
            say(f"run {name}: another process is writing it now; left alone")
    say(f"deleted: {deleted}")
