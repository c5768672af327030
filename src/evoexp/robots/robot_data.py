"""Robots of the package example-robot-data, by the names of their files in it."""

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from evoexp.errors import SettingError, nearest

ROBOT_DATA = "example-robot-data"  # names of its files begin with this and a colon


def robot_file(path: Any, field: str) -> Any:
    """Find a file of the package, if a path begins with `example-robot-data:`."""
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
