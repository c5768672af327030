"""Files that a condition needs, and the meshes that these name: read, and kept by their hashes.

A file is read where a configuration says `{file: path}`, and `{sha256: …}` is put in its place: a
condition's identity is that of the content, wherever the file lay and whatever it was called. The
content travels with the descriptions of replicates, is attached to their logs, and lies beside the
configuration of a stored run. Each process keeps the contents that it saw.
"""

import contextlib
import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from evoexp.errors import EvoexpError, SettingError, brief, demand
from evoexp.input_files import MAX_INPUT, read_bounded
from evoexp.validation import Settings

FILE, SHA256 = "file", "sha256"
SHIPPED = "evoexp:"  # of paths
PREFIX = "files/"  # of the names of such attachments in a log

MESHES = (".stl", ".obj", ".dae", ".ply")  # endings: nobody's other files travel with a log
PACKAGE = "package://"
PACKAGE_PATHS = "ROS_PACKAGE_PATH"  # folders in which ROS looks for packages
MANIFEST = "package.xml"  # lies in the folder of a package
DEEPEST = 4  # folders of a workspace, one in another, in which packages are looked for
MOST_PLACES = 4000  # characters of a message

_contents: dict[str, bytes] = {}


class MissingFile(EvoexpError):
    """The content of a file that a condition needs is nowhere to be found."""


class File(Settings):
    """A file, as its content."""

    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]  # of the content, 64 hex digits

    @property
    def content(self) -> bytes:
        """The content; `MissingFile` if this process never saw it."""
        if self.sha256 not in _contents:
            raise MissingFile(
                f"file of sha256 {self.sha256[:12]}…: its content is not there; give the file again"
            )
        return _contents[self.sha256]


def located(path: str) -> str:
    """Return the path of a file; `evoexp:` stands for the folder of files that evoexp ships."""
    if not path.startswith(SHIPPED):
        return path
    return str(Path(__file__).parent / "assets" / path.removeprefix(SHIPPED))


def keep(content: bytes) -> str:
    """Keep the content of a file for as long as the process lives; return its SHA-256."""
    sha256 = hashlib.sha256(content).hexdigest()
    _contents[sha256] = content
    return sha256


def keep_all(contents: Iterable[bytes]) -> None:
    """Keep the contents of several files."""
    for content in contents:
        keep(content)


def read(path: Any, folders: Sequence[Path], field: str) -> str:
    """Read a file, also one that lies in a folder, and keep its content; return the SHA-256."""
    places = [Path(str(path)), *(folder / str(path) for folder in folders)]
    existing = [place for place in places if place.exists()]
    return keep(file_content(existing[0] if existing else path, field))


def file_content(
    path: Any, field: str, limit: int = MAX_INPUT, must: str = "a file that can be read"
) -> bytes:
    """Read a file of at most `limit` bytes, which may be one that evoexp ships."""
    try:
        return read_bounded(located(str(path)), limit)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingError(field, f"{must} ({reason})", str(path)) from None


def attached(config: Any) -> dict[str, bytes]:
    """Return the contents that plain data refers to and this process has, by names in a log."""
    return {PREFIX + sha256: _contents[sha256] for sha256 in hashes(config) if sha256 in _contents}


def hashes(config: Any) -> Iterator[str]:
    """Yield the SHA-256 of every file that a plain configuration refers to."""
    if isinstance(config, dict):
        if set(config) == {SHA256}:
            yield str(config[SHA256])
        for value in config.values():
            yield from hashes(value)
    elif isinstance(config, list | tuple):
        for value in config:
            yield from hashes(value)


# meshes, beside the file that names them or in a package of meshes


def package_folders(setting: Any, field: str) -> dict[str, Path]:
    """Check the setting, name of each package → its folder, that tells where packages lie."""
    if setting is None:
        return {}
    must = "folders of packages by their names, {name: folder}"
    demand(isinstance(setting, Mapping), field, must, setting)
    folders = {str(name): Path(located(str(folder))) for name, folder in setting.items()}
    for name, folder in folders.items():
        must = f"the folder of the package '{name}'"
        demand(os.path.isdir(folder), f"{field}.{name}", must, setting[name])
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
            places += f"; {setting}={{NAME: FOLDER}} and {PACKAGE_PATHS} tell where packages lie"
        must = "a file whose meshes exist"
        raise SettingError(field, must, f"a missing mesh '{name}'", brief(places, MOST_PLACES))
    must = f"a file whose meshes are files that end in {', '.join(MESHES)}"
    demand(place.resolve().suffix.lower() in MESHES, field, must, name)
    return file_content(place, field, must="a file whose meshes can be read")


def _places(name: str, file: Path, packages: Mapping[str, Path], field: str) -> Iterator[Path]:
    """Yield the places in which a mesh may lie, the first first."""
    if not name.startswith(PACKAGE):
        yield file.parent / name.removeprefix("file://")
        return
    path = name.removeprefix(PACKAGE)
    if Path(path).suffix.lower() in MESHES:
        path = path.lstrip("/")  # a common slip
    lies_inside = not path.startswith("/") and ".." not in Path(path).parts
    demand(lies_inside, field, "a file whose meshes lie in their packages", name)
    package, _, rest = path.partition("/")
    if package in packages:
        yield packages[package] / rest
        return
    above = file.resolve().parents
    yield from (folder / path for folder in above)
    yield from (folder / rest for folder in above)
    for text in filter(None, os.environ.get(PACKAGE_PATHS, "").split(os.pathsep)):
        folder = Path(text)
        yield folder / path
        yield from (found / rest for found in _workspace_folders(folder, package))


def _workspace_folders(folder: Path, package: str) -> Iterator[Path]:
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
