"""Versions of installed distributions are those that their metadata name."""

from importlib import metadata

import pytest

from evoexp.version import __version__, version_of


def test_versions_are_those_of_the_metadata() -> None:
    for name in ("numpy", "numba", "scipy", "pin", "coal", "pydantic"):
        assert version_of(name) == metadata.version(name)
    assert version_of("evoexp") == __version__


def test_what_is_not_installed_has_no_version() -> None:
    with pytest.raises(metadata.PackageNotFoundError):
        version_of("no-such-distribution")
