"""Meshes that a URDF or a planning scene names: beside it, or in a package of meshes."""

import contextlib
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from evoexp.attachments import located
from evoexp.errors import SettingError, brief
from evoexp.input_files import read_bounded

MESHES = (".stl", ".obj", ".dae", ".ply")  # endings: nobody's other files travel with a log
PACKAGE = "package://"
PATHS = "ROS_PACKAGE_PATH"  # folders in which ROS looks for packages
MANIFEST = "package.xml"  # lies in the folder of a package
DEEPEST = 4  # folders of a workspace, one in another, in which packages are looked for
MOST_PLACES = 4000  # characters of a message


def package_folders(setting: Any, field: str) -> dict[str, Path]:
    """Check the setting, name of each package → its folder, that tells where packages lie."""
    if setting is None:
        return {}
    if not isinstance(setting, Mapping):
        must = "folders of packages by their names, {name: folder}"
        raise SettingError(field, must, setting)
    folders = {str(name): Path(located(str(folder))) for name, folder in setting.items()}
    for name, folder in folders.items():
        if not os.path.isdir(folder):
            must = f"the folder of the package '{name}'"
            raise SettingError(f"{field}.{name}", must, setting[name])
    return folders


def mesh_content(name: str, file: Path, packages: Mapping[str, Path], field: str) -> bytes:
    """Read a mesh by the name that a file gives it.

    `package://NAME/REST` lies in the folder that `packages` tells for NAME; else in a directory
    above the file, with or without NAME; else in a package below `ROS_PACKAGE_PATH`. Any other
    name is a path, from the directory of the file.
    """
    tried: list[Path] = []
    for place in _places(name, file, packages, field):
        if os.path.isfile(place):  # also of names that cannot be
            break
        tried.append(place)
    else:
        places = f"; tried {', '.join(dict.fromkeys(map(str, tried)))}"
        if name.startswith(PACKAGE):
            setting = f"{field.rpartition('.')[0]}.packages"
            places += f"; {setting}={{NAME: FOLDER}} and {PATHS} tell where packages lie"
        must = "a file whose meshes are there"
        raise SettingError(field, must, f"a missing mesh '{name}'", brief(places, MOST_PLACES))
    if place.resolve().suffix.lower() not in MESHES:
        must = f"a file whose meshes are files that end in {', '.join(MESHES)}"
        raise SettingError(field, must, name)
    try:
        return read_bounded(place)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingError(field, f"a file whose meshes can be read ({reason})", name) from None


def _places(name: str, file: Path, packages: Mapping[str, Path], field: str) -> Iterator[Path]:
    """Yield the places in which a mesh may lie, the first first."""
    if not name.startswith(PACKAGE):
        yield file.parent / name.removeprefix("file://")
        return
    path = name.removeprefix(PACKAGE)
    if Path(path).suffix.lower() in MESHES:
        path = path.lstrip("/")  # a common slip
    if path.startswith("/") or ".." in Path(path).parts:
        raise SettingError(field, "a file whose meshes lie in their packages", name)
    package, _, rest = path.partition("/")
    if package in packages:
        yield packages[package] / rest
        return
    above = file.resolve().parents
    yield from (folder / path for folder in above)
    yield from (folder / rest for folder in above)
    for text in filter(None, os.environ.get(PATHS, "").split(os.pathsep)):
        folder = Path(text)
        yield folder / path
        yield from (found / rest for found in _workspace_folders(folder, package))


def _workspace_folders(folder: Path, package: str) -> Iterator[Path]:
    """Yield the folders, in and below one, whose manifest gives them the name of a package."""
    for place, folders, files in os.walk(folder):
        here, name = Path(place), None
        with contextlib.suppress(OSError):
            if MANIFEST in files:
                name = re.search(rb"<name>\s*([^<\s]+)\s*</name>", read_bounded(here / MANIFEST))
        if name is not None and name[1].decode(errors="replace") == package:
            yield here
        if MANIFEST in files or len(here.relative_to(folder).parts) >= DEEPEST:
            folders.clear()  # packages do not contain packages
        folders.sort()
