"""Archives of stored runs: one tar file that another store takes in.

An archive holds `runs/<hash12>/…` as a store does, so `tar` can read it, too. The same runs give
the same bytes. Nothing of an archive is trusted: the heads of all files are checked before anything
is read, and every log is checked against its place before it is taken in. Memory is taken for one
file, and for at most `MOST_WAITING` bytes of logs that wait.
"""

import hashlib
import io
import json
import os
import re
import tarfile
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from evoexp.attachments import PREFIX
from evoexp.errors import CorruptLog, EvoexpError, printable
from evoexp.input_files import MAX_INPUT, MEGABYTE
from evoexp.store.files import write_file, write_files
from evoexp.store.identity import CONFIG, MANIFEST, PLANS, REPLICATES, TAKEN
from evoexp.store.log_bounds import MAX_LOG
from evoexp.store.log_reader import checked_summary
from evoexp.store.run_directory import HASH_LENGTH, RunDirectory

MOST_FILES = 2_000_000  # of an archive
MOST_WAITING = 64 * MEGABYTE  # [B] of logs that are taken in together
MAX_TEXT = 8 * MEGABYTE  # [B] of a configuration, a manifest, or plans
_PIECE = MEGABYTE  # [B] that are read at once
_PLAIN = (tarfile.REGTYPE, tarfile.AREGTYPE)
_COMPRESSED = {
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"\x28\xb5\x2f\xfd": "zstd",
    b"PK\x03\x04": "zip",
}
_HASH = f"[0-9a-f]{{{HASH_LENGTH}}}"
_BESIDE = re.compile(rf"runs/({_HASH})/({CONFIG}|{MANIFEST}|{PLANS}|{PREFIX}[0-9a-f]{{64}})")
_LOG = re.compile(rf"runs/({_HASH})/{REPLICATES}/((?:[1-9][0-9]*)?[0-9]{{4}})\.mcap")


class ArchiveError(EvoexpError):
    """A file that is no archive of runs, or a damaged one."""


class TakenRun(NamedTuple):
    """A run of an archive after it was taken into a store."""

    run: RunDirectory  # in the store
    added: int  # replicates that were not there before
    kept: int  # replicates that were there already, and stay as they are


def pack(runs: Sequence[RunDirectory], path: Path) -> int:
    """Write runs to an archive; return the number of its logs.

    Summary tables, failures and whatever is no part of a run stay behind. StoreError is raised
    where a run is damaged beyond its logs.
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

    ArchiveError says that it is none, or damaged; what came before the damage is taken.
    """
    arrivals: dict[str, _Arrival] = {}
    shown = printable(str(path))
    try:
        with open(path, "rb") as file:
            for entry in list(_entries(file)):
                place = _BESIDE.fullmatch(entry.name) or _LOG.fullmatch(entry.name)
                assert place is not None, "its name was matched"
                hash12, rest = place.groups()
                content, sha256 = _content(file, entry)
                if hash12 in arrivals:
                    arrivals[hash12].add(rest, content, sha256)
                elif rest == CONFIG:
                    arrivals[hash12] = _Arrival(path, outputs, hash12, content)
                else:
                    raise ArchiveError(f"damaged: {entry.name} comes before {CONFIG}")
        if not arrivals:
            raise ArchiveError("no archive of runs: it is empty")
        return [arrival.finish() for arrival in arrivals.values()]
    except ArchiveError as error:
        raise ArchiveError(f"{shown}: {error}") from None
    except OSError as error:
        if error.filename not in (None, str(path)):  # of the store, not of the archive
            raise
        reason = (error.strerror or str(error)).lower()
        raise ArchiveError(f"{shown}: cannot be read ({reason})") from None


class _Arrival:
    """One run of an archive on its way into a store."""

    def __init__(self, path: Path, outputs: Path, hash12: str, config_json: bytes) -> None:
        condition_id = hashlib.sha256(config_json).hexdigest()
        if condition_id[:HASH_LENGTH] != hash12:
            raise ArchiveError(f"damaged: {CONFIG} of run {hash12} has another hash")
        self.run = RunDirectory(outputs, condition_id)
        self._archive, self._beside = path.name, {CONFIG: config_json}
        self._waiting: dict[int, bytes] = {}
        self._size = self._added = self._kept = 0
        self._begun = False

    def add(self, name: str, content: bytes, sha256: str) -> None:
        """Take a file in: a log later and with others, one that the configuration names at once."""
        if name.isdecimal():
            self._add_log(int(name), content)
        elif name == MANIFEST:
            try:
                notes: Any = json.loads(content)
            except (ValueError, RecursionError):
                notes = None
            if not isinstance(notes, dict):
                text = f"damaged: {MANIFEST} of run {self.run.hash12} is no JSON object"
                raise ArchiveError(text)
            marked = notes | {TAKEN: printable(self._archive.replace("\n", " "))}
            self._beside[name] = json.dumps(marked, indent=2, sort_keys=True).encode() + b"\n"
        elif name == PLANS:
            self._beside[name] = content
        elif name != PREFIX + sha256 or sha256.encode() not in self._beside[CONFIG]:
            what = "does not have the hash that is its name, or its run does not refer to it"
            raise ArchiveError(f"damaged: {name[:30]}… {what}")
        elif not (place := self.run.path / name).exists():
            with self.run.lock():
                place.parent.mkdir(exist_ok=True)
                write_file(place, content)

    def _add_log(self, replicate: int, content: bytes) -> None:
        self._begin()
        if replicate in self.run.completed():
            self._kept += 1
            return
        try:
            checked_summary(content, self.run.condition_id, replicate)
        except CorruptLog as error:
            name = f"{self.run.hash12}, replicate {replicate}"
            raise ArchiveError(f"damaged: {name}: {error}") from None
        self._waiting[replicate] = content
        self._size += len(content)
        if self._size >= MOST_WAITING:
            self._write()

    def finish(self) -> TakenRun:
        """Write the logs that wait."""
        self._begin()
        self._write()
        return TakenRun(self.run, self._added, self._kept)

    def _begin(self) -> None:
        """Write configuration, manifest and plans, where they are not there."""
        if self._begun:
            return
        self._begun = True
        files = {self.run.path / name: content for name, content in self._beside.items()}
        with self.run.lock():
            self.run.replicates.mkdir(parents=True, exist_ok=True)
            write_files({place: each for place, each in files.items() if not place.exists()})
            self.run.check()

    def _write(self) -> None:
        if self._waiting:
            with self.run.lock():
                self.run.write_logs(self._waiting)
        self._added += len(self._waiting)
        self._waiting, self._size = {}, 0


def _entries(file: BinaryIO) -> Iterator[tarfile.TarInfo]:
    """Yield the files of an archive by their heads alone; each is plain, and wholly there.

    `tarfile` itself follows links, extended heads and sparse files of any size.
    """
    end, names = file.seek(0, os.SEEK_END), set[str]()
    file.seek(0)
    begin = file.read(max(map(len, _COMPRESSED)))
    if kind := next((kind for sign, kind in _COMPRESSED.items() if begin.startswith(sign)), ""):
        raise ArchiveError(f"no archive of runs: compressed ({kind}); unpack it")
    start = 0
    while start + 2 * tarfile.BLOCKSIZE <= end:
        file.seek(start)
        head = file.read(tarfile.BLOCKSIZE)
        if not any(head):
            if any(file.read(tarfile.BLOCKSIZE)):
                break
            return
        try:
            entry = tarfile.TarInfo.frombuf(head, "utf-8", "backslashreplace")
        except tarfile.TarError as error:
            raise ArchiveError(f"no archive of runs ({error})") from None
        if fault := _fault(entry, names):
            raise ArchiveError(f"no archive of runs: {fault}")
        names.add(entry.name)
        entry.offset_data = start + tarfile.BLOCKSIZE
        yield entry
        start = entry.offset_data + -(-entry.size // tarfile.BLOCKSIZE) * tarfile.BLOCKSIZE
    raise ArchiveError("no archive of runs, or a damaged one: it is cut off")


def _fault(entry: tarfile.TarInfo, names: Collection[str]) -> str:
    """Return why the head of a file, behind others of these names, is not taken; empty: it is."""
    if entry.type not in _PLAIN:
        return f"no regular file, '{printable(entry.name)}' is of kind {entry.type!r}"
    is_text = entry.name.endswith((CONFIG, MANIFEST, PLANS))
    limit = MAX_LOG if entry.name.endswith(".mcap") else MAX_TEXT if is_text else MAX_INPUT
    if not 0 <= entry.size <= limit:
        return "a file is too large"
    if not _BESIDE.fullmatch(entry.name) and not _LOG.fullmatch(entry.name):
        text = printable(entry.name.replace("\n", "\\n"))
        return f"holds '{text}'"
    if entry.name in names:
        return f"holds {entry.name} twice"
    return "too many files" if len(names) >= MOST_FILES else ""


def _content(file: BinaryIO, entry: tarfile.TarInfo) -> tuple[bytes, str]:
    """Return the content of a file of an archive, and its SHA-256, computed as it arrives."""
    pieces, digest, rest = [], hashlib.sha256(), entry.size
    file.seek(entry.offset_data)
    while rest and (piece := file.read(min(rest, _PIECE))):
        digest.update(piece)
        pieces.append(piece)
        rest -= len(piece)
    return b"".join(pieces), digest.hexdigest()
