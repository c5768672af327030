"""`evoexp verify`: whether a store is whole, and the commands that mend it."""

import argparse
import itertools
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from evoexp import shipped
from evoexp.batch.workers import Workers, in_order, num_cores
from evoexp.commands.console import hash_column, new_table, plain_console, print_json, right, say
from evoexp.commands.stored_runs import in_archive, looked_into, stored_run
from evoexp.errors import printable
from evoexp.store.identity import CONFIG
from evoexp.store.integrity import DELETE, LogCheck, RunCheck, check_log, check_run
from evoexp.store.run_directory import COMMAND, outputs_root, run_names
from evoexp.store.summaries import altered

LARGE = 8_000_000  # [B] of logs from which on worker processes check them
MANY = 200  # logs, likewise: their solutions are evaluated
SHOWN = 4  # problems of a run
RUN_KEYS = [name for name in RunCheck._fields if name != "run"]


def main(arguments: argparse.Namespace) -> int:
    """Check; exit code 1 if anything is damaged. Nothing is written."""
    outputs = outputs_root()
    archives = {word: packed for word in arguments.hashes if (packed := in_archive(word))}
    names: list[str] = []
    for prefix in arguments.hashes:  # whatever is damaged in the run
        if prefix not in archives:
            own = [name for name in run_names(outputs) if name.startswith(prefix.lower() or "-")]
            names += own if len(own) == 1 else [stored_run(prefix).hash12]
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
            rest = [f"… {len(lines) - SHOWN} more"] if lines[SHOWN:] else []
            table.add_row(run.hash, str(run.logs), "\n".join(lines[:SHOWN] + rest))
        say(table)
        for mend in dict.fromkeys(run.mend for run in damaged if run.mend):
            say(f"mend: {mend}")
    for run in found:
        if run.leftovers:
            listed = ", ".join(run.leftovers[:SHOWN])
            more = f", … {len(run.leftovers) - SHOWN} more" if run.leftovers[SHOWN:] else ""
            say(f"no part of run {run.hash}: {listed}{more}")
        if run.unevaluated:
            say(f"run {run.hash}: its solutions were not evaluated: {run.unevaluated}")
    logs, problems = sum(r.logs for r in found), sum(len(r.problems) for r in found)
    found_in = f"{problems} damaged file{'s' * (problems > 1)} in {len(damaged)} of them"
    say(f"{len(found)} runs, {logs} logs: {found_in if damaged else 'all is well'}")
    return 1 if damaged else 0


def _checked_runs(checks: Sequence[RunCheck]) -> list[RunCheck]:
    logs_of = _all_logs(checks)
    return [_checked(each, logs_of[each.hash]) for each in checks]


def _all_logs(runs: Sequence[RunCheck]) -> dict[str, list[LogCheck]]:
    """Return the checks of every run's logs by its hash; worker processes check large stores."""
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
    return logs


def _check(path: Path, condition_id: str) -> LogCheck:
    from evoexp.batch.reproduction import contradictions  # planners, which take long to load

    return check_log(path, condition_id, contradictions)


def _checked(found: RunCheck, logs: list[LogCheck]) -> RunCheck:
    """Return a run with the problems of its logs, and the command that mends it, if one does."""
    problems = found.problems | {log.name: log.problem for log in logs if log.problem}
    mend = ""
    if found.run is not None:
        whole = {log.name: log.summary for log in logs if log.summary and not log.problem}
        if problem := altered(found.run, whole):
            problems["summary.parquet"] = problem + DELETE
    if problems and (found.run or CONFIG in problems):  # else nothing of it can be read
        known = found.run.command if found.run else COMMAND
        rows = shipped.find(found.hash) if known == COMMAND else []
        mend = rows[0].command if rows else known
    unevaluated = next((log.unevaluated for log in logs if log.unevaluated), "")
    return found._replace(problems=problems, logs=len(logs), mend=mend, unevaluated=unevaluated)
