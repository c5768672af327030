"""evoexp: a laboratory for evolutionary robot motion planning."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evoexp.frames import Frames, load

__version__ = "0.1.0"
__all__ = ["Frames", "__version__", "load"]


def __getattr__(name: str) -> Any:
    """Load what needs pandas only when it is asked for."""
    if name in ("load", "Frames"):
        return getattr(importlib.import_module("evoexp.frames"), name)
    raise AttributeError(f"module 'evoexp' has no attribute '{name}'")
