"""The files of one compiled kernel: an index, and one file per signature that it was compiled for.

Takes the place of numba's own pair of files, which are unpickled as they are: a damaged one ends in
a traceback, or runs as machine code. Here both are checked first (see `kept_files`); the index
names the other files by the hash of their content, so none can be taken for another.
"""

import contextlib
import io
import pickle
import sys
from pathlib import Path
from typing import Any

import xxhash
from numba.core import environment
from numba.core.serialize import dumps

from evoexp.numeric import kept_files
from evoexp.numeric.kept_files import MESSAGES, Damaged

USED = set[Path]()  # the files of all kernels that this process loaded or kept


class _Unpickler(pickle.Unpickler):
    """Reads what was kept, and imports no module for its functions alone."""

    def find_class(self, module: str, name: str) -> Any:
        """Return the named class or function; ours for the environments of compiled functions."""
        if (module, name) == (environment.__name__, environment._rebuild_env.__name__):
            return _environment
        return super().find_class(module, name)


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """Return the environment of a compiled function; without the names of an absent module.

    numba imports the module for them. Only what was compiled to handle Python's objects looks one
    up, and no kernel is. Some call a function of numba's own whose module registers all that it can
    compile, or loads scipy.linalg: a tenth of a second.
    """
    if module in sys.modules or environment.lookup_environment(name) is not None:
        return environment._rebuild_env(module, constants, name)
    made = environment.Environment({"__name__": module})
    made.consts[:] = constants
    made.env_name = name
    environment.Environment._memo[name] = made
    return made


class KernelFiles:
    """Loads and keeps the compiled forms of one kernel; has the methods of numba's own class."""

    def __init__(self, folder: Path, name: str) -> None:
        """Name the files; nothing is read.

        Args:
            folder: Where they are.
            name: Begins their names.
        """
        self._folder, self._name = folder, name
        self._index = folder / f"{name}.nbi"
        self._is_damaged = False

    def flush(self) -> None:
        """Forget all forms; their files stay until they are replaced."""
        self._keep_index({})

    def load(self, key: Any) -> Any:
        """Return the form that was kept under a key; None: there is none, or it is damaged."""
        name = self._entries().get(key)
        return None if name is None else self._unpickled(self._folder / name, None)

    def save(self, key: Any, data: Any) -> None:
        """Keep a form under a key, in place of an older one.

        Raises:
            OSError: If that cannot be done.
        """
        if self._is_damaged and MESSAGES.damage_stays:
            return
        entries, content = self._entries(), dumps(data)
        old = entries.get(key)
        entries[key] = f"{self._name}.{xxhash.xxh3_128_hexdigest(content)}.nbc"
        kept_files.write_kept(self._folder / entries[key], content)
        self._keep_index(entries)
        USED.update((self._index, self._folder / entries[key]))
        if old not in (None, entries[key]):
            with contextlib.suppress(OSError):
                (self._folder / str(old)).unlink()

    def _keep_index(self, entries: dict[Any, str]) -> None:
        kept_files.write_kept(self._index, dumps(entries))

    def _entries(self) -> dict[Any, str]:
        entries: dict[Any, str] = self._unpickled(self._index, {})
        return entries

    def _unpickled(self, path: Path, missing: Any) -> Any:
        """Return the value in a file; `missing` if it is not there or damaged, which is said."""
        try:
            value = _Unpickler(io.BytesIO(kept_files.read_kept(path))).load()
        except FileNotFoundError:
            return missing
        except Damaged:
            kept_files.say_damaged(path)
            self._is_damaged = True
            return missing
        USED.add(path)
        return value
