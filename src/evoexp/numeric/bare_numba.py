"""numba, loaded without two libraries that it looks for and that kernels have no use for.

It loads PyYAML in case there is a file `.numba_config.yaml`, and scipy to see that it is not older
than 1.0: a tenth of the time that numba itself takes.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

CONFIG = ".numba_config.yaml"  # in the current directory


@contextmanager
def left_out(*names: str) -> Iterator[None]:
    """Have imports of modules fail meanwhile, of those that are not loaded already."""
    absent = [name for name in names if name not in sys.modules]
    sys.modules.update(dict.fromkeys(absent))  # type: ignore[arg-type]  # None: cannot be imported
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]


with left_out("scipy", *(() if Path(CONFIG).exists() else ("yaml",))):
    import numba as numba
