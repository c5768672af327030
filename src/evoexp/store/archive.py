"""Archives of stored runs: one tar file that another store takes in.

An archive holds `runs/<hash12>/…` as a store does, so `tar` can read it, too. The same runs give
the same bytes. Nothing of an archive is trusted: it holds plain files only, whose heads are all
checked before anything is read; names are matched, sizes are limited, and memory is taken for the
bytes that are there, of one file and of at most `MOST_WAITING` bytes of logs that wait. Every log
is checked against its place before it is taken in.
"""

import hashlib
import io
import json
import os
import re
import tarfile
from collections.abc import Iterator, Sequence
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
_BLOCK = tarfile.BLOCKSIZE
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

    Summary tables, failures and whatever is no part of a run stay behind.

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

    Raises:
        ArchiveError: If it is no archive of runs, or damaged; what came before the damage is taken.
        Busy: If another process writes one of the runs.
    """
    try:
        with open(path, "rb") as file:
            return _take_in(path, outputs, file)
    except OSError as error:
        if error.filename not in (None, str(path)):  # of the store, not of the archive
            raise
        reason = (error.strerror or str(error)).lower()
        raise ArchiveError(f"{_shown(path)}: cannot be read ({reason})") from None


def _take_in(path: Path, outputs: Path, file: BinaryIO) -> list[TakenRun]:
    arrivals: dict[str, _Arrival] = {}
    for member in list(_members(path, file)):
        place = _BESIDE.fullmatch(member.name) or _LOG.fullmatch(member.name)
        assert place is not None, "its name was matched"
        hash12, rest = place.groups()
        arrival = arrivals.get(hash12)
        content, sha256 = _content(file, member)
        if arrival is None:
            if rest != CONFIG:
                raise ArchiveError(f"{_shown(path)}: damaged: {member.name} comes before {CONFIG}")
            arrivals[hash12] = _Arrival(path, outputs, hash12, content)
        elif member.name.endswith(".mcap"):
            arrival.add(int(rest), content)
        else:
            arrival.add_beside(rest, content, sha256)
    if not arrivals:
        raise ArchiveError(f"{_shown(path)}: no archive of runs: it is empty")
    return [arrival.finish() for arrival in arrivals.values()]


class _Arrival:
    """One run of an archive on its way into a store."""

    def __init__(self, path: Path, outputs: Path, hash12: str, config_json: bytes) -> None:
        condition_id = hashlib.sha256(config_json).hexdigest()
        if condition_id[:HASH_LENGTH] != hash12:
            raise ArchiveError(
                f"{_shown(path)}: damaged: {CONFIG} of run {hash12} has another hash"
            )
        self.run = RunDirectory(outputs, condition_id)
        self._path, self._config = path, config_json
        self._beside: dict[str, bytes] = {}
        self._waiting: dict[int, bytes] = {}
        self._size = self._added = self._kept = 0
        self._begun = False

    def add_beside(self, name: str, content: bytes, sha256: str) -> None:
        """Take a file beside the configuration in: one that it refers to at once."""
        if not name.startswith(PREFIX):
            self._beside[name] = content if name != MANIFEST else self._foreign(content)
        elif name != PREFIX + sha256 or sha256.encode() not in self._config:
            what = "does not have the hash that is its name, or its run does not refer to it"
            raise ArchiveError(f"{_shown(self._path)}: damaged: {name[:30]}… {what}")
        elif not (place := self.run.path / name).exists():
            with self.run.lock():
                place.parent.mkdir(exist_ok=True)
                write_file(place, content)

    def _foreign(self, manifest: bytes) -> bytes:
        """Return somebody's manifest with the name of the archive that it comes from."""
        try:
            notes: Any = json.loads(manifest)
        except (ValueError, RecursionError):
            notes = None
        if not isinstance(notes, dict):
            text = f"{MANIFEST} of run {self.run.hash12} is no JSON object"
            raise ArchiveError(f"{_shown(self._path)}: damaged: {text}")
        marked = notes | {TAKEN: printable(self._path.name.replace("\n", " "))}
        return json.dumps(marked, indent=2, sort_keys=True).encode() + b"\n"

    def add(self, replicate: int, content: bytes) -> None:
        """Take a log in, later and with others."""
        self._begin()
        if replicate in self.run.completed():
            self._kept += 1
            return
        try:
            checked_summary(content, self.run.condition_id, replicate)
        except CorruptLog as error:
            name = f"{self.run.hash12}, replicate {replicate}"
            raise ArchiveError(f"{_shown(self._path)}: damaged: {name}: {error}") from None
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
        files[self.run.path / CONFIG] = self._config
        with self.run.lock():
            self.run.replicates.mkdir(parents=True, exist_ok=True)
            write_files({place: each for place, each in files.items() if not place.exists()})
            self.run.check()

    def _write(self) -> None:
        """Write the logs that wait."""
        logs, self._waiting, self._size = self._waiting, {}, 0
        if logs:
            with self.run.lock():
                self.run.write_logs(logs)
        self._added += len(logs)


class _Member(NamedTuple):
    """A file of an archive."""

    name: str  # `runs/<hash12>/…`
    start: int  # offset of its content [B]
    size: int  # [B] of its content


def _members(path: Path, file: BinaryIO) -> Iterator[_Member]:
    """Yield the files of an archive by their heads alone; each is plain, and wholly there.

    `tarfile` itself follows links, extended heads and sparse files of any size.
    """
    end, names = file.seek(0, os.SEEK_END), set[str]()
    file.seek(0)
    begin = file.read(max(map(len, _COMPRESSED)))
    if kind := next((kind for sign, kind in _COMPRESSED.items() if begin.startswith(sign)), ""):
        raise ArchiveError(f"{_shown(path)}: no archive of runs: compressed ({kind}); unpack it")
    start = 0
    while start + 2 * _BLOCK <= end:
        file.seek(start)
        head = file.read(_BLOCK)
        if not any(head):
            if any(file.read(_BLOCK)):
                break
            return
        entry = _entry(path, head)
        if not _BESIDE.fullmatch(entry.name) and not _LOG.fullmatch(entry.name):
            text = printable(entry.name.replace("\n", "\\n"))
            raise ArchiveError(f"{_shown(path)}: no archive of runs: holds '{text}'")
        if entry.name in names or len(names) >= MOST_FILES:
            what = f"holds {entry.name} twice" if entry.name in names else "too many files"
            raise ArchiveError(f"{_shown(path)}: no archive of runs: {what}")
        names.add(entry.name)
        yield _Member(entry.name, start + _BLOCK, entry.size)
        start += _BLOCK + -(-entry.size // _BLOCK) * _BLOCK
    raise ArchiveError(f"{_shown(path)}: no archive of runs, or a damaged one: it is cut off")


def _entry(path: Path, head: bytes) -> tarfile.TarInfo:
    """Return the head of a plain file of a size that is read."""
    try:
        entry = tarfile.TarInfo.frombuf(head, "utf-8", "backslashreplace")
    except tarfile.TarError as error:
        raise ArchiveError(f"{_shown(path)}: no archive of runs ({error})") from None
    if entry.type not in _PLAIN:
        raise ArchiveError(
            f"{_shown(path)}: no archive of runs: no regular file, "
            f"'{printable(entry.name)}' is of kind {entry.type!r}"
        )
    is_text = entry.name.endswith((CONFIG, MANIFEST, PLANS))
    limit = MAX_LOG if entry.name.endswith(".mcap") else MAX_TEXT if is_text else MAX_INPUT
    if not 0 <= entry.size <= limit:
        raise ArchiveError(f"{_shown(path)}: no archive of runs: a file is too large")
    return entry


def _content(file: BinaryIO, member: _Member) -> tuple[bytes, str]:
    """Return the content of a file of an archive, and its SHA-256, computed as it arrives."""
    pieces, digest, rest = [], hashlib.sha256(), member.size
    file.seek(member.start)
    while rest and (piece := file.read(min(rest, _PIECE))):
        digest.update(piece)
        pieces.append(piece)
        rest -= len(piece)
    return b"".join(pieces), digest.hexdigest()


def _shown(path: Path) -> str:
    return printable(str(path))
