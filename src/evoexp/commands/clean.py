"""`evoexp clean`: files that no command needs, named and, if told so, deleted."""

import argparse
import contextlib
import itertools
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from evoexp.commands.console import new_table, print_json, right, say
from evoexp.condition import revisions
from evoexp.errors import Busy, StoreError, UnknownOption
from evoexp.store.files import is_set_aside, is_temporary
from evoexp.store.identity import CONFIG, REPLICATES, read
from evoexp.store.run_directory import RunDirectory, outputs_root, run_names

SHOWN = 20


class Waste(NamedTuple):
    """A file or folder that no command needs: what `--json` prints."""

    kind: str  # why, one of `KINDS`
    path: Path
    bytes: int  # with everything in it [B]


KEYS = Waste._fields
KINDS = ("temporary", "damaged", "failed", "old_revision", "empty")
USUAL = ("temporary", "damaged", "empty")


def main(arguments: argparse.Namespace) -> int:
    """List, and delete if told so."""
    kinds = list(dict.fromkeys(arguments.kinds)) or list(USUAL)
    for kind in kinds:
        if kind not in (*KINDS, "all"):
            raise UnknownOption("kind", kind, [*KINDS, "all"])
    wanted = set(KINDS) if "all" in kinds else set(kinds)
    outputs = outputs_root()
    found = [each for each in waste(outputs) if each.kind in wanted]
    if arguments.json:
        print_json([each._asdict() for each in found])
    else:
        _print(found, outputs)
    if arguments.yes:
        _delete(found, outputs)
    return 0


def waste(outputs: Path) -> Iterator[Waste]:
    """Yield everything that no command needs, run by run; nothing is deleted."""
    runs = outputs / "runs"
    for path in sorted(runs.iterdir()) if runs.is_dir() else ():
        if path.is_dir() and path.name not in run_names(outputs):
            others = [each for each in path.rglob("*") if each.is_file() and each.name != ".lock"]
            if all(is_temporary(each.name) for each in others):
                yield Waste("empty", path, _size(path))
            continue
        with contextlib.suppress(StoreError, ValueError, TypeError):  # of what is damaged
            config = json.loads(read(path / CONFIG))
            if any(stored != installed for _, stored, installed in revisions(config)):
                yield Waste("old_revision", path, _size(path))
                continue
        for folder in (path, path / REPLICATES):
            for each in sorted(folder.iterdir()) if folder.is_dir() else ():
                kinds = {
                    "temporary": is_temporary(each.name),
                    "damaged": is_set_aside(each.name),
                    "failed": each.name.endswith(".failed.json"),
                }
                if kind := next((kind for kind, is_own in kinds.items() if is_own), ""):
                    yield Waste(kind, each, _size(each))


def _size(path: Path) -> int:
    if path.is_dir() and not path.is_symlink():
        return sum(each.lstat().st_size for each in path.rglob("*") if not each.is_dir())
    return path.lstat().st_size


def _print(found: list[Waste], outputs: Path) -> None:
    if not found:
        say(f"{outputs}: nothing to delete")
        return
    shown = ((w.kind, str(w.path.relative_to(outputs)), f"{w.bytes / 1000:.0f}") for w in found)
    say(new_table("", "kind", "file", *right("kB"), rows=itertools.islice(shown, SHOWN)))
    more = f" ({len(found) - SHOWN} more than shown)" if len(found) > SHOWN else ""
    size = sum(each.bytes for each in found) / 1e6
    say(f"{len(found)} files or folders{more}, {size:.2f} MB")


def _delete(found: list[Waste], outputs: Path) -> None:
    """Delete, run by run; a run that another process writes is left alone."""
    deleted = 0
    for each in found:
        name = each.path.relative_to(outputs / "runs").parts[0]
        lock = RunDirectory(outputs, name + "0" * (64 - len(name))).lock()
        try:
            with lock:
                if each.path.is_dir() and not each.path.is_symlink():
                    shutil.rmtree(each.path)
                else:
                    each.path.unlink(missing_ok=True)
                deleted += 1
        except Busy:
            say(f"run {name}: another process is writing it now; left alone")
    say(f"deleted: {deleted}")
