"""A hash of the installed code, under which what follows from it is kept."""

import contextlib
import hashlib
import importlib.util
import json
import os
from pathlib import Path

from evoexp.registry import COMPONENTS, Registration, registrations


def installed_code(without: tuple[str, ...] = ()) -> bytes:
    """Return the hash of the code of evoexp and of all guests, as it is now.

    Args:
        without: Folders of evoexp that do not count.
    """
    components = registrations(COMPONENTS)
    own = Path(__file__).parents[1]
    roots = dict.fromkeys([own, *(root for each in components for root in _sources(each))])
    hidden = tuple(f"{own / folder}{os.sep}" for folder in without)
    digest = hashlib.sha256(json.dumps(components).encode())
    for path in (path for root in roots for path in sorted(root.rglob("*.py"))):
        if not str(path).startswith(hidden):
            content = path.read_bytes()
            digest.update(f"{path}\0{len(content)}\0".encode(errors="surrogateescape") + content)
    return digest.digest()


def _sources(registration: Registration) -> list[Path]:
    """Return the folders with the code of a guest's component; nothing is imported."""
    if registration.is_own:
        return []
    with contextlib.suppress(ImportError, ValueError):
        spec = importlib.util.find_spec(registration.module.partition(".")[0])
        if spec is not None and spec.submodule_search_locations:
            return [Path(location) for location in spec.submodule_search_locations]
        if spec is not None and spec.origin:
            return [Path(spec.origin).parent]
    return []
