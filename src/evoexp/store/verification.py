"""Re-checks stored runs: every log as a whole and in its place, and the files beside the logs.

Reads only. A link of a log's chain cannot be computed again from the log, which does not hold what
entered it: `reproduce` does that by running the replicate again. Solutions can be evaluated again:
by whoever knows planners, see `check_logs`.
"""

import hashlib
import math
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import pyarrow.parquet as pq

from evoexp.attachments import PREFIX
from evoexp.errors import CorruptLog, EvoexpError, StoreError
from evoexp.records import ReplicateSummary
from evoexp.store.busy_runs import is_being_written
from evoexp.store.damage import MAX_NAMED, checked_summary, is_set_aside, reason
from evoexp.store.files import is_temporary
from evoexp.store.identity import CONFIG, MANIFEST, REPLICATES
from evoexp.store.log_reader import LogContents, read_log
from evoexp.store.mending import damaged_files
from evoexp.store.messages import TERM
from evoexp.store.plans import PLANS
from evoexp.store.run_context import ORIGIN, run_context
from evoexp.store.run_directory import RunDirectory, open_run
from evoexp.store.summaries import BASE, altered_rows, table_damage

_KNOWN = {CONFIG, MANIFEST, PLANS, REPLICATES, PREFIX.strip("/"), "summary.parquet", ".lock"}
DELETE = "; delete it, then run again"
# what a summary repeats of the last generation
_REPEATED = ("best_cost", "evaluations", "collision_queries", "solved")


class LogCheck(NamedTuple):
    """A log that was looked at.

    Attributes:
        name: Of its file.
        problem: What is wrong with it, in one line; empty if nothing is.
        summary: Its own; None where it cannot be read.
        unevaluated: Why its solutions could not be evaluated; empty if they were, or if something
            is wrong with the log.
    """

    name: str
    problem: str
    summary: ReplicateSummary | None
    unevaluated: str = ""


# yields the contradictions of a log that its solutions show
Evaluation = Callable[[Path, LogContents], Iterator[str]]


class RunCheck(NamedTuple):
    """A stored run without its logs.

    Attributes:
        name: Of its directory.
        run: None where nothing in the directory knows its condition.
        problems: File → what is wrong with it.
        leftovers: Files that are no part of a run: temporary, set aside earlier, unknown.
    """

    name: str
    run: RunDirectory | None
    problems: dict[str, str]
    leftovers: list[str]


def check_run(outputs: Path, name: str) -> RunCheck:
    """Look at a stored run's files, but for its logs.

    Args:
        outputs: Root of all outputs.
        name: Of the run's directory.
    """
    try:
        return _check_files(outputs, name)
    except OSError as error:
        problem = f"{error.filename}: {error.strerror}; change its permissions"
        return RunCheck(name, None, {"cannot be read": problem}, [])


def _check_files(outputs: Path, name: str) -> RunCheck:
    path = outputs / "runs" / name
    leftovers = list(_leftovers(path))
    try:
        run = open_run(outputs, name)
        problems = damaged_files(run)
    except StoreError as error:
        return RunCheck(name, None, {CONFIG: reason(path / CONFIG, error)}, leftovers)
    if (lost := _lost(run)) and not is_being_written(run):
        problems[REPLICATES] = lost
    if damage := table_damage(run):
        problems["summary.parquet"] = damage
    for replicate in sorted(run.failed()):
        try:
            run.failure(replicate)
        except StoreError as error:
            failure = run.failure_path(replicate)
            problems[failure.name] = reason(failure, error)
    return RunCheck(name, run, problems, leftovers)


def _lost(run: RunDirectory) -> str:
    """Tell which replicates were asked for and left neither log nor failure; empty: none."""
    try:
        asked = max((plan.num_replicates for plan in run.plans()), default=0)
    except StoreError:
        return ""
    there = {k for k in run.completed() | run.failed() if k < asked}
    if len(there) >= asked:
        return ""
    first = list(islice((k for k in range(asked) if k not in there), MAX_NAMED))
    more = f" and {asked - len(there) - len(first)} more" if asked - len(there) > len(first) else ""
    return (
        f"missing: {', '.join(map(str, first))}{more} of {asked} replicates that were asked for "
        "(gone, or not run yet)"
    )


def check_logs(
    paths: list[Path], condition_id: str, evaluate: Evaluation | None = None
) -> list[LogCheck]:
    """Look at logs of a run, each as a whole.

    Args:
        paths: Of the logs; their names tell their replicates.
        condition_id: Of the run, 64 hex digits.
        evaluate: Evaluates the solutions of a log that is whole; it raises `EvoexpError` where it
            cannot.
    """
    return [_check_log(path, condition_id, evaluate) for path in paths]


def _check_log(path: Path, condition_id: str, evaluate: Evaluation | None) -> LogCheck:
    summary, problem, unevaluated = None, "", ""
    try:
        log = read_log(path)
        summary = log.summary
        log.arrays()  # each is one
        problem = next(_contradictions(log, condition_id, int(path.stem)), "")
        if not problem and evaluate is not None:
            try:
                problem = next((f"altered: {each}" for each in evaluate(path, log)), "")
            except EvoexpError as error:
                unevaluated = reason(path, error)
    except CorruptLog as error:
        problem = reason(path, error)
    if problem and _seems_whole(path, condition_id):
        problem += DELETE  # forged: `run` does not see it
    return LogCheck(path.name, problem, summary, unevaluated)


def _seems_whole(path: Path, condition_id: str) -> bool:
    try:
        checked_summary(path, condition_id, int(path.stem))
    except CorruptLog:
        return False
    return True


def check_rows(run: RunDirectory, logs: list[LogCheck]) -> dict[str, str]:
    """Return file → problem where rows of the summary table do not repeat their logs."""
    whole = {log.name: log.summary for log in logs if log.summary and not log.problem}
    names = altered_rows(run, whole)
    if not names:
        columns = _altered_settings(run)
        told = f"altered: {columns[0]} is not the setting{DELETE}" if columns else ""
        return {"summary.parquet": told} if told else {}
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return {"summary.parquet": f"altered: it does not repeat {names[0]}{more}{DELETE}"}


def _altered_settings(run: RunDirectory) -> list[str]:
    """Return the columns of `summary.parquet` that do not repeat a setting of the run.

    What the manifest says of the origin may have changed since, and is not looked at.
    """
    try:
        run.check()
    except StoreError:  # whose settings nothing tells
        return []
    if not run.summary_path.exists() or table_damage(run):
        return []
    with pq.ParquetFile(run.summary_path) as file:
        table = file.read(use_threads=False)
    known = {field.name for field in BASE}
    measured = [name for name in table.column_names if name in known or name.startswith(TERM)]
    return [
        name
        for name, value in run_context(run.path, run.condition_id, measured).items()
        if name in table.column_names
        and name not in ORIGIN
        and set(table[name].to_pylist()) - {value}
    ]


def _contradictions(log: LogContents, condition_id: str, replicate: int) -> Iterator[str]:
    """Yield the contradictions of a log whose checksums are right, to its place and in itself."""
    if (log.condition_id, log.replicate) != (condition_id, replicate):
        theirs = f"replicate {log.replicate} of {log.condition_id[:12]}"
        yield f"holds {theirs}, which does not belong here"
    if hashlib.sha256(log.config_json).hexdigest() != log.condition_id:
        yield "altered: its configuration does not have the hash of its condition"
    for name, content in log.attachments.items():
        if name.startswith(PREFIX) and name != PREFIX + hashlib.sha256(content).hexdigest():
            yield f"altered: the attachment {name[:20]}… does not have the hash that is its name"
    indices = [row.index for row in log.generations]
    if indices != sorted(set(indices)) or not indices:
        yield "altered: its generations do not follow each other"
    elif indices[-1] != log.summary.num_generations:
        yield "altered: its summary tells another number of generations"
    else:
        last = log.generations[-1]
        for name in _REPEATED:
            if repr(getattr(last, name)) != repr(getattr(log.summary, name)):
                yield f"altered: {name} of its summary is not that of its last generation"
    missing = _improved(log) - {solution.generation for solution in log.solutions}
    if missing:
        yield f"altered: no solution of generation {min(missing)}, whose best cost is a better one"
    if not log.solutions or repr(log.solutions[-1].cost) != repr(log.summary.best_cost):
        yield "altered: its last solution does not have the best cost"


def _improved(log: LogContents) -> set[int]:
    """Return the generations in which the best cost improved, the first one included."""
    best, improved = math.inf, {row.index for row in log.generations[:1]}
    for row in log.generations:
        if row.best_cost < best:
            best = row.best_cost
            improved.add(row.index)
    return improved


def _leftovers(path: Path) -> Iterator[str]:
    """Yield the files of a run directory that are no part of a run."""
    for each in sorted(path.iterdir()):
        if each.name not in _KNOWN:
            yield _named(each.name)
    replicates = path / REPLICATES
    for each in sorted(replicates.iterdir()) if replicates.is_dir() else ():
        if not RunDirectory.is_own(each.name):
            yield _named(f"{REPLICATES}/{each.name}")


def _named(name: str) -> str:
    if is_set_aside(name):
        return f"{name} (set aside earlier)"
    return f"{name} ({'temporary' if is_temporary(name) else 'unknown'})"
