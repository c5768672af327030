"""The process that cleans up behind loky, started without all of joblib.

It only listens for names of semaphores and folders, and loky has it import joblib, numpy and their
threads first: a quarter of a second. Importing this module leaves empty packages of joblib behind;
it is for that process alone, which loky starts by the module of its `main`.
"""

import importlib.util
import sys

_PACKAGES = "joblib", "joblib.externals", "joblib.externals.loky", "joblib.externals.loky.backend"

for _name in _PACKAGES:
    _spec = importlib.util.find_spec(_name)
    if _spec is not None and _name not in sys.modules:
        sys.modules[_name] = importlib.util.module_from_spec(_spec)  # whose code does not run

from joblib.externals.loky.backend.resource_tracker import main  # noqa: E402

__all__ = ["main"]
