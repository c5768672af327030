"""Where compiled kernels are kept: under the content of the code that they were made from.

numba's own cache looks at the path, the time stamp and the line numbers of a kernel's file, and
not at the files of the functions that the kernel calls. Here it is told of the content: see
`code_keys`.
"""

import contextlib
import functools
import hashlib
import importlib
import os
import shutil
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
from numba.core import caching
from numba.core.runtime.nrt import rtsys

from evoexp.numeric.code_keys import code_of, is_kernel_module, loaded_key, module_key
from evoexp.numeric.kept_files import MESSAGES, cache_root
from evoexp.numeric.kept_libraries import FORMAT, LibraryFiles, use_kept_libraries
from evoexp.numeric.kept_runtime import use_kept_runtime

if TYPE_CHECKING:
    from filelock import BaseFileLock

NUM_KEPT_CACHES = 4  # [-] states of a module whose compiled kernels are kept
KEPT_S = 86_400.0  # [s] and any that was used so lately
WAIT_S = 120.0  # [s] for another process that compiles the same kernel; then it is compiled here

_LOCATORS = "UserProvidedCacheLocator,InTreeCacheLocator,UserWideCacheLocator,ZipCacheLocator"


class ContentLocator(caching._CacheLocator):
    """Tells numba where the kernels of a module are kept: a folder named by the module's key."""

    def __init__(self, module: str, py_file: str, code: str) -> None:
        """Name the folder; nothing is written before a kernel is saved."""
        self._py_file = py_file  # numba names it where a function cannot be kept
        self._code = code
        self._path = cache_root() / "kernels" / module / f"{module_key(module)[:16]}{FORMAT}"

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "ContentLocator | None":
        """Return the locator of a kernel of ours or of a guest; None for other packages."""
        module = py_func.__module__
        if not is_kernel_module(module):
            return None
        return cls(module, py_file, code_key(py_func))

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(self._path)

    def ensure_cache_path(self) -> None:
        """Make the folder, and remove those of old states of the same module."""
        super().ensure_cache_path()
        _remove_old(self._path)

    def get_source_stamp(self) -> str:
        """Return the same for every state: the folder's name tells the states apart."""
        return ""

    def get_disambiguator(self) -> str:
        """Return a hash of the loaded code: several functions may have one qualified name."""
        return self._code


class _OpenedCache(caching.FunctionCache):
    """A kernel's cache that lets one process compile while all others wait for its result."""

    def __init__(self, function: Any) -> None:
        """Open the cache; nothing is locked."""
        super().__init__(function)
        files: Any = LibraryFiles(Path(self._cache_path), self._impl.filename_base)
        self._cache_file = files
        self._held: BaseFileLock | None = None

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return the compiled kernel; None, and hold the lock, where it is to be compiled here."""
        self._release()  # held still where a compilation failed
        found = self._loaded(signature, target_context)
        if found is not None:
            return found
        from filelock import FileLock, Timeout  # what only compiles is not loaded to run

        _spare_blas()
        with contextlib.suppress(OSError, Timeout):
            Path(self._cache_path).mkdir(parents=True, exist_ok=True)
            lock = FileLock(f"{self._cache_path}/{self._impl.filename_base}.lock")
            lock.acquire(timeout=WAIT_S, poll_interval=0.02)
            self._held = lock
            found = super().load_overload(signature, target_context)
            if found is not None:
                self._release()
        return found

    def _loaded(self, signature: Any, target_context: Any) -> Any:
        """Return the compiled kernel, if it is kept.

        numba's own way loads all that it can compile first, which takes a tenth of a second;
        machine code needs the counts of references only.
        """
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(signature, target_context)

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep a kernel that was compiled, and let those go on that wait for it.

        Where it cannot be kept, one line says so, and it serves this process alone.
        """
        try:
            super().save_overload(signature, data)
        except OSError as error:
            text = f"{self._cache_path}: {error.strerror or error}; kernels are not kept"
            MESSAGES.say("not kept", text)
        finally:
            self._release()

    def _release(self) -> None:
        if self._held is not None:
            self._held.release()
            self._held = None


class SharedCache:
    """A kernel's cache, opened when it is first asked: most kernels of a process never are."""

    def __init__(self, function: Any) -> None:
        """Note whose it is."""
        self._function = function
        self._opened: Any = None

    def __getattr__(self, name: str) -> Any:
        """Open the cache, and return its attribute of this name."""
        if self._opened is None:
            self._opened = _OpenedCache(self._function)
        return getattr(self._opened, name)


def use_content_cache() -> None:
    """Have numba keep kernels by their content, from now on, in this process and its children."""
    config: Any = numba.config
    config.CACHE_LOCATOR_CLASSES = f"{__name__}.{ContentLocator.__name__},{_LOCATORS}"
    use_kept_libraries()
    use_kept_runtime()


@functools.cache
def _spare_blas() -> None:
    """Have numba believe in BLAS unseen: to look for it, it loads scipy.linalg, which takes 0.2 s.

    To be called before anything is compiled.

    A kernel that does use BLAS loads it when it is compiled; none of ours does, as BLAS is not
    reproducible bit by bit.
    """
    from numba.np import linalg

    look, linalg.ensure_blas = linalg.ensure_blas, lambda: None
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = look


def code_key(function: Any) -> str:
    """Return a hash of a function's own code and of all code that its module loaded.

    Functions in one place of the source, such as two lambdas, share their qualified name. numba
    tells them apart by their line, which an edit above would change; or by their instructions,
    which are alike where only a name or a constant differs.
    """
    parts = code_of(function.__code__, function.__doc__), loaded_key(function.__module__)
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:12]


def _remove_old(current: Path) -> None:
    """Remove the kernels of older states of a module; silent where that cannot be done.

    The newest `NUM_KEPT_CACHES` stay, and all that were used within `KEPT_S`. A process that still
    uses a removed one compiles again what it has not loaded yet.
    """
    with contextlib.suppress(OSError):
        os.utime(current)
        states = sorted(current.parent.iterdir(), key=lambda path: path.stat().st_mtime)
        for path in states[:-NUM_KEPT_CACHES]:
            if time.time() - path.stat().st_mtime > KEPT_S:
                shutil.rmtree(path, ignore_errors=True)
