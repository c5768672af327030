"""How often Python looks for garbage.

Imported modules and loaded kernels stay, so that the searches while they are loaded find nothing;
they take a sixth of that time.
"""

import gc

NEW_OBJECTS = 200_000  # [-] between two searches for garbage; by default 700


def search_less() -> None:
    """Look for garbage more rarely."""
    gc.set_threshold(NEW_OBJECTS, 20, 100)
