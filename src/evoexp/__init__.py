"""evoexp: a laboratory for evolutionary robot motion planning."""

import importlib
from typing import TYPE_CHECKING, Any

from evoexp.version import __version__

if TYPE_CHECKING:
    from evoexp.loading import Frames, load

__all__ = ["Frames", "__version__", "load"]


def __getattr__(name: str) -> Any:
    """Import `load`, which needs pandas, only when it is asked for."""
    if name in ("load", "Frames"):
        return getattr(importlib.import_module("evoexp.loading"), name)
    raise AttributeError(f"module 'evoexp' has no attribute '{name}'")


def __dir__() -> list[str]:
    """Return the names that the package offers."""
    return list(__all__)
