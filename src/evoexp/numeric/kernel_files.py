"""The files of one compiled kernel: an index, and one file per signature that it was compiled for.

Takes the place of numba's own pair of files, which are unpickled as they are: a damaged one ends in
a traceback, or runs as machine code. Here both are checked first (see `kept_files`); the index
names the other files by the hash of their content, so none can be taken for another.
"""

import contextlib
import pickle
from pathlib import Path
from typing import Any

import xxhash
from numba.core.serialize import dumps

from evoexp.numeric import kept_files
from evoexp.numeric.kept_files import MESSAGES, Damaged

USED = set[Path]()  # the files of all kernels that this process loaded or kept


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
            value = pickle.loads(kept_files.read_kept(path))
        except FileNotFoundError:
            return missing
        except Damaged:
            kept_files.say_damaged(path)
            self._is_damaged = True
            return missing
        USED.add(path)
        return value
