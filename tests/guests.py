"""Distributions made by tests: metadata with entry points in a folder that is put on the path."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from evoexp import registry


def write_distribution(
    directory: Path, name: str, version: str = "1.0", **groups: Mapping[str, str]
) -> None:
    """Write the metadata of a distribution; groups of `evoexp.…` are name → target."""
    information = directory / f"{name.replace('-', '_')}-{version}.dist-info"
    information.mkdir(parents=True)
    metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
    (information / "METADATA").write_text(metadata)
    lines = []
    for group, points in groups.items():
        lines += [f"[evoexp.{group}]", *(f"{key} = {target}" for key, target in points.items())]
    (information / "entry_points.txt").write_text("\n".join(lines))


@contextmanager
def on_path(*directories: Path) -> Iterator[None]:
    """Put folders on the path of this process, and of those it starts, and read metadata anew."""
    with pytest.MonkeyPatch.context() as patch:
        for directory in directories:
            patch.syspath_prepend(str(directory))
            patch.setenv("PYTHONPATH", str(directory), prepend=":")
        registry.clear()
        try:
            yield
        finally:
            patch.undo()
            registry.clear()
            for name, module in list(sys.modules.items()):  # another test may write another one
                if str(getattr(module, "__file__", None)).startswith(tuple(map(str, directories))):
                    del sys.modules[name]
