"""Mends runs: damaged files are set aside, so that they are written or run again.

Only for who holds the lock; reading commands never rename anything.
"""

import os
from collections.abc import Collection
from pathlib import Path

from evoexp.errors import StoreError
from evoexp.store.damage import is_of_another_version, listed, reason, set_aside, warn
from evoexp.store.identity import (
    CONFIG,
    MANIFEST,
    REPLICATES,
    DamagedFile,
    checked_manifest,
    lost_files,
    read,
)
from evoexp.store.plans import PLANS
from evoexp.store.run_directory import RunDirectory, is_stored
from evoexp.store.summaries import damaged_logs, replicate_of, whole_logs


def damaged_files(run: RunDirectory, config_json: bytes | None = None) -> dict[str, str]:
    """Return name → what is wrong with it, of the files of a run beside its logs.

    Args:
        run: Whose.
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
        run: Whose.
        config_json: The canonical form of its condition.
        again: Replicates that run again if their log is damaged.

    Raises:
        StoreError: A log is of another version of evoexp, and not damaged.
    """
    if files := damaged_files(run, config_json):
        _set_aside(run, files, "written again")
    if logs := damaged_logs(run):
        for name in logs:
            if is_of_another_version(run.replicates / name):
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
    try:
        asked = max((plan.num_replicates for plan in run.plans()), default=0)
    except DamagedFile:
        asked = 0
    whole = whole_logs(run)
    return {replicate for replicate in run.completed() - whole if replicate < asked}


def _set_aside(run: RunDirectory, files: dict[str, str], then: str) -> None:
    names = [set_aside(path).name for path in _present(run.path, files)]
    kept = f"; kept as {', '.join(names[:2])}{', …' if len(names) > 2 else ''}" if names else ""
    shown = {Path(name).name: why for name, why in files.items()}
    warn(f"run {run.hash12}: damaged, and {then}: {listed(shown)}{kept}")


def _present(folder: Path, names: dict[str, str]) -> list[Path]:
    return [folder / name for name in names if os.path.lexists(folder / name)]
