"""Archives of stored runs: one tar file that another store takes in.

An archive holds `runs/<hash12>/…` as a store does, so `tar` can read it, too. The same runs give
the same bytes. Nothing of an archive is trusted: names are matched, sizes are limited, every log is
checked against its place before it is taken in.
"""

import hashlib
import io
import os
import re
import tarfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from evoexp.attachments import PREFIX
from evoexp.errors import CorruptLog, EvoexpError, printable
from evoexp.input_files import MAX_INPUT
from evoexp.store.container import MAX_LOG
from evoexp.store.damage import checked_summary
from evoexp.store.files import write_files
from evoexp.store.identity import CONFIG, MANIFEST, REPLICATES
from evoexp.store.plans import PLANS
from evoexp.store.run_directory import HASH_LENGTH, RunDirectory

MOST_FILES = 2_000_000  # of an archive
MOST_AT_ONCE = 64  # logs that are taken in together
_HASH = f"[0-9a-f]{{{HASH_LENGTH}}}"
_BESIDE = re.compile(rf"runs/({_HASH})/({CONFIG}|{MANIFEST}|{PLANS}|{PREFIX}[0-9a-f]{{64}})")
_LOG = re.compile(rf"runs/({_HASH})/{REPLICATES}/((?:[1-9][0-9]*)?[0-9]{{4}})\.mcap")


class ArchiveError(EvoexpError):
    """A file that is no archive of runs, or a damaged one."""


class TakenRun(NamedTuple):
    """A run of an archive after it was taken into a store.

    Attributes:
        run: In the store.
        added: Replicates that were not there before.
        kept: Replicates that were there already, and stay as they are.
    """

    run: RunDirectory
    added: int
    kept: int


def pack(runs: Sequence[RunDirectory], path: Path) -> int:
    """Write runs to an archive; return the number of its logs.

    Summary tables, failures and whatever is no part of a run stay behind.

    Args:
        runs: The runs; they are only read.
        path: Of the archive; it is replaced as a whole.

    Raises:
        StoreError: If a run is damaged beyond its logs.
    """
    count = 0
    partial = path.with_name(f".{path.name}.tmp")
    try:
        with tarfile.open(partial, "w", format=tarfile.PAX_FORMAT) as archive:
            for run in sorted(runs, key=lambda each: each.condition_id):
                run.config_json()  # checked, with the files that it refers to
                root = f"runs/{run.hash12}/"
                beside = [run.path / name for name in (CONFIG, MANIFEST, PLANS)]
                beside += sorted((run.path / PREFIX).glob("[0-9a-f]*"))
                for each in beside:
                    if each.is_file():
                        _add(archive, root + str(each.relative_to(run.path)), each.read_bytes())
                for replicate in sorted(run.completed()):
                    log = run.log_path(replicate)
                    checked_summary(log, run.condition_id, replicate)
                    _add(archive, f"{root}{REPLICATES}/{log.name}", log.read_bytes())
                    count += 1
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    return count


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    entry = tarfile.TarInfo(name)  # time 0, no owner: the same runs give the same bytes
    entry.size, entry.mode = len(content), 0o644
    archive.addfile(entry, io.BytesIO(content))


def take_in(path: Path, outputs: Path) -> list[TakenRun]:
    """Take the runs of an archive into a store; replicates that are there already stay.

    Args:
        path: Of the archive.
        outputs: Root of the store.

    Raises:
        ArchiveError: If it is no archive of runs, or damaged; what came before the damage is taken.
        Busy: If another process writes one of the runs.
    """
    found: dict[str, _Arrival] = {}
    for name, content in _entries(path):
        if match := _BESIDE.fullmatch(name):
            hash12, rest = match.groups()
            arrival = found.get(hash12)
            if arrival is None:
                if rest != CONFIG:
                    raise ArchiveError(f"{_shown(path)}: damaged: {name} comes before {CONFIG}")
                found[hash12] = _Arrival(path, outputs, hash12, content)
            else:
                arrival.beside[rest] = content
        elif match := _LOG.fullmatch(name):
            arrival = found.get(match[1])
            if arrival is None:
                raise ArchiveError(f"{_shown(path)}: damaged: {name} comes before {CONFIG}")
            arrival.add(int(match[2]), content)
        else:
            raise ArchiveError(f"{_shown(path)}: no archive of runs: holds '{printable(name)}'")
    if not found:
        raise ArchiveError(f"{_shown(path)}: no archive of runs: it is empty")
    return [arrival.finish() for arrival in found.values()]


class _Arrival:
    """One run of an archive on its way into a store."""

    def __init__(self, path: Path, outputs: Path, hash12: str, config_json: bytes) -> None:
        condition_id = hashlib.sha256(config_json).hexdigest()
        if condition_id[:HASH_LENGTH] != hash12:
            raise ArchiveError(
                f"{_shown(path)}: damaged: {CONFIG} of run {hash12} has another hash"
            )
        self.run = RunDirectory(outputs, condition_id)
        self.beside: dict[str, bytes] = {}
        self._path, self._config = path, config_json
        self._waiting: dict[int, bytes] = {}
        self._added = self._kept = 0
        self._begun = False

    def add(self, replicate: int, content: bytes) -> None:
        """Take a log in, later and with others."""
        self._begin()
        if replicate in self.run.completed():
            self._kept += 1
            return
        self._waiting[replicate] = content
        if len(self._waiting) >= MOST_AT_ONCE:
            self._write()

    def finish(self) -> TakenRun:
        """Write the logs that wait."""
        self._begin()
        self._write()
        return TakenRun(self.run, self._added, self._kept)

    def _begin(self) -> None:
        """Write configuration and the files beside it, where they are not there."""
        if self._begun:
            return
        self._begun = True
        files = {}
        for name, content in self.beside.items():
            if name.startswith(PREFIX):
                if name != PREFIX + hashlib.sha256(content).hexdigest():
                    text = f"{name[:30]}… does not have the hash that is its name"
                    raise ArchiveError(f"{_shown(self._path)}: damaged: {text}")
                files[self.run.path / name] = content
        files |= {
            self.run.path / name: self.beside[name]
            for name in (MANIFEST, PLANS)
            if name in self.beside
        }
        files[self.run.path / CONFIG] = self._config
        with self.run.lock():
            self.run.replicates.mkdir(parents=True, exist_ok=True)
            new = {place: content for place, content in files.items() if not place.exists()}
            for place in new:
                place.parent.mkdir(exist_ok=True)
            write_files(new)
            self.run.check()

    def _write(self) -> None:
        """Write logs that wait, each checked in a temporary place first."""
        if not self._waiting:
            return
        logs, self._waiting = self._waiting, {}
        with self.run.lock():
            for replicate, content in logs.items():
                trial = self.run.replicates / f".{replicate:04d}.mcap.arriving.tmp"
                trial.write_bytes(content)
                try:
                    checked_summary(trial, self.run.condition_id, replicate)
                except CorruptLog as error:
                    reason = str(error).removeprefix(f"{trial}: ")
                    name = f"{self.run.hash12}, replicate {replicate}"
                    raise ArchiveError(f"{_shown(self._path)}: damaged: {name}: {reason}") from None
                finally:
                    trial.unlink(missing_ok=True)
            self.run.write_logs(logs)
        self._added += len(logs)


def _entries(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of the files of an archive, one by one."""
    try:
        _check_end(path)
        with tarfile.open(path, "r:") as archive:
            for count, entry in enumerate(archive):
                if not entry.isfile() or count >= MOST_FILES:
                    what = "more files than an archive has" if entry.isfile() else "no regular file"
                    raise ArchiveError(f"{_shown(path)}: no archive of runs: {what}")
                limit = MAX_LOG if entry.name.endswith(".mcap") else MAX_INPUT
                if entry.size > limit:
                    raise ArchiveError(f"{_shown(path)}: no archive of runs: a file is too large")
                content = archive.extractfile(entry)
                assert content is not None
                data = content.read()
                if len(data) != entry.size:
                    raise ArchiveError(f"{_shown(path)}: damaged: it is cut off")
                yield entry.name, data
    except tarfile.TarError as error:
        raise ArchiveError(f"{_shown(path)}: no archive of runs ({error})") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ArchiveError(f"{_shown(path)}: cannot be read ({reason})") from None


def _check_end(path: Path) -> None:
    """Raise where a file does not end as archives do: with two empty blocks."""
    end = 2 * tarfile.BLOCKSIZE
    with open(path, "rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(size - end, 0))
        if size < end or any(file.read(end)):
            raise ArchiveError(
                f"{_shown(path)}: no archive of runs, or a damaged one: it is cut off"
            )


def _shown(path: Path) -> str:
    return printable(str(path))
