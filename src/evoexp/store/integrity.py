"""The integrity of stored runs: damaged files are found, set aside, and written or run again.

A log is checked against its place when it is first seen: its checksums, its condition, its
replicate. `summary.parquet` then notes its size and time, and it is not decoded again as long as
both are the same. `run`, and whoever reads the logs anyway, compares all checksums besides; `list`
and `show` do not. `verify` re-checks every log as a whole and in its place, and the files beside
the logs; it reads only. Mending is for who holds the lock; no reading command renames anything.

A link of a log's chain cannot be computed again from the log, which does not hold what entered it:
`reproduce` does that by running the replicate again. Solutions can be evaluated again: by whoever
knows planners, see `check_log`.
"""

import hashlib
import math
import os
from collections.abc import Callable, Collection, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from evoexp.attachments import PREFIX
from evoexp.errors import CorruptLog, EvoexpError, OtherVersion, StoreError
from evoexp.records import ReplicateSummary
from evoexp.store.files import (
    MAX_NAMED,
    is_set_aside,
    is_temporary,
    listed,
    reason,
    set_aside,
    warn,
)
from evoexp.store.identity import (
    CONFIG,
    MANIFEST,
    PLANS,
    REPLICATES,
    DamagedFile,
    checked_manifest,
    lost_files,
    read,
)
from evoexp.store.log_reader import LogContents, checked_summary, read_log, read_summary
from evoexp.store.run_directory import RunDirectory, is_stored, open_run
from evoexp.store.summaries import (
    altered,
    damaged_logs,
    replicate_of,
    table_damage,
    whole_logs,
)

_KNOWN = {CONFIG, MANIFEST, PLANS, REPLICATES, PREFIX.strip("/"), "summary.parquet", ".lock"}
DELETE = "; delete it, then run again"
# what a summary repeats of the last generation
_REPEATED = ("best_cost", "evaluations", "collision_queries", "solved")


class LogCheck(NamedTuple):
    """A log that was looked at."""

    name: str  # of its file
    problem: str  # what is wrong with it, in one line; empty if nothing is
    summary: ReplicateSummary | None  # its own; None where it cannot be read
    # why its solutions could not be evaluated; empty if they were, or if something is wrong with
    # the log
    unevaluated: str = ""


# yields the contradictions of a log that its solutions show
Evaluation = Callable[[Path, LogContents], Iterator[str]]


class RunCheck(NamedTuple):
    """A stored run without its logs."""

    name: str  # of its directory
    run: RunDirectory | None  # none where nothing in the directory knows its condition
    problems: dict[str, str]  # file → what is wrong with it
    leftovers: list[str]  # files that are no part of a run: temporary, set aside earlier, unknown


def check_run(outputs: Path, name: str) -> RunCheck:
    """Look at a stored run's files, but for its logs."""
    path = outputs / "runs" / name
    try:
        leftovers = list(_leftovers(path))
        run = open_run(outputs, name)
        problems = damaged_files(run)
    except StoreError as error:
        return RunCheck(name, None, {CONFIG: reason(path / CONFIG, error)}, leftovers)
    except OSError as error:
        problem = f"{error.filename}: {error.strerror}; change its permissions"
        return RunCheck(name, None, {"cannot be read": problem}, [])
    if (lost := _lost(run)) and not run.is_being_written():
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
    asked = run.num_asked()
    there = {k for k in run.completed() | run.failed() if k < asked}
    if len(there) >= asked:
        return ""
    first = list(islice((k for k in range(asked) if k not in there), MAX_NAMED))
    more = f" and {asked - len(there) - len(first)} more" if asked - len(there) > len(first) else ""
    return (
        f"missing: {', '.join(map(str, first))}{more} of {asked} replicates that were asked for "
        "(gone, or not run yet)"
    )


def check_log(path: Path, condition_id: str, evaluate: Evaluation) -> LogCheck:
    """Look at a log of a run as a whole; the name of its file tells its replicate.

    Args:
        condition_id: Of the run, 64 hex digits.
        evaluate: Evaluates the solutions of a log that is whole; it raises `EvoexpError` where it
            cannot.
    """
    summary, problem, unevaluated = None, "", ""
    try:
        log = read_log(path)
        summary = log.summary
        log.arrays()  # each is one
        problem = next(_contradictions(log, condition_id, int(path.stem)), "")
        if not problem:
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
    problem = altered(run, whole)
    return {"summary.parquet": problem + DELETE} if problem else {}


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


def damaged_files(run: RunDirectory, config_json: bytes | None = None) -> dict[str, str]:
    """Return name → what is wrong with it, of the files of a run beside its logs.

    Args:
        config_json: The canonical form of its condition; None: as it is stored.

    Raises:
        StoreError: The directory holds another condition, which shares the first twelve digits.
    """
    if not is_stored(run.path):
        return {}
    found: dict[str, str] = {}
    if run.replicates.exists() and not run.replicates.is_dir():
        found[REPLICATES] = "damaged: not a directory"
    try:
        run.check()
        config_json = config_json or read(run.path / CONFIG)
    except DamagedFile as error:
        found[CONFIG] = reason(run.path / CONFIG, error)
        config_json = config_json or b""
    found |= {
        str(path.relative_to(run.path)): why for path, why in lost_files(run.path, config_json)
    }
    try:
        checked_manifest(run.path, run.condition_id)
    except DamagedFile as error:
        if os.path.lexists(run.path / MANIFEST) or run.completed():
            found[MANIFEST] = reason(run.path / MANIFEST, error)
    try:
        run.plans()
    except DamagedFile as error:
        found[PLANS] = reason(run.path / PLANS, error)
    return found


def needs_mending(run: RunDirectory, config_json: bytes) -> bool:
    """Return whether anything of a run is damaged, as far as `damaged_logs` looks."""
    return bool(damaged_files(run, config_json) or damaged_logs(run))


def mend(run: RunDirectory, config_json: bytes, again: Collection[int]) -> None:
    """Set aside every damaged file of a run, and say so in a line.

    The caller holds the run's lock, and writes configuration and manifest again.

    Args:
        config_json: The canonical form of its condition.
        again: Replicates that run again if their log is damaged.

    Raises:
        StoreError: A log is of another version of evoexp, and not damaged.
    """
    if files := damaged_files(run, config_json):
        _set_aside(run, files, "written again")
    if logs := damaged_logs(run):
        for name in logs:
            if _is_of_another_version(run.replicates / name):
                raise StoreError(f"run {run.hash12}: {run.replicates / name}: {logs[name]}")
        prefix = f"{run.replicates.name}/"
        for then, is_again in (("run again", True), ("set aside: never asked for", False)):
            some = {name for name in logs if (replicate_of(name) in again) is is_again}
            if some:
                _set_aside(run, {prefix + n: why for n, why in logs.items() if n in some}, then)


def lost_replicates(run: RunDirectory) -> set[int]:
    """Return the replicates that were asked for once and whose log is damaged.

    Others, which somebody put there, are set aside and not run again.
    """
    asked = run.num_asked()
    return {replicate for replicate in run.completed() - whole_logs(run) if replicate < asked}


def _set_aside(run: RunDirectory, files: dict[str, str], then: str) -> None:
    there = [run.path / name for name in files if os.path.lexists(run.path / name)]
    names = [set_aside(path).name for path in there]
    kept = f"; kept as {', '.join(names[:2])}{', …' if len(names) > 2 else ''}" if names else ""
    shown = {Path(name).name: why for name, why in files.items()}
    warn(f"run {run.hash12}: damaged, and {then}: {listed(shown)}{kept}")


def _is_of_another_version(path: Path) -> bool:
    """Return whether a log cannot be read because another version of evoexp wrote it."""
    try:
        read_summary(path)
    except CorruptLog as error:
        return isinstance(error, OtherVersion)
    return False
