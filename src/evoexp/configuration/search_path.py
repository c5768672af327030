"""The search path: the folders that options are read from, in order.

First the folders given by `--config-dir`, then the folders in `EVOEXP_CONFIG_DIR`, then those
that installed packages declare as entry points of `evoexp.conf`, and last the shipped `conf`.
A folder has a sub-folder per group and in it a file per option: `ga/mine.yaml`. The first folder
that has an option wins. An experiment may also be the path of a file that lies anywhere.

A package declares a folder as `name = "package:folder"`: the folder lies in the package, or beside
the `src` that the package is in; dots in `folder` lead into sub-folders, and without `:folder` it
is the package's own.
"""

import contextlib
import functools
import importlib.util
import os
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import NamedTuple

from evoexp import shipped
from evoexp.errors import RegistrationError, UnknownOption, demand
from evoexp.registry import CONF, Registration, registrations
from evoexp.shipped import Option

VARIABLE, ARGUMENT = "EVOEXP_CONFIG_DIR", "--config-dir"
EXPERIMENT = "experiment"
SUFFIXES = (".yaml", ".yml")  # of an experiment that is given as a file

_given: ContextVar[tuple[str, ...]] = ContextVar("_given", default=())


class Folder(NamedTuple):
    """A folder of options."""

    path: Path  # absolute
    origin: str  # as it is shown: the folder as it was typed, `my-planner 0.3`, or `evoexp`


@contextlib.contextmanager
def searched_first(directories: Iterable[str]) -> Iterator[None]:
    """Search the folders of `--config-dir` before all others, for as long as the context lasts."""
    token = _given.set(tuple(directories))
    try:
        folders()
        yield
    finally:
        _given.reset(token)


def folders() -> list[Folder]:
    """Return all folders in the order in which they are searched."""
    typed = [(ARGUMENT, directory) for directory in _given.get()]
    variable = os.environ.get(VARIABLE, "").split(os.pathsep)
    found = []
    for name, directory in [*typed, *((VARIABLE, entry) for entry in variable if entry)]:
        demand(Path(directory).is_dir(), name, "a folder", directory)
        found.append(Folder(Path(directory).resolve(), directory))
    for each in sorted(registrations(CONF), key=lambda each: (each.is_own, each)):
        if each.is_own:
            found.append(Folder(shipped.config_directory().resolve(), shipped.ORIGIN))
        else:
            found.append(Folder(_declared(each), each.package))
    return found


def _declared(registration: Registration) -> Path:
    package, _, inner = registration.target.partition(":")
    with contextlib.suppress(ImportError, ValueError):
        spec = importlib.util.find_spec(package)
        for location in (spec and spec.submodule_search_locations) or ():
            for root in (Path(location), Path(location).parents[1]):
                if (root / inner.replace(".", "/")).is_dir():
                    return (root / inner.replace(".", "/")).resolve()
    raise RegistrationError(
        f"{registration.name}: {registration.package} declares the folder "
        f"{registration.target}, which is not there"
    )


@functools.cache
def groups() -> tuple[str, ...]:
    """Return the groups that a configuration chooses options of, in alphabetical order."""
    folder = shipped.config_directory()
    return tuple(sorted(path.name for path in folder.iterdir() if path.is_dir()))


def options(group: str) -> list[str]:
    """Return the names of a group's options in all folders, in alphabetical order."""
    return sorted(
        {path.stem for folder in folders() for path in (folder.path / group).glob("*.yaml")}
    )


def chosen(group: str) -> str:
    """Return the requirement that an option of a group is chosen, with the options."""
    if group == EXPERIMENT:
        return f"chosen: experiment=NAME, one of {len(options(group))}: evoexp list"
    return f"chosen: {', '.join(options(group))}"


def find(group: str, name: str) -> Option:
    """Return an option: its file and where it comes from."""
    if group == EXPERIMENT and is_file(name):
        must, stem = "the path of a file, or the name of an experiment", Path(name).stem
        demand(os.path.isfile(name), EXPERIMENT, must, name)
        is_plain = stem.strip(".") and stem.isprintable()  # it names the report's folder, too
        demand(is_plain, EXPERIMENT, "a file with a plain name", name)
        return Option(group, stem, name, str(Path(name).resolve()))
    for folder in folders() if os.path.basename(name) == name else ():
        path = os.path.join(folder.path, group, f"{name}.yaml")
        if os.path.isfile(path):  # of any text at all, also one that is too long for a path
            return Option(group, name, folder.origin, path)
    raise UnknownOption(group, name, options(group))


def is_file(experiment: str) -> bool:
    """Return whether an experiment is given as the path of a file."""
    return experiment.endswith(SUFFIXES)
