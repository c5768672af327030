"""The version of evoexp, and when this process began to load it."""

import time

__version__ = "0.1.0"

LOADED_FROM = time.time()
"""[s] No module of evoexp was read before, but this one and the package itself."""
