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
from evoexp.store.log import MAX_LOG
from evoexp.store.log_reader import read_summary
from evoexp.store.run_directory import HASH_LENGTH, RunDirectory

MOST_FILES = 2_000_000  # of an archive
MOST_WAITING = 64 * MEGABYTE  # [B] of logs that are taken in together
MAX_TEXT = 8 * MEGABYTE  # [B] of a configuration, a manifest, or plans
_TEXTS = (CONFIG, MANIFEST, PLANS)
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
                beside = [run.path / name for name in _TEXTS]
                beside += sorted((run.path / PREFIX).glob("[0-9a-f]*"))
                for each in beside:
                    if each.is_file():
                        _add(archive, root + str(each.relative_to(run.path)), each.read_bytes())
                for replicate in sorted(run.completed()):
                    log = run.log_path(replicate)
                    read_summary(log, (run.condition_id, replicate))
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
    shown, runs = printable(str(path)), dict[str, dict[str, tarfile.TarInfo]]()
    try:
        with open(path, "rb") as file:
            for entry in _entries(file):
                _, hash12, name = entry.name.split("/", 2)
                runs.setdefault(hash12, {})[name] = entry
            if not runs:
                raise ArchiveError("no archive of runs: it is empty")
            return [_taken(file, *each, path.name, outputs) for each in runs.items()]
    except ArchiveError as error:
        raise ArchiveError(f"{shown}: {error}") from None
    except OSError as error:
        if error.filename not in (None, str(path)):  # of the store, not of the archive
            raise
        reason = (error.strerror or str(error)).lower()
        raise ArchiveError(f"{shown}: cannot be read ({reason})") from None


def _taken(
    file: BinaryIO, hash12: str, entries: dict[str, tarfile.TarInfo], archive: str, outputs: Path
) -> TakenRun:
    if CONFIG not in entries:
        raise ArchiveError(f"no archive of runs: run {hash12} is without {CONFIG}")
    beside = {name: _content(file, entries[name]) for name in _TEXTS if name in entries}
    run = RunDirectory(outputs, hashlib.sha256(beside[CONFIG]).hexdigest())
    if run.hash12 != hash12:
        raise ArchiveError(f"damaged: {CONFIG} of run {hash12} has another hash")
    if MANIFEST in beside:
        try:
            notes: Any = json.loads(beside[MANIFEST])
        except (ValueError, RecursionError):
            notes = None
        if not isinstance(notes, dict):
            raise ArchiveError(f"damaged: {MANIFEST} of run {hash12} is no JSON object")
        marked = notes | {TAKEN: printable(archive.replace("\n", " "))}
        beside[MANIFEST] = json.dumps(marked, indent=2, sort_keys=True).encode() + b"\n"
    with run.lock():
        for name in sorted(name for name in entries if name.startswith(PREFIX)):
            content = _content(file, entries[name])
            sha256 = hashlib.sha256(content).hexdigest()
            if name != PREFIX + sha256 or sha256.encode() not in beside[CONFIG]:
                what = "does not have the hash that is its name, or its run does not refer to it"
                raise ArchiveError(f"damaged: {name[:30]}… {what}")
            if not (run.path / name).exists():
                write_file(run.path / name, content)
        run.replicates.mkdir(exist_ok=True)
        files = {run.path / name: content for name, content in beside.items()}
        write_files({path: content for path, content in files.items() if not path.exists()})
        run.check()
        logs = {int(match[2]): e for e in entries.values() if (match := _LOG.fullmatch(e.name))}
        there, waiting = run.completed(), dict[int, bytes]()
        for replicate in sorted(logs.keys() - there):
            waiting[replicate] = content = _content(file, logs[replicate])
            try:
                read_summary(content, (run.condition_id, replicate))
            except CorruptLog as error:
                name = f"{hash12}, replicate {replicate}"
                raise ArchiveError(f"damaged: {name}: {error}") from None
            if sum(map(len, waiting.values())) >= MOST_WAITING:
                run.write_logs(waiting)
                waiting = {}
        run.write_logs(waiting)
    return TakenRun(run, len(logs.keys() - there), len(logs.keys() & there))


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
    is_text = entry.name.endswith(_TEXTS)
    limit = MAX_LOG if entry.name.endswith(".mcap") else MAX_TEXT if is_text else MAX_INPUT
    if not 0 <= entry.size <= limit:
        return "a file is too large"
    if not _BESIDE.fullmatch(entry.name) and not _LOG.fullmatch(entry.name):
        text = printable(entry.name.replace("\n", "\\n"))
        return f"holds '{text}'"
    if entry.name in names:
        return f"holds {entry.name} twice"
    return "too many files" if len(names) >= MOST_FILES else ""


def _content(file: BinaryIO, entry: tarfile.TarInfo) -> bytes:
    file.seek(entry.offset_data)
    return file.read(entry.size)  # wholly there
