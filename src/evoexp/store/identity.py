"""The files of a run beside its logs: its configuration, its manifest, its plans."""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.attachments import PREFIX, SHA256, hashes
from evoexp.errors import CorruptLog, StoreError
from evoexp.input_files import read_bounded
from evoexp.store.log_reader import LogContents, read_log

CONFIG, MANIFEST, REPLICATES = "config.json", "manifest.json", "replicates"
PLANS = "plans.json"  # how many replicates were asked for, and how many were stored by then
TAKEN = "taken_from"  # the entry of a manifest out of an archive that names the archive
_TEXTS = ("experiment", "label", "budget", "command", TAKEN)  # entries of a manifest
_SECTIONS = ("versions", "platform", "cpu", "components", "git", "options")
_LONGEST = 20_000  # characters of a text
_ID = re.compile("[0-9a-f]{64}")
_OF_NOTHING = hashlib.sha256().hexdigest()  # an empty file of a configuration has this name


class DamagedFile(StoreError):
    """A file of a run directory that is missing, damaged or foreign, and could be written again."""


class Plan(NamedTuple):
    """A number of replicates that was asked for."""

    num_replicates: int  # all of them, those stored by then included
    stored: int  # logs that were there already, whose results could be known


def stored_id(path: Path) -> str:
    """Return the full hash of the condition whose run a directory holds.

    Where the configuration is lost, a log knows it, or else the manifest, or StoreError is raised.
    """
    try:
        return config_id(path)
    except DamagedFile as error:
        for _, log in whole_logs(path, path.name):
            return log.condition_id
        with suppress(DamagedFile):
            noted = str(read_object(path / MANIFEST).get("condition"))
            if _ID.fullmatch(noted) and noted.startswith(path.name):
                return noted
        raise StoreError(f"{error}; neither a log nor the manifest has it, either") from None


def config_id(path: Path) -> str:
    """Return the full hash of the configuration that a run directory holds.

    DamagedFile is raised where there is none, or its hash does not begin as the directory's name.
    """
    config = path / CONFIG
    stored = hashlib.sha256(read(config)).hexdigest()
    if not stored.startswith(path.name):
        raise DamagedFile(f"{config}: damaged: its hash {stored[:12]} is not the directory's name")
    return stored


def whole_logs(path: Path, prefix: str) -> Iterator[tuple[str, LogContents]]:
    """Yield file name and contents of the logs in a run directory that are whole.

    The configuration of each has the hash of its condition, which begins with `prefix`.
    """
    for log in sorted((path / REPLICATES).glob("*.mcap")):
        with suppress(CorruptLog):
            contents = read_log(log)
            known = hashlib.sha256(contents.config_json).hexdigest()
            if known == contents.condition_id and known.startswith(prefix):
                yield log.name, contents


def read(path: Path) -> bytes:
    """Return the content of a file."""
    try:
        content = read_bounded(path)
    except OSError as error:
        raise DamagedFile(f"{path}: cannot be read: {error.strerror or error}") from error
    if not content and path.name != _OF_NOTHING:
        raise DamagedFile(f"{path}: damaged: empty file")
    return content


def read_object(path: Path) -> dict[str, Any]:
    """Return the JSON object that a file holds."""
    content = read(path)
    try:
        value = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise DamagedFile(f"{path}: damaged: {error}") from error
    if not isinstance(value, dict):
        raise DamagedFile(f"{path}: damaged: not a JSON object")
    return value


def lost_files(path: Path, config_json: bytes) -> Iterator[tuple[Path, str]]:
    """Yield path and damage of the files that a run's configuration refers to and that are lost."""
    if SHA256.encode() not in config_json:
        return
    for sha256 in filter(_ID.fullmatch, dict.fromkeys(hashes(json.loads(config_json)))):
        file = path / PREFIX / sha256
        try:
            if hashlib.sha256(read(file)).hexdigest() != sha256:
                yield file, "damaged: its content does not have the hash that is its name"
        except DamagedFile as error:
            yield file, str(error).removeprefix(f"{file}: ")


def checked_manifest(path: Path, condition_id: str) -> dict[str, Any]:
    """Return the content of a run directory's `manifest.json`.

    It may come from anybody: its texts are one line each, without control characters. DamagedFile
    is raised where it is missing, damaged, or of another condition.
    """
    manifest = read_object(path / MANIFEST)
    if manifest.get("condition", condition_id) != condition_id:
        theirs = str(manifest["condition"])[:12]
        raise DamagedFile(f"{path / MANIFEST}: is of run {theirs}, which does not belong here")
    if wrong := next(_misshapen(manifest), ""):
        raise DamagedFile(f"{path / MANIFEST}: damaged: {wrong}")
    return manifest


def _misshapen(manifest: Mapping[str, Any]) -> Iterator[str]:
    """Yield the entries of a manifest that are not of their kind."""
    for name in _TEXTS:
        text = manifest.get(name) or ""
        if not isinstance(text, str) or not text.isprintable() or len(text) > _LONGEST:
            yield f"{name} is no line of text"
    for name in _SECTIONS:
        if not isinstance(manifest.get(name) or {}, dict):
            yield f"{name} is no mapping"
    options = manifest.get("options")
    for group, option in options.items() if isinstance(options, dict) else ():
        texts = [option.get(key) for key in ("name", "origin")] if isinstance(option, dict) else [0]
        if not all(isinstance(each, str) and each.isprintable() for each in (group, *texts)):
            yield "options are no names and origins"
        elif ".." in f"{group}{texts[0]}" or group.startswith("/") or str(texts[0])[:1] == "/":
            yield "options name files elsewhere"  # a report reads those that are shipped
