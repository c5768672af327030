"""The files of a run beside its logs, its configuration, its manifest, its plans: which run it is.

Experiment, label, seed and settings are columns that make tables of many runs one table: SQL over
`runs/*/summary.parquet` groups by `population_size` without a join. No command reads them back.
The environment of a computation, versions, processor and code, is never part of an identity.
"""

import hashlib
import json
import os
import platform
import re
import subprocess
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.attachments import PREFIX, SHA256, hashes
from evoexp.errors import CorruptLog, StoreError
from evoexp.input_files import read_bounded
from evoexp.shipped import rows_of, shipped
from evoexp.store.log_reader import LogContents, read_log
from evoexp.validation import MOST_QUERIES, TARGET

_DISTRIBUTIONS = (
    *("evoexp", "numpy", "numba", "llvmlite", "scipy", "pin", "libpinocchio", "coal", "libcoal"),
    *("hydra-core", "omegaconf", "pydantic", "joblib", "mcap", "zstandard", "orjson", "xxhash"),
    *("pandas", "pyarrow"),
)

# Processor flags that decide which instructions a compiler may choose; others change no number.
_VECTOR_PREFIXES = ("sse", "ssse", "avx", "fma", "f16c", "bmi", "amx", "asimd", "sve", "neon", "fp")


class Difference(NamedTuple):
    """One entry in which two environments differ; None where one of them lacks it."""

    name: str
    was: Any
    now: Any

    def __str__(self) -> str:
        return f"{self.name}: was {self.was}, now {self.now}"


def manifest(condition_id: str, components: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the manifest of a run: its full hash, the environment, the state of the code."""
    return {"condition": condition_id, **environment(components), "git": git_state()}


def environment(components: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return versions, platform and processor, and the packages of components not of evoexp."""
    return {**_environment(), "components": dict(components)} if components else _environment()


@cache
def _environment() -> dict[str, Any]:
    """Return the part of the environment that is the same for all conditions, found in 15 ms."""
    versions: dict[str, str | None] = {"python": platform.python_version()}
    for name in _DISTRIBUTIONS:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = None
    system = {
        "system": platform.system(),
        "machine": platform.machine(),
        "libc": " ".join(platform.libc_ver()).strip() or None,
    }
    # name and vector features of the processor, from /proc/cpuinfo where there is one
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").split("\n\n")[0]
    except OSError:
        text = ""
    pairs = (line.partition(":") for line in text.splitlines())
    entries = {name.strip().lower(): value.strip() for name, _, value in pairs}
    flags = (entries.get("flags") or entries.get("features") or "").split()
    features = [flag for flag in flags if flag.startswith(_VECTOR_PREFIXES) and flag[:3] != "fpu"]
    cpu = {"name": entries.get("model name") or platform.processor() or None}
    return {"versions": versions, "platform": system, "cpu": cpu | {"features": sorted(features)}}


@cache
def git_state() -> dict[str, Any] | None:
    """Return commit and dirty flag of the checkout that evoexp is imported from, or None."""
    root = Path(__file__).resolve().parents[3]  # <root>/src/evoexp/store/identity.py
    if not (root / ".git").exists() or not (root / "pyproject.toml").exists():
        return None
    commit = _git(root, "rev-parse", "--verify", "--quiet", "HEAD")
    status = _git(root, "status", "--porcelain", "--", "src", "conf", "pyproject.toml")
    return {"commit": commit or None, "dirty": None if status is None else bool(status)}


def differences(was: Mapping[str, Any], now: Mapping[str, Any]) -> list[Difference]:
    """Return the entries in which two manifests or environments differ, in alphabetical order.

    Only sections that both have are compared; of two lists, entries that the other lacks are named.
    """
    shared = was.keys() & now.keys() - {"condition"}
    before, after = ({name: each[name] for name in shared} for each in (was, now))
    entries = []
    for name, old, new in sorted(changed(before, after), key=itemgetter(0)):
        if isinstance(old, list) and isinstance(new, list):
            old, new = [x for x in old if x not in new], [x for x in new if x not in old]
        if old != new:
            entries.append(Difference(name, old, new))
    return entries


def changed(one: Any, two: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield (dotted name, value, other value) where plain data differ; None: not there."""
    before, after = dict(leaves(one)), dict(leaves(two))
    for name in dict.fromkeys([*before, *after]):
        if before.get(name) != after.get(name):
            yield name, before.get(name), after.get(name)


def leaves(tree: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of plain data by dotted names; lists without mappings are one value."""
    items = list(tree.items()) if isinstance(tree, Mapping) else []
    if isinstance(tree, list) and any(isinstance(item, Mapping) for item in tree):
        items = list(enumerate(tree))
    for key, value in items:
        yield from leaves(value, f"{name}.{key}" if name else str(key))
    if not items:
        yield name, tree


def _git(root: Path, *arguments: str) -> str | None:
    command = ["git", "--no-optional-locks", "-C", str(root), *arguments]
    clean = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=10, check=False, env=clean
        )
    except (OSError, subprocess.SubprocessError, ValueError):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


CONFIG, MANIFEST, REPLICATES = "config.json", "manifest.json", "replicates"
PLANS = "plans.json"  # how many replicates were asked for, and how many were stored by then
TAKEN = "taken_from"  # the entry of a manifest out of an archive that names the archive
ORIGIN = ("experiment", "label", "budget")
_TEXTS = (*ORIGIN, "command", TAKEN)  # entries of a manifest
_SECTIONS = ("versions", "platform", "cpu", "components", "git", "options")
_LONGEST = 20_000  # characters of a text
_ID = re.compile("[0-9a-f]{64}")
_OF_NOTHING = hashlib.sha256().hexdigest()  # an empty file of a configuration has this name
LONGEST = 200  # characters of a list that is a column
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


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


def origin(manifest: Mapping[str, Any], condition_id: str) -> dict[str, Any]:
    """Return experiment, label and budget of a run, None if unknown; and whether it was `changed`.

    A shipped condition has the label and the budget of the shipped table, in the experiment that
    its manifest names if that has it: experiments share conditions.
    """
    notes = {name: manifest.get(name) or None for name in ORIGIN}
    experiment, label = notes["experiment"], notes["label"]
    rows = sorted(
        rows_of(condition_id), key=lambda row: (row.experiment != experiment, row.label != label)
    )
    labels = {row.label for row in shipped() if row.experiment == experiment}
    is_named = label is not None and label not in labels
    if rows and (rows[0].experiment == experiment or not is_named):
        return {**{name: getattr(rows[0], name) for name in ORIGIN}, "changed": False}
    budget = rows[0].budget if rows else notes["budget"]
    return {**notes, "budget": budget, "changed": bool(labels)}


def run_context(path: Path, condition_id: str, taken: Collection[str]) -> dict[str, Any]:
    """Return name → value of the origin and the settings of a run, as far as they can be read.

    A setting has the last part of its name where no other setting and no column has it, else its
    name as it is typed: `population_size`, `collision.num_samples`. Components are called by their
    group: `planner`, `control`, `robot`. Lists of plain values are JSON; other lists are left out.
    """
    objects: dict[str, dict[str, Any]] = {MANIFEST: {}, CONFIG: {}}
    for name in objects:
        with suppress(StoreError):
            objects[name] = read_object(path / name)
    known = origin(objects[MANIFEST], condition_id)
    columns = {name: str(known[name]) for name in ORIGIN if known[name]}
    settings = dict(_settings(typed_parts(objects[CONFIG])))
    counts = Counter(name.rpartition(".")[2] for name in settings)
    for name, value in settings.items():
        short = name.rpartition(".")[2]
        is_free = counts[short] == 1 and short not in taken and short not in columns
        column = short if is_free else name
        if column not in taken:
            columns[column] = value
    return columns


def typed_parts(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts of a canonical form by the names under which their settings are typed.

    A planner's components come out of it (`ga`, `collision`), and a planner out of its control.
    """
    parts: dict[str, Any] = {}
    for name, component in settings.items():
        if isinstance(component, Mapping) and isinstance(component.get("planner"), Mapping):
            around = {key: value for key, value in component.items() if key != "planner"}
            parts |= {"control": around} | typed_parts({"planner": component["planner"]})
        elif name == "planner" and isinstance(component, Mapping):
            fields = component.items()
            inner = {
                k: value for k, value in fields if isinstance(value, Mapping) and TARGET in value
            }
            parts |= {"planner": {k: value for k, value in fields if k not in inner}} | inner
        elif name == MOST_QUERIES:
            parts["budget"] = {"collision_queries": component}
        else:
            parts[name] = component
    return parts


def _settings(config: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield (dotted name, value) of the settings that a column can hold."""
    for name, value in leaves(config):
        group, _, last = name.rpartition(".")
        dotted = group if last == TARGET else name  # a component is called by its group
        if isinstance(value, list):
            value = json.dumps(value)
            is_short = len(value) <= LONGEST and "{" not in value
        else:
            is_short = isinstance(value, bool | int | float | str)
        is_plain = all(map(_PLAIN.fullmatch, dotted.split(".")))
        if is_plain and is_short and last not in ("revision", "sha256"):
            yield dotted, value
