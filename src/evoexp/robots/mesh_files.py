"""Meshes that a URDF names: beside it, or in a package in a directory above it."""

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from evoexp.errors import SettingError, nearest
from evoexp.robots.urdf_text import file_content

ROBOT_DATA = "example-robot-data"  # names of its files begin with this and a colon
MESHES = (".stl", ".obj", ".dae", ".ply")  # endings: a URDF makes nobody's other files travel


def robot_file(path: Any, field: str) -> Any:
    """Find a file of the package example-robot-data, if a path begins with `example-robot-data:`.

    Args:
        path: As it was given: `example-robot-data:ur_description/urdf/ur5_robot.urdf`, or any path.
        field: That names it, for errors.

    Raises:
        SettingError: If the package is not installed, or has no such file.
    """
    if not isinstance(path, str) or not path.startswith(f"{ROBOT_DATA}:"):
        return path
    try:
        package = distribution(ROBOT_DATA)
    except PackageNotFoundError:
        must = f"a file that is there; install {ROBOT_DATA}: pip install 'evoexp[robots]'"
        raise SettingError(field, must, path) from None
    folder = Path(str(package.locate_file(f"cmeel.prefix/share/{ROBOT_DATA}/robots")))
    found = folder / path.removeprefix(f"{ROBOT_DATA}:")
    if ".." not in found.parts and found.is_file():
        return str(found)
    ending = found.suffix.lower()
    names = [str(each.relative_to(folder)) for each in sorted(folder.rglob(f"*{ending}"))]
    hint = nearest(path.removeprefix(f"{ROBOT_DATA}:"), names) if ending else ""
    raise SettingError(field, f"a file of {ROBOT_DATA}", path, hint)


def mesh_content(name: str, urdf: Path, field: str) -> bytes:
    """Return the content of a mesh: beside the URDF, or in a package in a directory above it."""
    if name.startswith("package://"):
        rest = name.removeprefix("package://")
        if Path(rest).suffix.lower() in MESHES:
            rest = rest.lstrip("/")  # a common slip
        if rest.startswith("/") or ".." in Path(rest).parts:
            raise SettingError(field, "a URDF whose meshes lie in their packages", name)
        tried = [parent / rest for parent in urdf.resolve().parents]
        tried += [parent / rest.partition("/")[2] for parent in urdf.resolve().parents]
    else:
        tried = [urdf.parent / name.removeprefix("file://")]
    for place in tried:
        if "\0" not in name and place.is_file():
            if place.resolve().suffix.lower() not in MESHES:
                must = f"a URDF whose meshes are files that end in {', '.join(MESHES)}"
                raise SettingError(field, must, name)
            return file_content(place, field)
    raise SettingError(field, "a URDF whose meshes are there", f"a missing mesh '{name}'")
