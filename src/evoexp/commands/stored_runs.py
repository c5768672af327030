"""Stored runs as commands name them: by a prefix of a hash."""

from pathlib import Path

from evoexp import shipped
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import options
from evoexp.errors import AmbiguousHash, EvoexpError, NothingStored, UnknownHash
from evoexp.shipped import Shipped
from evoexp.store.run_directory import RunDirectory, open_run, outputs_root, resolve, run_names

MAX_LISTED = 8  # candidates in an error; `evoexp list` shows all


def stored_runs(outputs: Path) -> list[tuple[str, RunDirectory | EvoexpError]]:
    """Return all stored runs by name; in place of a damaged one, its error."""
    runs: list[tuple[str, RunDirectory | EvoexpError]] = []
    for name in run_names(outputs):
        try:
            runs.append((name, open_run(outputs, name)))
        except EvoexpError as error:
            runs.append((name, error))
    return runs


def stored_run(prefix: str) -> RunDirectory:
    """Return the stored run whose hash begins with a prefix.

    Raises:
        NothingStored: If it is that of a shipped condition which was not run here.
        UnknownHash: If there is none; lists those that there are.
        AmbiguousHash: If there are several.
    """
    run = stored_or_shipped(prefix)
    if isinstance(run, RunDirectory):
        return run
    raise NothingStored(f"condition {run.condition_id[:12]}: not run here; run it: {run.command}")


def stored_or_shipped(prefix: str) -> RunDirectory | Shipped:
    """Return the stored run, or else the shipped condition, whose hash begins with a prefix.

    Raises:
        UnknownHash: If there is neither; lists the stored runs.
        AmbiguousHash: If there are several.
    """
    try:
        return resolve(outputs_root(), prefix)
    except UnknownHash as error:
        rows = shipped.find(prefix)
        if len(rows) > 1:
            raise AmbiguousHash(prefix, [row.condition_id[:12] for row in rows]) from None
        if not rows:
            if prefix in options("experiment"):
                hint = f"did you mean 'experiment={prefix}'?"
                raise UnknownHash(f"{error}; {hint}") from None
            names = run_names(outputs_root())
            more = f", … {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
            stored = ", ".join(names[:MAX_LISTED]) + more if names else "none"
            hint = f"no shipped condition either (stored: {stored}; see: evoexp list)"
            raise UnknownHash(f"{error}; {hint}") from None
        return rows[0]


def shipped_experiment(row: Shipped) -> Experiment:
    """Return the experiment of a shipped condition, with this condition alone."""
    from evoexp.configuration import compose  # Hydra and Pinocchio, which `list` does not need

    words = [f"experiment={row.experiment}", f"budget={row.budget}"]
    return compose.expand(words, only=[row.label])[0]
