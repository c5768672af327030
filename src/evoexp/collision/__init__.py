"""Collision: batched kernels of the papers' own models, and verdicts on exact geometry.

`certify(geometry_scene(model, geometry), Motion(q))` judges a motion of any Pinocchio model;
`is_clear` answers yes or no.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evoexp.collision.certifier.verdict import Verdict, certify, is_clear
    from evoexp.collision.scene import Scene, geometry_scene
    from evoexp.paths.motion import Motion

_MODULES = {
    "Motion": "evoexp.paths.motion",
    "Scene": "evoexp.collision.scene",
    "Verdict": "evoexp.collision.certifier.verdict",
    "certify": "evoexp.collision.certifier.verdict",
    "geometry_scene": "evoexp.collision.scene",
    "is_clear": "evoexp.collision.certifier.verdict",
}

__all__ = ["Motion", "Scene", "Verdict", "certify", "geometry_scene", "is_clear"]


def __getattr__(name: str) -> Any:
    """Import what is asked for; kernels and coal take a second to load."""
    if name in _MODULES:
        return getattr(importlib.import_module(_MODULES[name]), name)
    raise AttributeError(f"module 'evoexp.collision' has no attribute '{name}'")
