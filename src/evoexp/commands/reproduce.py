"""`evoexp reproduce`: run replicates again and say MATCH, or the first generation that differs."""

import argparse
import contextlib
import itertools
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from evoexp import shipped
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import (
    Comparison,
    DamagedLog,
    fingerprint,
    reproduce_log,
    reproduce_stored,
    same_fingerprint,
)
from evoexp.batch.workers import Workers, in_order, num_cores
from evoexp.commands.console import (
    add_columns,
    add_hash_column,
    coloured,
    new_table,
    plain_console,
)
from evoexp.commands.hashes import with_candidates
from evoexp.commands.pack import in_archive, looked_into
from evoexp.configuration import expansions
from evoexp.errors import (
    AmbiguousHash,
    NothingStored,
    RevisionMismatch,
    UnknownHash,
    printable,
)
from evoexp.store.run_directory import RunDirectory, outputs_root, resolve

FEW = 8  # replicates below this are run here, without worker processes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument(
        "what",
        metavar="HASH|LOG.mcap|RUNS.tar[:HASH]",
        help="any unique prefix of a run's hash, a replicate's log, or an archive of runs, which "
        "is looked into and not taken into the store",
    )
    parser.add_argument("--replicate", type=int, metavar="K", help="only this replicate of the run")


def main(arguments: argparse.Namespace) -> int:
    """Compare; exit code 1 if anything diverges, 2 if there is nothing to compare."""
    console = plain_console()
    path = Path(arguments.what)
    if packed := in_archive(arguments.what):
        with looked_into(*packed) as runs:
            rows = [row for run in runs for row in _of_run(run, arguments.replicate)]
        code = _report(console, rows)
        console.print(
            f"{printable(str(packed[0]))}: its logs were compared where they are; nothing was "
            f"taken into {outputs_root()}",
            soft_wrap=True,
        )
        return code
    if path.suffix == ".mcap" or path.is_file():
        return _report(console, [reproduce_log(path)])
    try:
        run = resolve(outputs_root(), arguments.what)
    except UnknownHash as error:
        return _without_stored_run(console, arguments.what, arguments.replicate, error)
    return _report(console, _of_run(run, arguments.replicate))


def _of_run(run: RunDirectory, replicate: int | None) -> list[Comparison | DamagedLog]:
    """Run the finished replicates of a run again, or one of them."""
    try:
        return _compare_all(run, _replicates(run, replicate))
    except RevisionMismatch as error:
        text = (
            f"run {run.hash12}: {error}; its results cannot be compared. Run it anew with what is "
            f"installed: {run.command}"
        )
        raise RevisionMismatch(text) from None


def _replicates(run: RunDirectory, replicate: int | None) -> list[int]:
    done = sorted(run.completed())
    if replicate is not None and replicate not in done:
        there = ", ".join(_spans(done)) or "none"
        raise NothingStored(
            f"run {run.hash12}: no finished replicate {replicate} (finished: {there})"
        )
    if not done:
        raise NothingStored(f"run {run.hash12}: no finished replicate to compare with")
    return [replicate] if replicate is not None else done


def _spans(numbers: Sequence[int]) -> Iterator[str]:
    """Yield ascending numbers as text, three and more in a row as one span: 0–1999."""
    for _, group in itertools.groupby(enumerate(numbers), lambda pair: pair[1] - pair[0]):
        row = [number for _, number in group]
        yield from (f"{row[0]}–{row[-1]}",) if len(row) > 2 else map(str, row)


def _compare_all(run: RunDirectory, replicates: Sequence[int]) -> list[Comparison | DamagedLog]:
    waiting = deque((run.log_path(k), run.condition_id, k) for k in replicates)
    compared: list[Comparison | DamagedLog] = []
    with contextlib.ExitStack() as stack:
        workers = stack.enter_context(Workers(num_cores())) if len(waiting) > FEW else None
        # the first one compiles, before any worker does
        while waiting and not any(isinstance(each, Comparison) for each in compared):
            compared.append(reproduce_stored(*waiting.popleft()))
        if workers is None:
            return compared + [reproduce_stored(*each) for each in waiting]
        return [*compared, *in_order(workers, reproduce_stored, waiting)]


def _report(console: Console, rows: Sequence[Comparison | DamagedLog]) -> int:
    table = new_table()
    add_hash_column(table, "run")
    add_columns(table, "replicate", "generations", right=True)
    add_columns(table, "verdict")
    for row in rows:
        if isinstance(row, DamagedLog):
            verdict, generations = coloured(f"damaged: {row.reason}", "red"), "–"
        else:
            verdict = coloured(row.verdict, "green" if row.matches else "red")
            generations = str(row.num_generations)
        table.add_row(row.condition_id[:12], str(row.replicate), generations, verdict)
    console.print(table)
    compared = [row for row in rows if isinstance(row, Comparison)]
    diverging = [row for row in compared if not row.matches]
    if diverging:
        lines = diverging[0].environment or ("none: the environment is the same",)
        console.print(
            "differences of environment:",
            *(f"  {line}" for line in lines),
            sep="\n",
            soft_wrap=True,
        )
    damaged = len(rows) - len(compared)
    lost = f", {damaged} damaged" if damaged else ""
    console.print(f"{len(compared) - len(diverging)} of {len(rows)} MATCH{lost}")
    return 1 if diverging or damaged else 0


def _without_stored_run(
    console: Console, prefix: str, replicate: int | None, error: UnknownHash
) -> int:
    """Compare replicate 0 of a shipped condition with the shipped table.

    Nothing was ever run here.
    """
    found = shipped.find(prefix)
    if len(found) > 1:
        raise AmbiguousHash(prefix, [row.condition_id[:12] for row in found])
    if not found:
        raise UnknownHash(f"NOTHING TO COMPARE: {with_candidates(error, outputs_root())}")
    if replicate not in (None, 0):
        where = (
            f"is neither stored in {outputs_root()} nor in the shipped table, which holds "
            "replicate 0"
        )
        raise UnknownHash(f"NOTHING TO COMPARE: replicate {replicate} of {prefix} {where}")
    row = found[0]
    experiment = expansions.expand(
        [f"experiment={row.experiment}", f"budget={row.budget}"], only=[row.label]
    )[0]
    condition = experiment.conditions[0].condition
    summary = run_replicate(condition, 0).summary
    matches = (
        same_fingerprint(fingerprint(condition, summary), row.digest)
        and condition.id == row.condition_id
    )
    verdict = Text("MATCH", "green") if matches else Text("DIVERGES", "red")
    console.print(f"{row.condition_id[:12]} replicate 0 against the shipped table:", verdict)
    console.print(
        f"({row.experiment}, {row.label}, budget {row.budget}; store it: {row.command})",
        soft_wrap=True,
    )
    return 0 if matches else 1
