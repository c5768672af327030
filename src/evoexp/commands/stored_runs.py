"""Stored runs as commands name them: by a prefix of a hash."""

import itertools
from collections.abc import Iterator
from pathlib import Path

from evoexp import shipped
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import options
from evoexp.errors import AmbiguousHash, EvoexpError, NothingStored, UnknownHash
from evoexp.shipped import Shipped
from evoexp.store.run_directory import RunDirectory, open_run, outputs_root, resolve, run_names

MAX_LISTED = 8  # candidates in an error; `evoexp list` shows all


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
        names = run_names(outputs_root())
        more = f", … {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
        stored = ", ".join(names[:MAX_LISTED]) + more if names else "none"
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
