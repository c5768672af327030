"""Meshes that a URDF names: beside it, or in a package in a directory above it."""

from pathlib import Path

from evoexp.errors import SettingError
from evoexp.robots.urdf_text import file_content

MESHES = (".stl", ".obj", ".dae", ".ply")  # endings: a URDF makes nobody's other files travel


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
