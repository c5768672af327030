"""Experiments that were composed before, kept on disk: Hydra takes a tenth of a second and more.

An expansion follows from the words that were typed, from the options in all folders of the search
path, from the installed components and from the code of evoexp and of the guests among these. All
of it, as content, is the name that the expansion is kept under, so whatever changes is composed
anew. Files that conditions refer to are read again, and must have the content that they had. An
expansion is not kept where more than this decides: URDF files with their meshes, and interpolations
(which may ask the environment). Errors are never kept.
"""

import contextlib
import hashlib
import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import orjson
import pydantic

from evoexp import attachments, shipped
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.condition import Condition
from evoexp.configuration.experiment import Experiment, Labelled
from evoexp.configuration.interpolations import MARK
from evoexp.configuration.kept_condition import KeptCondition
from evoexp.configuration.search_path import EXPERIMENT, file_directories, folders, is_file
from evoexp.numeric.cache_folder import cache_root
from evoexp.report.report_settings import ReportSettings
from evoexp.shipped import Option
from evoexp.store.kept_facts import add_files, installed_code
from evoexp.version import version_of

NUM_KEPT = 200  # [-] expansions, the newest ones
_NAME = re.compile(r"\w+")  # of an option; a file has a dot or a slash
_COMPOSERS = ("hydra-core", "omegaconf")


def expand(
    overrides: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> list[Experiment]:
    """Expand overrides into experiments, by `compose.expand` where nothing is kept.

    Several experiments are kept one by one, each as if it had been asked for alone.

    Raises:
        EvoexpError: For whatever cannot be run.
    """
    if parts := _by_experiment(overrides, multirun):
        return [one for part in parts for one in expand(part, multirun=_has_sweep(part), only=only)]
    path = _path(overrides, multirun, list(only))
    if path is not None and (kept := _read(path)) is not None:
        return kept
    from evoexp.configuration import compose  # and Hydra

    experiments = compose.expand(overrides, multirun=multirun, only=only)
    if path is not None and (files := _files(experiments)) is not None:
        _write(path, experiments, files)
    return experiments


def _by_experiment(overrides: Sequence[str], multirun: bool) -> list[list[str]]:
    """Return the overrides of each experiment, if several options of that group are swept over."""
    places = [k for k, word in enumerate(overrides) if word.startswith(f"{EXPERIMENT}=")]
    if not multirun or len(places) != 1:
        return []
    (place,) = places
    names = overrides[place].partition("=")[2].split(",")
    if len(set(names)) < max(2, len(names)) or not all(_NAME.fullmatch(name) for name in names):
        return []
    before, after = overrides[:place], overrides[place + 1 :]
    return [[*before, f"{EXPERIMENT}={name}", *after] for name in names]


def _has_sweep(overrides: Sequence[str]) -> bool:
    """Return whether any value may be swept over."""
    return any(mark in word for word in overrides for mark in ",(")


def _files(experiments: Sequence[Experiment]) -> list[tuple[str, str]] | None:
    """Return (path, SHA-256) of all files of conditions, None if one has no path of its own."""
    contents = {name for e in experiments for c in e.conditions for name in c.condition.files()}
    hashes = sorted(name.removeprefix(attachments.PREFIX) for name in contents)
    if not all(attachments.origins(sha256) for sha256 in hashes):
        return None
    return [(path, sha256) for sha256 in hashes for path in attachments.origins(sha256)]


def _path(overrides: Sequence[str], *others: Any) -> Path | None:
    """Return the file that an expansion is kept in; None where it may not be kept."""
    if any(MARK in word for word in overrides):
        return None
    versions = [*map(version_of, _COMPOSERS)]
    asked = [list(overrides), others, [each.origin for each in folders()], versions]
    digest = hashlib.sha256(json.dumps([*asked, pydantic.VERSION]).encode())
    digest.update(installed_code())
    places = [(folder.path, "*/*") for folder in folders()]
    places += [(shipped.config_directory(), "*.yaml")]
    files = [path for root, pattern in places for path in sorted(root.glob(pattern))]
    files += [path for word in overrides for path in _experiments(word)]
    add_files(digest, files)
    return cache_root() / "expansions" / f"{digest.hexdigest()[:32]}.json"


def _experiments(word: str) -> list[Path]:
    """Return the paths that an override names experiments by, which need not be there."""
    key, _, typed = word.partition("=")
    names = [typed, *re.split(r"[\s,()'\"]+", typed)] if key == EXPERIMENT else []
    return [Path(name).resolve() for name in names if is_file(name)]


def _read(path: Path) -> list[Experiment] | None:
    """Return a kept expansion; None if there is none, or it is damaged or out of date."""
    try:
        digest, _, text = path.read_bytes().partition(b"\n")
    except OSError:
        return None
    if digest != hashlib.sha256(text).hexdigest().encode():
        return None
    with contextlib.suppress(OSError):
        os.utime(path)
    kept = orjson.loads(text)
    try:
        if any(
            attachments.read(file, file_directories()) != sha256 for file, sha256 in kept["files"]
        ):
            return None
    except OSError:
        return None
    return [_experiment(plain) for plain in kept["experiments"]]


def _experiment(plain: dict[str, Any]) -> Experiment:
    conditions = (
        Labelled(label, cast(Condition, KeptCondition(text.encode(), is_reference)))
        for label, text, is_reference in plain["conditions"]
    )
    runner = RunnerSettings.model_validate_json(plain["runner"])
    report = ReportSettings.model_validate_json(plain["report"])
    options = {label: tuple(Option(*each) for each in own) for label, own in plain["options"]}
    changed = {"conditions": tuple(conditions), "runner": runner, "report": report}
    changed |= {"capped": tuple(plain["capped"])}
    return Experiment(**(plain | changed | {"options": options}))


def _write(path: Path, experiments: Sequence[Experiment], files: Sequence[tuple[str, str]]) -> None:
    """Keep an expansion, and the newest `NUM_KEPT` in all; silent where that cannot be done."""
    temporary = path.with_suffix(f".{os.getpid()}.tmp")
    with contextlib.suppress(OSError, TypeError):  # TypeError: a label that is no UTF-8
        plain = [_plain(experiment) for experiment in experiments]
        text = orjson.dumps({"experiments": plain, "files": files})
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_bytes(hashlib.sha256(text).hexdigest().encode() + b"\n" + text)
        temporary.replace(path)
        kept = sorted(path.parent.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
        for old in kept[NUM_KEPT:]:
            old.unlink(missing_ok=True)


def _plain(experiment: Experiment) -> dict[str, Any]:
    return experiment._asdict() | {
        "conditions": [
            (label, condition.to_json().decode(), condition.is_reference)
            for label, condition in experiment.conditions
        ],
        "runner": experiment.runner.model_dump_json(),
        "report": experiment.report.model_dump_json(),
        "options": [(label, list(map(list, own))) for label, own in experiment.options.items()],
    }
