"""Experiments that were composed before, kept on disk.

Hydra takes a tenth of a second and more per choice of options.

An expansion follows from what was typed, from `conf/` and from evoexp's own code; all three, as
content, are the name that it is kept under, so whatever changes is composed anew. Files that
conditions refer to are read again, and must say what they said. It is not kept where more has a
say: URDF files with their meshes, interpolations (which may ask the environment), plug-ins. Errors
are never kept.
"""

import contextlib
import hashlib
import importlib.metadata
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import orjson
import pydantic

from evoexp import attachments, shipped
from evoexp.batch.runner_settings import RunnerSettings
from evoexp.condition import Condition
from evoexp.configuration.experiment import Experiment, Labelled
from evoexp.configuration.search_path import file_directories, folders
from evoexp.numeric.kernel_cache import cache_root
from evoexp.registry import COMPONENTS, registrations
from evoexp.report.report_settings import ReportSettings

NUM_KEPT = 200  # [-] expansions, the newest ones
_COMPOSERS = ("hydra-core", "omegaconf")


def expand(
    overrides: Sequence[str], *, multirun: bool = False, only: Sequence[str] = ()
) -> list[Experiment]:
    """Expand overrides into experiments as `compose.expand` does.

    Which is asked where nothing is kept.

    Raises:
        EvoexpError: For whatever cannot be run.
    """
    path = _path([list(overrides), multirun, list(only)])
    if path is not None and (kept := _read(path)) is not None:
        return kept
    from evoexp.configuration import compose  # and Hydra

    experiments = compose.expand(overrides, multirun=multirun, only=only)
    if path is not None and (files := _files(experiments)) is not None:
        _write(path, experiments, files)
    return experiments


def _files(experiments: Sequence[Experiment]) -> list[tuple[str, str]] | None:
    """Return (path, SHA-256) of all files that conditions refer to.

    None if one did not come from a path alone.
    """
    contents = {name for e in experiments for c in e.conditions for name in c.condition.files()}
    hashes = sorted(name.removeprefix(attachments.PREFIX) for name in contents)
    if not all(attachments.origins(sha256) for sha256 in hashes):
        return None
    return [(path, sha256) for sha256 in hashes for path in attachments.origins(sha256)]


def _path(asked: list[Any]) -> Path | None:
    """Return where an expansion is kept; None where it may not be."""
    components = registrations(COMPONENTS)
    if any("${" in word for word in asked[0]) or not all(each.is_own for each in components):
        return None
    versions = [importlib.metadata.version(name) for name in _COMPOSERS]
    digest = hashlib.sha256(orjson.dumps([asked, versions, pydantic.VERSION]))
    code = (Path(__file__).parents[1], "**/*.py")
    for root, pattern in (
        (shipped.config_directory(), "*.yaml"),
        *((f.path, "*/*") for f in folders()),
        code,
    ):
        for path in sorted(path for path in root.glob(pattern) if path.is_file()):
            content = path.read_bytes()
            digest.update(
                f"{path.relative_to(root).as_posix()}\0{len(content)}\0".encode() + content
            )
    return cache_root() / "expansions" / f"{digest.hexdigest()[:32]}.json"


def _read(path: Path) -> list[Experiment] | None:
    """Return what is kept; None if there is nothing, or nothing whole."""
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
        Labelled(label, Condition.from_json(text.encode())) for label, text in plain["conditions"]
    )
    runner = RunnerSettings.model_validate_json(plain["runner"])
    report = ReportSettings.model_validate_json(plain["report"])
    return Experiment(
        **(plain | {"conditions": tuple(conditions), "runner": runner, "report": report})
    )


def _write(path: Path, experiments: Sequence[Experiment], files: Sequence[tuple[str, str]]) -> None:
    """Keep an expansion, and not too many of them; silent where that cannot be done."""
    text = orjson.dumps(
        {"experiments": [_plain(experiment) for experiment in experiments], "files": files}
    )
    temporary = path.with_suffix(f".{os.getpid()}.tmp")
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_bytes(hashlib.sha256(text).hexdigest().encode() + b"\n" + text)
        temporary.replace(path)
        kept = sorted(path.parent.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
        for old in kept[NUM_KEPT:]:
            old.unlink(missing_ok=True)


def _plain(experiment: Experiment) -> dict[str, Any]:
    return experiment._asdict() | {
        "conditions": [
            (label, condition.to_json().decode()) for label, condition in experiment.conditions
        ],
        "runner": experiment.runner.model_dump_json(),
        "report": experiment.report.model_dump_json(),
    }
