"""The integrity of stored runs: damaged files are found, set aside, and written or run again.

A log is checked against its place when it is first seen; see `summaries`. Mending is for who holds
the lock; no reading command renames anything. A link of a log's chain cannot be computed again from
the log: `reproduce` runs the replicate again.
"""

import contextlib
import hashlib
import itertools
import math
import os
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import NamedTuple

from evoexp.attachments import PREFIX
from evoexp.errors import CorruptLog, EvoexpError, OtherVersion, StoreError
from evoexp.records import ReplicateSummary
from evoexp.store import files
from evoexp.store.identity import CONFIG, MANIFEST, PLANS, REPLICATES
from evoexp.store.log_reader import LogContents, read_log, read_summary
from evoexp.store.run_directory import RunDirectory, open_run
from evoexp.store.summaries import damaged_logs, replicate_of, table_damage, whole_logs

_KNOWN = {CONFIG, MANIFEST, PLANS, REPLICATES, PREFIX.strip("/"), "summary.parquet", ".lock"}
DELETE = "; delete it, then run again"
# what a summary repeats of the last generation
_REPEATED = ("best_cost", "evaluations", "collision_queries", "solved")


class LogCheck(NamedTuple):
    """A log that was looked at."""

    name: str  # of its file
    problem: str  # what is wrong with it, in one line; empty if nothing is
    summary: ReplicateSummary | None  # its own; None where it cannot be read
    # why its solutions could not be evaluated; empty if they were, or the log has a problem
    unevaluated: str = ""


# yields the contradictions of a log that its solutions show
Evaluation = Callable[[Path, LogContents], Iterator[str]]


class RunCheck(NamedTuple):
    """A stored run that was looked at."""

    hash: str  # its first twelve digits
    run: RunDirectory | None  # none where nothing in the directory knows its condition
    problems: dict[str, str]  # file → what is wrong with it
    leftovers: list[str]  # files that are no part of a run: temporary, set aside earlier, unknown
    logs: int = 0  # that were looked at
    mend: str = ""  # the command that mends it; empty if nothing is wrong or no command does
    unevaluated: str = ""  # why solutions of logs could not be evaluated; empty if all were


def check_run(outputs: Path, name: str) -> RunCheck:
    """Look at a stored run's files, but for its logs."""
    path, leftovers = outputs / "runs" / name, list[str]()
    try:
        names = sorted(file.name for file in path.iterdir() if file.name not in _KNOWN)
        logs = sorted(file.name for file in (path / REPLICATES).glob("*"))
        names += [f"{REPLICATES}/{name}" for name in logs if not RunDirectory.is_own(name)]
        for other in names:
            kind = "temporary" if files.is_temporary(other) else "unknown"
            kind = "set aside earlier" if files.is_set_aside(other) else kind
            leftovers.append(f"{other} ({kind})")
        run = open_run(outputs, name)
        problems = run.damaged_files()
    except StoreError as error:
        return RunCheck(name, None, {CONFIG: files.reason(path / CONFIG, error)}, leftovers)
    except OSError as error:
        problem = f"{error.filename}: {error.strerror}; change its permissions"
        return RunCheck(name, None, {"cannot be read": problem}, [])
    # replicates that were asked for and left neither log nor failure
    asked = run.num_asked()
    there = {k for k in run.completed() | run.failed() if k < asked}
    if len(there) < asked and not run.is_being_written():
        first = list(itertools.islice((k for k in range(asked) if k not in there), files.MAX_NAMED))
        others = asked - len(there) - len(first)
        lost = ", ".join(map(str, first)) + (f" and {others} more" if others else "")
        problems[REPLICATES] = (
            f"missing: {lost} of {asked} replicates that were asked for (gone, or not run yet)"
        )
    if damage := table_damage(run):
        problems["summary.parquet"] = damage
    for replicate in sorted(run.failed()):
        try:
            run.failure(replicate)
        except StoreError as error:
            failure = run.failure_path(replicate)
            problems[failure.name] = files.reason(failure, error)
    return RunCheck(name, run, problems, leftovers)


def check_log(path: Path, condition_id: str, evaluate: Evaluation) -> LogCheck:
    """Look at a log of a run as a whole; the name of its file tells its replicate.

    Solutions of a log that is whole are evaluated; `EvoexpError` says that they cannot be.
    """
    summary, problem, unevaluated, place = None, "", "", (condition_id, int(path.stem))
    try:
        log = read_log(path, place)
        summary = log.summary
        log.arrays()  # each is one
        evaluated = (f"altered: {contradiction}" for contradiction in evaluate(path, log))
        problem = next(itertools.chain(_contradictions(log), evaluated), "")
    except CorruptLog as error:
        problem = files.reason(path, error)
    except EvoexpError as error:
        unevaluated = files.reason(path, error)
    if problem:
        with contextlib.suppress(CorruptLog):
            read_summary(path, place)
            problem += DELETE  # forged: `run` does not see it
    return LogCheck(path.name, problem, summary, unevaluated)


def _contradictions(log: LogContents) -> Iterator[str]:
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
    # the best cost improves in the first generation, too
    costs = [row.best_cost for row in log.generations]
    best_before = itertools.accumulate(costs, min, initial=math.inf)
    triples = zip(indices, costs, best_before, strict=False)
    improved = {index for index, cost, best in triples if cost < best} | set(indices[:1])
    missing = improved - {solution.generation for solution in log.solutions}
    if missing:
        yield f"altered: no solution of generation {min(missing)}, whose best cost is a better one"
    if not log.solutions or repr(log.solutions[-1].cost) != repr(log.summary.best_cost):
        yield "altered: its last solution does not have the best cost"


def mend(run: RunDirectory, config_json: bytes, again: Collection[int]) -> None:
    """Set aside every damaged file of a run, and say so in a line.

    The caller holds the run's lock, writes configuration and manifest, and runs replicates, again.
    StoreError is raised where a log is of another version of evoexp, and not damaged.
    """
    _set_aside(run, run.damaged_files(config_json), "written again")
    logs = damaged_logs(run)
    for name, why in logs.items():
        with contextlib.suppress(CorruptLog):
            try:
                read_summary(run.replicates / name)
            except OtherVersion:
                raise StoreError(f"run {run.hash12}: {run.replicates / name}: {why}") from None
    for then, is_again in (("run again", True), ("set aside: never asked for", False)):
        names = [name for name in logs if (replicate_of(name) in again) is is_again]
        _set_aside(run, {f"{REPLICATES}/{name}": logs[name] for name in names}, then)


def lost_replicates(run: RunDirectory) -> set[int]:
    """Return the replicates that were asked for and whose log is damaged; `mend` is for others."""
    asked = run.num_asked()
    return {k for k in run.completed() - whole_logs(run) if k < asked}


def _set_aside(run: RunDirectory, damaged: dict[str, str], then: str) -> None:
    if not damaged:
        return
    there = [run.path / name for name in damaged if os.path.lexists(run.path / name)]
    names = [files.set_aside(path).name for path in there]
    kept = f"; kept as {', '.join(names[:2])}{', …' if len(names) > 2 else ''}" if names else ""
    shown = {Path(name).name: why for name, why in damaged.items()}
    files.warn(f"run {run.hash12}: damaged, and {then}: {files.listed(shown)}{kept}")
