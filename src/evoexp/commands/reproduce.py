"""`evoexp reproduce`: run replicates again and say MATCH, or the first generation that differs."""

import argparse
import itertools
from collections.abc import Sequence
from pathlib import Path

from evoexp.batch import reproduction
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import Comparison, fingerprint, reproduce_log, reproduce_stored
from evoexp.batch.workers import Workers, in_order, num_cores
from evoexp.commands import stored_runs
from evoexp.commands.console import coloured, hash_column, new_table, right, say
from evoexp.errors import NothingStored, RevisionMismatch, UnknownHash, printable
from evoexp.shipped import Shipped
from evoexp.store.run_directory import RunDirectory, outputs_root

FEW = 8  # replicates below this are run here, without worker processes


def main(arguments: argparse.Namespace) -> int:
    """Compare; exit code 1 if anything diverges, 2 if there is nothing to compare."""
    path = Path(arguments.what)
    if packed := stored_runs.in_archive(arguments.what):
        with stored_runs.looked_into(*packed) as runs:
            rows = [row for run in runs for row in _of_run(run, arguments.replicate)]
        code = _report(rows)
        told = f"{printable(str(packed[0]))}: its logs were compared in place; nothing was"
        say(f"{told} added to {outputs_root()}")
        return code
    if path.suffix == ".mcap" or path.is_file():
        return _report([reproduce_log(path)])
    try:
        run = stored_runs.stored_or_shipped(arguments.what)
    except UnknownHash as error:
        raise UnknownHash(f"NOTHING TO COMPARE: {error}") from None
    if not isinstance(run, RunDirectory):
        return _without_stored_run(run, arguments.replicate)
    return _report(_of_run(run, arguments.replicate))


def _of_run(run: RunDirectory, replicate: int | None) -> list[Comparison]:
    try:
        if replicate is not None:
            return _compare_all(run, [stored_runs.finished_replicate(run, replicate)])
        if not run.completed():
            raise NothingStored(f"run {run.hash12}: no finished replicate to compare with")
        return _compare_all(run, sorted(run.completed()))
    except RevisionMismatch as error:
        text = f"run {run.hash12}: {error}; its results cannot be compared."
        remedy = f"Run it anew with what is installed: {run.command}"
        raise RevisionMismatch(f"{text} {remedy}") from None


def _compare_all(run: RunDirectory, replicates: Sequence[int]) -> list[Comparison]:
    tasks = [(run.log_path(k), run.condition_id, k) for k in replicates]
    if len(tasks) <= FEW:
        return list(itertools.starmap(reproduce_stored, tasks))
    with Workers(num_cores()) as workers:
        first = reproduce_stored(*tasks[0])  # it compiles, before any worker does
        return [first, *in_order(workers, reproduce_stored, tasks[1:])]


def _report(rows: Sequence[Comparison]) -> int:
    numbers = right("replicate", "generations")
    table = new_table("", hash_column("run"), *numbers, "verdict")
    for row in rows:
        verdict = coloured(row.verdict, "green" if row.matches else "red")
        generations = str(row.num_generations or "–")
        table.add_row(row.condition_id[:12], str(row.replicate), generations, verdict)
    say(table)
    compared = [row for row in rows if not row.damage]
    diverging = [row for row in compared if not row.matches]
    if diverging:
        lines = diverging[0].environment or ("none: the environment is the same",)
        say("\n".join(["differences of environment:", *(f"  {line}" for line in lines)]))
    damaged = len(rows) - len(compared)
    lost = f", {damaged} damaged" if damaged else ""
    say(f"{len(compared) - len(diverging)} of {len(rows)} MATCH{lost}")
    return 1 if diverging or damaged else 0


def _without_stored_run(row: Shipped, replicate: int | None) -> int:
    """Compare replicate 0 of a shipped condition, which was never run here, with the table."""
    if replicate not in (None, 0):
        raise UnknownHash(
            f"NOTHING TO COMPARE: replicate {replicate} of {row.condition_id[:12]} is neither "
            f"stored in {outputs_root()} nor in the shipped table, which holds replicate 0"
        )
    condition = stored_runs.shipped_experiment(row).conditions[0].condition
    summary = run_replicate(condition, 0).summary
    is_same = reproduction.same_fingerprint(fingerprint(condition, summary), row.digest)
    matches = is_same and condition.id == row.condition_id
    verdict = coloured("MATCH", "green") if matches else coloured("DIVERGES", "red")
    say(f"{row.condition_id[:12]} replicate 0 against the shipped table:", verdict)
    say(f"({row.experiment}, {row.label}, budget {row.budget}; store it: {row.command})")
    return 0 if matches else 1
