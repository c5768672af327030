"""The version of evoexp, and versions of other libraries."""

import functools

__version__ = "0.2.0"


@functools.cache
def version_of(distribution: str) -> str:
    """Return the version of an installed distribution; looking it up takes a millisecond.

    Raises:
        PackageNotFoundError: If it is not installed.
    """
    from importlib import metadata  # which takes longer than the rest of this module

    found = metadata.distribution(distribution)
    for line in (found.read_text("METADATA") or "").splitlines():
        if line.startswith("Version:"):  # the others, licences among them, are not parsed
            return line.removeprefix("Version:").strip()
    return found.version
