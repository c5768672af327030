"""Where compiled kernels are kept: under the content of the code that they were made from.

numba's own cache looks at the path, the time stamp and the line numbers of a kernel's file, and
not at the files of the functions that the kernel calls. Here a module's key is a hash of its code
and of the code of every module that it imports, down to the last one, without comments, docstrings
and annotations. So no stale kernel can be loaded, an edit recompiles only what depends on it, an
edit of words recompiles nothing, and two checkouts share what is alike in them.
"""

import ast
import contextlib
import functools
import hashlib
import importlib
import json
import os
import shutil
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
import llvmlite.binding
import numba
from filelock import BaseFileLock, FileLock, Timeout
from numba.core import caching

from evoexp.numeric.kept_files import (
    MESSAGES,
    Damaged,
    cache_root,
    is_kept,
    read_kept,
    write_kept,
)
from evoexp.numeric.kernel_files import USED, KernelFiles

NUM_KEPT_CACHES = 4  # [-] states of a module whose compiled kernels are kept
KEPT_S = 86_400.0  # [s] and any that was used so lately
WAIT_S = 120.0  # [s] for another process that compiles the same kernel; then it is compiled here
CERTIFIER = "evoexp.collision.certifier.certificate"  # judges the motions of every planner

_PACKAGE = "evoexp"
# Modules that keep kernels and change none; their own format is named by the folder `kernels`.
_KEEPERS = {f"evoexp.numeric.{name}" for name in ("kernel_cache", "kernel_files", "kept_files")}
_ROOT = Path(__file__).parents[2]
_files: dict[str, Path] = {}  # of modules that were found; others may be imported later
_LOCATORS = "UserProvidedCacheLocator,InTreeCacheLocator,UserWideCacheLocator,ZipCacheLocator"


class Source(NamedTuple):
    """The code of one module, as far as it can change a compiled kernel.

    Attributes:
        digest: Of its syntax tree, without docstrings and annotations of functions.
        imports: Dotted names that it imports; `package.name` may be a module or a name in one.
    """

    digest: str
    imports: tuple[str, ...]


class ContentLocator(caching._CacheLocator):
    """Tells numba where the kernels of a module are kept: a folder named by the module's key."""

    def __init__(self, module: str, py_file: str, code: str) -> None:
        """Name the folder; nothing is written before a kernel is saved."""
        self._py_file = py_file  # numba names it where a function cannot be kept
        self._code = code
        self._path = cache_root() / "kernels" / module / module_key(module)[:16]

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "ContentLocator | None":
        """Return the locator of a kernel of ours or of a guest; None for other packages."""
        module = py_func.__module__
        if _file_of(module) is None or not _is_ours(module):
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
        """Return a hash of the code: several functions may have one qualified name."""
        return self._code


class SharedCache(caching.FunctionCache):
    """A kernel's cache that lets one process compile while all others wait for its result."""

    def __init__(self, function: Any) -> None:
        """Open the cache; nothing is locked."""
        super().__init__(function)
        files: Any = KernelFiles(Path(self._cache_path), self._impl.filename_base)
        self._cache_file = files
        self._held: BaseFileLock | None = None

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return the compiled kernel; None, and hold the lock, where it is to be compiled here."""
        self._release()  # held still where a compilation failed
        found = super().load_overload(signature, target_context)
        if found is not None:
            return found
        with contextlib.suppress(OSError, Timeout):
            Path(self._cache_path).mkdir(parents=True, exist_ok=True)
            lock = FileLock(f"{self._cache_path}/{self._impl.filename_base}.lock")
            lock.acquire(timeout=WAIT_S, poll_interval=0.02)
            self._held = lock
            found = super().load_overload(signature, target_context)
            if found is not None:
                self._release()
        return found

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


def use_content_cache() -> None:
    """Have numba keep kernels by their content, from now on, in this process and its children."""
    config: Any = numba.config
    config.CACHE_LOCATOR_CLASSES = f"{__name__}.{ContentLocator.__name__},{_LOCATORS}"
    _spare_blas()


def _spare_blas() -> None:
    """Have numba believe in BLAS unseen: to look for it, it loads scipy.linalg, which takes 0.2 s.

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
    """Return a hash of a function's own code: instructions, names and constants.

    Functions in one place of the source, such as two lambdas, share their qualified name. numba
    tells them apart by their line, which an edit above would change; or by their instructions,
    which are alike where only a name or a constant differs.
    """
    return hashlib.sha256(repr(_code(function.__code__, function.__doc__)).encode()).hexdigest()[
        :12
    ]


def _code(code: Any, docstring: str | None = None) -> Any:
    """Return instructions, names and constants of a code object, without its docstring."""
    constants = [
        _code(one) if hasattr(one, "co_code") else (type(one).__name__, repr(one))
        for k, one in enumerate(code.co_consts)
        if not (k == 0 and docstring is not None and one == docstring)
    ]
    return code.co_code, code.co_names, code.co_varnames, constants


@functools.cache
def module_key(module: str) -> str:
    """Return the hash of a module's code and of all code that it imports from evoexp or its own.

    Args:
        module: Dotted name; one that cannot be found counts by its name alone.
    """
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__} {sys.version}".encode())
    for name in sorted(_reached(module)):
        source = _source_of(name)
        digest.update(f"{name}\0{source.digest if source else ''}\0".encode())
    return digest.hexdigest()


def _reached(module: str) -> set[str]:
    """Return a module and all modules that it imports, directly or not."""
    found, waiting = {module}, [module]
    while waiting:
        source = _source_of(waiting.pop())
        for name in source.imports if source else ():
            inner = name if _file_of(name) is not None else name.rpartition(".")[0]
            if inner not in found | _KEEPERS and _file_of(inner) is not None:
                found.add(inner)
                waiting.append(inner)
    return found


def _file_of(module: str) -> Path | None:
    """Return the file of a module of evoexp or of a package that is imported; None for others."""
    if module in _files:
        return _files[module]
    package, *parts = module.split(".")
    if package == _PACKAGE:
        root = _ROOT
    else:
        loaded = getattr(sys.modules.get(package), "__file__", None)
        if loaded is None:
            return None
        root = Path(loaded).parents[1] if Path(loaded).stem == "__init__" else Path(loaded).parent
    path = root.joinpath(package, *parts)
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            _files[module] = candidate
            return candidate
    return None


def _is_ours(module: str) -> bool:
    """Whether a module is evoexp's, or imports something of it."""
    source = _source_of(module)
    return source is not None and any(name.split(".")[0] == _PACKAGE for name in source.imports)


def _source_of(module: str) -> Source | None:
    """Return the code of a module; None for one of another package."""
    path = _file_of(module)
    return None if path is None else _read_source(module, path)


@functools.cache
def _read_source(module: str, path: Path) -> Source:
    """Return the code of a module; parsed once per content and then kept beside the kernels."""
    content = path.read_bytes()
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    name = hashlib.sha256(f"{sys.version}\0{package}\0".encode() + content).hexdigest()[:32]
    kept = cache_root() / "sources" / f"{name}.json"
    with contextlib.suppress(FileNotFoundError, Damaged):
        plain = json.loads(read_kept(kept))
        return Source(plain["digest"], tuple(plain["imports"]))
    source = parse(content, package)
    with contextlib.suppress(OSError):
        write_kept(kept, json.dumps(source._asdict()).encode())
    return source


def parse(content: bytes, package: str) -> Source:
    """Return the code of a file, without comments, docstrings and annotations of functions.

    Args:
        content: Of the file.
        package: Dotted name of the package that it is in, for relative imports.
    """
    tree, imports = ast.parse(content), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package.rsplit(".", node.level - 1)[0] if node.level else ""
            origin = ".".join(part for part in (base, node.module) if part)
            imports.update(f"{origin}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg):
            node.annotation = None
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = list(_without_docstring(node.body))
    ours = sorted(name for name in imports if name.split(".")[0] in (_PACKAGE, *package.split(".")))
    return Source(hashlib.sha256(ast.dump(tree).encode()).hexdigest(), tuple(ours))


def _without_docstring(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    for statement in body:
        if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
            yield statement


def is_compiled(kind: str, modules: Iterable[str]) -> bool:
    """Return whether `note_compiled` was told so, and the kernels of then are there and whole.

    Args:
        kind: What was compiled, as text.
        modules: That it is made of; the certifier's are added.
    """
    root = cache_root()
    try:
        names = json.loads(read_kept(_note(kind, modules)))
    except (FileNotFoundError, Damaged):
        return False
    return all(map(_is_whole, [root / name for name in names]))


@functools.cache
def _is_whole(path: Path) -> bool:
    """Return whether a kernel's file is there and undamaged; looked at once per process."""
    return is_kept(path)


def note_compiled(kind: str, modules: Iterable[str]) -> None:
    """Note that every kernel that something of this kind needs is kept; silent where it cannot.

    All files that this process used are noted: kernels that it had loaded before may be among those
    that are needed.
    """
    root = cache_root()
    names = sorted(str(path.relative_to(root)) for path in USED if path.is_relative_to(root))
    with contextlib.suppress(OSError):
        write_kept(_note(kind, modules), json.dumps(names).encode())
    _is_whole.cache_clear()


def _note(kind: str, modules: Iterable[str]) -> Path:
    processor = [os.environ.get(f"NUMBA_CPU_{name}") for name in ("NAME", "FEATURES")]
    keys = [module_key(module) for module in sorted({*modules, CERTIFIER})]
    parts = repr((llvmlite.binding.get_host_cpu_name(), processor, keys, kind))
    return cache_root() / "compiled" / hashlib.sha256(parts.encode()).hexdigest()[:32]


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
