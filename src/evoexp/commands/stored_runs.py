"""Stored runs as commands name them, by a prefix of a hash or in an archive; and `evoexp pack`.

`report` and `compare` take the runs of an archive into the store; `show`, `list`, `diff`, `verify`
and `reproduce` only look into it.
"""

import argparse
import contextlib
import itertools
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from evoexp import shipped
from evoexp.commands.command_parser import is_override
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import options
from evoexp.errors import AmbiguousHash, EvoexpError, NothingStored, UnknownHash, printable
from evoexp.shipped import Shipped
from evoexp.store import archive
from evoexp.store.files import first_of
from evoexp.store.run_directory import RunDirectory, open_run, outputs_root, resolve, run_names

MAX_LISTED = 8  # candidates in an error; `evoexp list` shows all
ENDING = ".tar"
NAMED = 3  # runs whose hashes the name of an archive spells out


def stored_runs(outputs: Path) -> Iterator[tuple[str, RunDirectory | EvoexpError]]:
    """Yield all stored runs with their names; in place of a damaged one, its error."""
    for name in run_names(outputs):
        try:
            yield name, open_run(outputs, name)
        except EvoexpError as error:
            yield name, error


def stored_run(prefix: str) -> RunDirectory:
    """Return the stored run whose hash begins with a prefix; refuse any other as one line."""
    run = stored_or_shipped(prefix)
    if isinstance(run, RunDirectory):
        return run
    raise NothingStored(f"condition {run.condition_id[:12]}: not run here; run it: {run.command}")


def stored_or_shipped(prefix: str) -> RunDirectory | Shipped:
    """Return the stored run, or else the shipped condition, whose hash begins with a prefix."""
    try:
        return resolve(outputs_root(), prefix)
    except UnknownHash as error:
        rows = shipped.find(prefix)
        if len(rows) == 1:
            return rows[0]
        if rows:
            raise AmbiguousHash(prefix, [row.condition_id[:12] for row in rows]) from None
        stored = ", ".join(first_of(run_names(outputs_root()), MAX_LISTED)) or "none"
        hint = f"no shipped condition either (stored: {stored}; see: evoexp list)"
        if prefix in options("experiment"):
            hint = f"did you mean 'experiment={prefix}'?"
        raise UnknownHash(f"{error}; {hint}") from None


def finished_replicate(run: RunDirectory, replicate: int) -> int:
    """Return a replicate of a run; refuse one that is not finished, and list those that are."""
    done, spans = sorted(run.completed()), list[str]()
    if replicate in done:
        return replicate
    # three and more in a row as one span: 0–1999
    for _, group in itertools.groupby(enumerate(done), lambda pair: pair[1] - pair[0]):
        row = [number for _, number in group]
        spans += [f"{row[0]}–{row[-1]}"] if len(row) > 2 else map(str, row)
    there = ", ".join(spans) or "none"
    raise NothingStored(f"run {run.hash12}: no finished replicate {replicate} (finished: {there})")


def shipped_experiment(row: Shipped) -> Experiment:
    """Return the experiment of a shipped condition, with this condition alone."""
    from evoexp.configuration import compose  # Hydra and Pinocchio, which `list` does not need

    words = [f"experiment={row.experiment}", f"budget={row.budget}"]
    return compose.expand(words, only=[row.label])[0]


# archives of runs


def pack(arguments: argparse.Namespace) -> int:
    """Write stored runs as one file, which other commands accept elsewhere."""
    from evoexp.commands.console import say  # and rich

    runs = {run.condition_id: run for run in map(stored_run, arguments.hashes)}
    for run in runs.values():
        if not run.completed():
            raise NothingStored(f"run {run.hash12}: no finished replicate to pack")
    names = [run.hash12 for run in runs.values()]
    more = f"+{len(names) - NAMED}" if len(names) > NAMED else ""
    path = arguments.output or Path("+".join(names[:NAMED]) + more + ENDING)
    path.parent.mkdir(parents=True, exist_ok=True)
    count = archive.pack(list(runs.values()), path)
    size = path.stat().st_size / 1e6
    say(
        f"{printable(str(path))}: {len(runs)} run{'s' * (len(runs) > 1)}, {count} logs, "
        f"{size:.2f} MB; elsewhere: evoexp show, reproduce or report {printable(path.name)}"
    )
    return 0


def is_archive(word: str) -> bool:
    """Return whether a word of a command is an archive of runs."""
    return word.endswith(ENDING) and not is_override(word)


def in_archive(word: str) -> tuple[Path, str] | None:
    """Return archive and prefix of a hash of a word `RUNS.tar` or `RUNS.tar:HASH`; else None."""
    head, _, prefix = word.rpartition(":")
    places = ((word, ""), (head, prefix))
    return next(((Path(path), own) for path, own in places if is_archive(path)), None)


@contextlib.contextmanager
def looked_into(path: Path, prefix: str = "") -> Iterator[list[RunDirectory]]:
    """Give the runs of an archive, or the one that a prefix begins, while the body runs.

    The store stays as it is.
    """
    with tempfile.TemporaryDirectory(prefix="evoexp-", ignore_cleanup_errors=True) as folder:
        runs = [taken.run for taken in archive.take_in(path, Path(folder))]
        chosen = [run for run in runs if run.condition_id.startswith(prefix.lower())]
        if prefix and len(chosen) != 1:
            held = ", ".join(first_of([run.hash12 for run in runs], NAMED))
            raise UnknownHash(
                f"hash: '{prefix}' must begin one run of {printable(str(path))}, begins "
                f"{len(chosen)} (holds: {held})"
            )
        yield chosen


def unpacked(words: Sequence[str]) -> list[str]:
    """Take archives among words into the store; return the hashes of their runs in their place."""
    from evoexp.commands.console import say

    names: list[str] = []
    for word in words:
        if not is_archive(word):
            names.append(word)
            continue
        for taken in archive.take_in(Path(word), outputs_root()):
            names.append(taken.run.condition_id)
            say(
                f"{printable(word)}: run {taken.run.hash12}: {taken.added} replicates added to "
                f"{outputs_root()}, {taken.kept} there already"
            )
    return names
