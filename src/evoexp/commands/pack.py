"""`evoexp pack`: stored runs as one file, which other commands accept elsewhere.

`report` and `compare` take its runs into the store; `show`, `list`, `diff`, `verify` and
`reproduce` only look into it.
"""

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from evoexp.commands.arguments import is_override
from evoexp.commands.console import say
from evoexp.commands.stored_runs import stored_run
from evoexp.errors import NothingStored, UnknownHash, printable
from evoexp.store.archive import pack, take_in
from evoexp.store.run_directory import RunDirectory, outputs_root

ENDING = ".tar"
NAMED = 3  # runs whose hashes the name of an archive spells out


def main(arguments: argparse.Namespace) -> int:
    """Write the archive."""
    runs = {run.condition_id: run for run in map(stored_run, arguments.hashes)}
    for run in runs.values():
        if not run.completed():
            raise NothingStored(f"run {run.hash12}: no finished replicate to pack")
    names = [run.hash12 for run in runs.values()]
    more = f"+{len(names) - NAMED}" if len(names) > NAMED else ""
    path = arguments.output or Path("+".join(names[:NAMED]) + more + ENDING)
    path.parent.mkdir(parents=True, exist_ok=True)
    count = pack(list(runs.values()), path)
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


@contextmanager
def looked_into(path: Path, prefix: str = "") -> Iterator[list[RunDirectory]]:
    """Give the runs of an archive, or the one that a prefix begins, while the body runs.

    The store stays as it is.
    """
    with tempfile.TemporaryDirectory(prefix="evoexp-", ignore_cleanup_errors=True) as folder:
        runs = [taken.run for taken in take_in(path, Path(folder))]
        chosen = [run for run in runs if run.condition_id.startswith(prefix.lower())]
        if prefix and len(chosen) != 1:
            held = ", ".join(run.hash12 for run in runs[:NAMED])
            more = f", … {len(runs) - NAMED} more" if len(runs) > NAMED else ""
            raise UnknownHash(
                f"hash: '{prefix}' must begin one run of {printable(str(path))}, begins "
                f"{len(chosen)} (holds: {held}{more})"
            )
        yield chosen


def unpacked(words: Sequence[str]) -> list[str]:
    """Take archives among words into the store; return the hashes of their runs in their place."""
    found: list[str] = []
    for word in words:
        if not is_archive(word):
            found.append(word)
            continue
        for taken in take_in(Path(word), outputs_root()):
            found.append(taken.run.condition_id)
            say(
                f"{printable(word)}: run {taken.run.hash12}: {taken.added} replicates added to "
                f"{outputs_root()}, {taken.kept} there already"
            )
    return found
